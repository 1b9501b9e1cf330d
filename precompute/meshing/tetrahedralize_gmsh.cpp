#include <gmsh.h>

#include <algorithm>
#include <string>

#include "common/base/input_error.h"
#include "common/mesh/surface_topology.h"
#include "precompute/base/defects.h"
#include "precompute/meshing/meshers.h"

namespace archetide {
namespace {

constexpr int kTriangle = 2, kTet = 4;  // gmsh element types
/// Mesh.Algorithm3D. Debian's Frontal fails; HXT is faster, but with the same input its tets depend
/// on what the process did before.
constexpr int kDelaunay = 1;

/// A silent gmsh on one thread (two are not reproducible) that always ends.
struct GmshSession {
  GmshSession() {
    gmsh::initialize(0, nullptr, false);
    gmsh::option::setNumber("General.Terminal", 0);
    gmsh::option::setNumber("General.NumThreads", 1);
    gmsh::option::setNumber("Mesh.Algorithm3D", kDelaunay);
    gmsh::option::setNumber("Mesh.Optimize", 1);
    // Above 0.2 the optimiser spent minutes on tets that bad boundary triangles pin (fandisk).
    gmsh::option::setNumber("Mesh.OptimizeThreshold", 0.2);
  }
  ~GmshSession() { gmsh::finalize(); }
};

/// A shell as discrete entity `number` and the loop of the same number; `before`: nodes there are.
void add_shell(const TriMesh& surface, int number, std::size_t before) {
  gmsh::model::addDiscreteEntity(2, number);
  std::vector<std::size_t> tags, corners;
  std::vector<double> coordinates;
  for (const Vec3& x : surface.vertices) {
    tags.push_back(before + tags.size() + 1);
    coordinates.insert(coordinates.end(), {x[0], x[1], x[2]});
  }
  for (const Vec3i& t : surface.triangles)
    for (int k = 0; k < 3; ++k) corners.push_back(before + std::size_t(t[k]) + 1);
  gmsh::model::mesh::addNodes(2, number, tags, coordinates);
  gmsh::model::mesh::addElementsByType(number, kTriangle, {}, corners);
  gmsh::model::geo::addSurfaceLoop({number}, number);
}

/// The volume that the surface bounds: inside its outer shell, outside its cavities.
void add_body(const TriMesh& surface) {
  gmsh::model::add("body");
  int count = 0;
  const std::vector<int> shell = shells(surface, surface_edges(surface), count);
  std::vector<std::vector<int>> lists(count);
  for (int t = 0; t < int(shell.size()); ++t) lists[shell[t]].push_back(t);
  std::size_t nodes = 0;
  std::vector<int> loops;  // the outer shell first
  for (int s = 0; s < count; ++s) {
    const TriMesh part = part_of(surface, lists[s]);
    add_shell(part, s + 1, nodes);
    nodes += part.vertices.size();
    loops.insert(enclosed_volume(part) > 0 ? loops.begin() : loops.end(), s + 1);
  }
  gmsh::model::geo::addVolume(loops, 1);
  gmsh::model::geo::synchronize();
}

/// Nodes in the order in which the tets mention them.
TetMesh read_tets() {
  std::vector<std::size_t> node_tags, tet_tags, corners;
  std::vector<double> coordinates, parameters;
  gmsh::model::mesh::getNodes(node_tags, coordinates, parameters);
  gmsh::model::mesh::getElementsByType(kTet, tet_tags, corners);
  std::size_t largest = 0;
  for (std::size_t tag : node_tags) largest = std::max(largest, tag);
  std::vector<std::size_t> place(largest + 1);
  for (std::size_t i = 0; i < node_tags.size(); ++i) place[node_tags[i]] = i;

  TetMesh mesh;
  std::vector<int> index(largest + 1, -1);
  for (std::size_t c = 0; c < corners.size(); ++c) {
    int& node = index[corners[c]];
    if (node < 0) {
      node = int(mesh.nodes.size());
      mesh.nodes.emplace_back(&coordinates[3 * place[corners[c]]]);
    }
    if (c % 4 == 0) mesh.tets.emplace_back();
    mesh.tets.back()[c % 4] = node;
  }
  return mesh;
}

}  // namespace

TetMesh mesh_with_gmsh(const TriMesh& surface, const MeshRequest& request) {
  try {
    const GmshSession session;
    gmsh::option::setNumber("Mesh.RandomSeed", request.seed);
    gmsh::option::setNumber("Mesh.MeshSizeMax", request.size);
    add_body(surface);
    gmsh::model::mesh::generate(3);
    return read_tets();
  } catch (const std::string& message) {
    throw NumericsError("gmsh could not fill the surface: " + message);
  }
}

}  // namespace archetide
