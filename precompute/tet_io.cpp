#include "precompute/tet_io.h"

#include <gmsh.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>
#include <string_view>
#include <unordered_map>

#include "common/input_error.h"
#include "precompute/private_copy.h"
#include "precompute/tet_file.h"

namespace archetide {
namespace {

constexpr int kLinearTet = 4;  // gmsh's number of the element type

/// Gmsh is a global machine: on for the time of one reading.
class GmshSession {
 public:
  GmshSession() {
    gmsh::initialize(0, nullptr, false);
    gmsh::option::setNumber("General.Terminal", 0);
    gmsh::option::setNumber("General.NumThreads", 1);
  }
  ~GmshSession() { gmsh::finalize(); }
  GmshSession(const GmshSession&) = delete;
  GmshSession& operator=(const GmshSession&) = delete;
};

InputError refusal(const std::string& path, const std::string& what, const std::string& hint = "") {
  return InputError({Diagnostic{{path, 0, 0}, what, hint}});
}

bool has_ending(const std::string& path, const std::string& ending) {
  std::string found = std::filesystem::path(path).extension().string();
  std::transform(found.begin(), found.end(), found.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return found == ending;
}

/// The first word of a text, behind empty lines and comments.
std::string first_word(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::string word;
  while (in >> std::setw(64) >> word && word[0] == '#')
    in.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  return word;
}

/// Gmsh runs any text that it does not know as a script: only what begins as a mesh does reaches
/// it.
void demand_mesh(const std::string& path, const std::string& copy, bool medit) {
  if (medit) {
    if (first_word(copy) != "MeshVersionFormatted")
      throw refusal(path, "this is no Medit mesh: it does not begin with MeshVersionFormatted");
    return;
  }
  constexpr std::string_view kHead = "$MeshFormat";
  std::string head(kHead.size(), ' ');
  std::ifstream(copy, std::ios::binary).read(head.data(), std::streamsize(head.size()));
  if (head != kHead)
    throw refusal(path, "this is no Gmsh mesh: it does not begin with $MeshFormat",
                  "save the mesh as MSH 2 or MSH 4; scripts are not run");
}

/// Opens a copy that stands alone: gmsh also reads, and runs, X.msh.opt beside X.msh.
void open_alone(const std::string& path) {
  std::error_code problem;
  if (!std::filesystem::is_regular_file(path, problem))
    throw FileError(path + ": no such mesh file");
  const bool medit = has_ending(path, ".mesh");
  const PrivateCopy copy(path, medit ? "input.mesh" : "input.msh");
  demand_mesh(path, copy.path(), medit);
  std::string reason = "gmsh cannot read it";
  try {
    gmsh::open(copy.path());
    return;
  } catch (const std::exception& error) {
    reason += std::string(": ") + error.what();
  } catch (...) {
  }
  if (const std::size_t at = reason.find(copy.path()); at != std::string::npos)
    reason.replace(at, copy.path().size(), path);
  throw refusal(path, reason);
}

/// The tags of the corners of all tets, four by four; `elements`: the tags of the tets.
std::vector<std::size_t> corner_tags(const std::string& path, std::vector<std::size_t>& elements) {
  std::vector<int> types;
  gmsh::model::mesh::getElementTypes(types, 3);
  for (const int type : types) {
    if (type == kLinearTet) continue;
    std::string name;
    int dim = 0, order = 0, nodes = 0, primary = 0;
    std::vector<double> local;
    gmsh::model::mesh::getElementProperties(type, name, dim, order, nodes, local, primary);
    throw refusal(path, "elements of type " + name + " are not supported",
                  "export linear tetrahedra");
  }
  if (types.empty()) {
    throw refusal(path, "no tetrahedra in this file",
                  "save the volume mesh, or give a surface file");
  }
  std::vector<std::size_t> corners;
  gmsh::model::mesh::getElementsByType(kLinearTet, elements, corners);
  return corners;
}

/// Physical groups of volumes by name, by number where they have none. `elements`: tags of all
/// tets.
TetGroups physical_groups(const std::vector<std::size_t>& elements) {
  std::unordered_map<std::size_t, int> index;
  for (std::size_t t = 0; t < elements.size(); ++t) index[elements[t]] = int(t);
  gmsh::vectorpair pairs;
  gmsh::model::getPhysicalGroups(pairs, 3);
  TetGroups groups;
  for (const auto& [dimension, number] : pairs) {
    std::string name;
    gmsh::model::getPhysicalName(dimension, number, name);
    std::vector<int>& tets = groups[name.empty() ? std::to_string(number) : name];
    std::vector<int> volumes;
    gmsh::model::getEntitiesForPhysicalGroup(dimension, number, volumes);
    for (const int volume : volumes) {
      std::vector<std::size_t> members, corners;
      gmsh::model::mesh::getElementsByType(kLinearTet, members, corners, volume);
      for (const std::size_t tag : members) tets.push_back(index.at(tag));
    }
    std::sort(tets.begin(), tets.end());
  }
  return groups;
}

TetFile read_with_gmsh(const std::string& path) {
  const GmshSession session;
  open_alone(path);
  TetFile file;
  std::vector<std::size_t> elements;
  file.corners = corner_tags(path, elements);
  file.groups = physical_groups(elements);
  std::vector<double> parametric;
  gmsh::model::mesh::getNodes(file.tags, file.coordinates, parametric);
  return file;
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
  const TetFile file = has_ending(path, ".vtu") ? read_vtu(path) : read_with_gmsh(path);
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
      throw refusal(
          path, "node " + std::to_string(file.tags[i]) + " has a coordinate that is not a number");
    }
  }
  for (std::size_t i = 0; i + 3 < file.corners.size(); i += 4) {
    mesh.tets.emplace_back();
    for (int k = 0; k < 4; ++k) mesh.tets.back()[k] = number[file.corners[i + k]];
    for (const int node : mesh.tets.back()) {
      if (node < 0)
        throw refusal(path, "tet " + std::to_string(i / 4 + 1) + " names a node that is not there");
    }
  }
  orient_positively(mesh);
  if (groups) *groups = file.groups;
  return mesh;
}

}  // namespace archetide
