#include "runtime/scene/obj_mesh.h"

#include <charconv>
#include <fstream>
#include <map>
#include <sstream>
#include <string_view>

#include "common/input_error.h"

namespace archetide {
namespace {

// Reads one OBJ file line by line.
class ObjReader {
 public:
  explicit ObjReader(const std::string& path) : path_(path) {}

  TriMesh read() {
    std::ifstream file(path_);
    if (!file) throw FileError(path_ + ": cannot read this mesh; check its name and permissions");
    for (std::string line; std::getline(file, line);) {
      ++line_;
      std::istringstream words(line);
      std::string keyword;
      words >> keyword;
      if (keyword == "v") read_vertex(words);
      if (keyword == "f") read_face(words);
    }
    if (mesh_.triangles.empty()) throw InputError({{{path_, 0, 0}, "no faces in this mesh", ""}});
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError({{{path_, line_, 0}, what, ""}});
  }

  void read_vertex(std::istringstream& words) {
    Vec3 x;
    if (!(words >> x[0] >> x[1] >> x[2]) || !x.allFinite()) fail("expected three coordinates");
    mesh_.vertices.push_back(x);
  }

  // "7", "7/1", "7//3" or "-1" (counted from the last vertex) -> 0-based index
  int vertex_index(std::string_view word) const {
    int index = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), index);
    const int count = static_cast<int>(mesh_.vertices.size());
    const int zero_based = index > 0 ? index - 1 : count + index;
    if (error != std::errc() || index == 0 || zero_based < 0 || zero_based >= count) {
      fail("there is no vertex '" + std::string(word) + "'");
    }
    return zero_based;
  }

  void read_face(std::istringstream& words) {
    std::vector<int> corners;
    for (std::string word; words >> word;) corners.push_back(vertex_index(word));
    if (corners.size() < 3) fail("a face needs at least three vertices");
    for (std::size_t n = 2; n < corners.size(); ++n) {
      mesh_.triangles.emplace_back(corners[0], corners[n - 1], corners[n]);
    }
  }

  std::string path_;
  TriMesh mesh_;
  int line_ = 0;
};

// Closed and consistently oriented: every directed edge has exactly one opposite partner.
void check_closed(const std::string& path, const TriMesh& mesh) {
  std::map<std::pair<int, int>, int> edges;
  for (const Vec3i& t : mesh.triangles) {
    for (int n = 0; n < 3; ++n) ++edges[{t[n], t[(n + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    const auto opposite = edges.find({edge.second, edge.first});
    if (count == 1 && opposite != edges.end() && opposite->second == 1) continue;
    throw InputError(
        {{{path, 0, 0},
          "the surface is not closed and consistently oriented at the edge of vertices " +
              std::to_string(edge.first + 1) + " and " + std::to_string(edge.second + 1),
          "every edge must belong to exactly two faces that run along it in "
          "opposite directions"}});
  }
}

}  // namespace

TriMesh read_closed_obj(const std::string& path) {
  TriMesh mesh = ObjReader(path).read();
  check_closed(path, mesh);
  if (enclosed_volume(mesh) < 0.0) {
    for (Vec3i& t : mesh.triangles) std::swap(t[1], t[2]);
  }
  return mesh;
}

}  // namespace archetide
