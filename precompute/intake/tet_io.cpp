#include "precompute/intake/tet_io.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <unordered_map>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"

namespace archetide {
namespace {

InputError refusal(const std::string& path, const std::string& what, const std::string& hint = "") {
  return InputError({Diagnostic{{path, 0, 0}, what, hint}});
}

bool has_ending(const std::string& path, const std::string& ending) {
  std::string found = std::filesystem::path(path).extension().string();
  std::transform(found.begin(), found.end(), found.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return found == ending;
}

TetFile parse(const std::string& path, std::string_view bytes) {
  if (has_ending(path, ".vtu")) return parse_vtu(path, bytes);
  return has_ending(path, ".mesh") ? parse_medit(path, bytes) : parse_msh(path, bytes);
}

void orient_positively(TetMesh& mesh) {
  for (int t = 0; t < static_cast<int>(mesh.tets.size()); ++t) {
    if (tet_volume(mesh, t) < 0) std::swap(mesh.tets[t][2], mesh.tets[t][3]);
  }
}

}  // namespace

bool is_tet_file(const std::string& path) {
  return has_ending(path, ".msh") || has_ending(path, ".mesh") || has_ending(path, ".vtu");
}

TetMesh read_tets(const std::string& path, double scale, TetGroups* groups) {
  std::error_code problem;
  if (!std::filesystem::is_regular_file(path, problem))
    throw FileError(path + ": no such mesh file");
  return parse_tets(path, read_whole_file(path), scale, groups);
}

TetMesh parse_tets(const std::string& path, std::string_view bytes, double scale,
                   TetGroups* groups) {
  const TetFile file = parse(path, bytes);
  // Nodes keep the order of the file; those without a tet are left out.
  std::unordered_map<std::size_t, int> number;
  for (const std::size_t tag : file.corners) number[tag] = -1;
  TetMesh mesh;
  for (std::size_t i = 0; i < file.tags.size(); ++i) {
    const auto found = number.find(file.tags[i]);
    if (found == number.end() || found->second >= 0) continue;
    found->second = static_cast<int>(mesh.nodes.size());
    mesh.nodes.push_back(scale * Vec3(file.coordinates.data() + 3 * i));
    if (!mesh.nodes.back().allFinite()) {
      throw refusal(path,
                    fmt::format("node {} has a coordinate that is not a number", file.tags[i]));
    }
  }
  for (std::size_t i = 0; i + 3 < file.corners.size(); i += 4) {
    mesh.tets.emplace_back();
    for (int k = 0; k < 4; ++k) mesh.tets.back()[k] = number[file.corners[i + k]];
    for (const int node : mesh.tets.back()) {
      if (node < 0)
        throw refusal(path, fmt::format("tet {} names a node that is not there", i / 4 + 1));
    }
  }
  orient_positively(mesh);
  if (groups) *groups = file.groups;
  return mesh;
}

}  // namespace archetide
