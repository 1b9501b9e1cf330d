#include "runtime/scene/closed_mesh.h"

#include <fmt/core.h>

#include <utility>

#include "common/base/input_error.h"
#include "common/files/surface_io.h"
#include "common/mesh/surface_topology.h"
#include "common/mesh/weld.h"

namespace archetide {
namespace {

constexpr double kFarthest =
    1e12;  // of a mesh file, whatever its unit: beyond, squares lose all places

std::string place(const Vec3& x) { return fmt::format("({:f}, {:f}, {:f})", x[0], x[1], x[2]); }

/// Every edge has two triangles that run along it in opposite directions.
void demand_closed(const std::string& path, const TriMesh& mesh) {
  for (const SurfaceEdge& edge : surface_edges(mesh)) {
    if (edge.triangles.size() == 2 && edge.runs_a_to_b[0] != edge.runs_a_to_b[1]) continue;
    throw InputError({{{path, 0, 0},
                       "the surface is not closed and consistently oriented at the edge " +
                           place(mesh.vertices[edge.a]) + " - " + place(mesh.vertices[edge.b]),
                       "every edge must belong to exactly two faces that run along it in opposite "
                       "directions"}});
  }
}

}  // namespace

TriMesh read_closed_mesh(const std::string& path) {
  const SurfaceFile file = read_surface(path);
  for (const Vec3& x : file.mesh.vertices) {
    if (!x.allFinite() || x.cwiseAbs().maxCoeff() > kFarthest)
      throw InputError({{{path, 0, 0},
                         "a coordinate is not a number, or beyond all measure: " + place(x),
                         "export the mesh again"}});
  }
  TriMesh mesh = weld(file.mesh).mesh;
  demand_closed(path, mesh);
  if (enclosed_volume(mesh) < 0.0) {
    for (Vec3i& t : mesh.triangles) std::swap(t[1], t[2]);
  }
  return mesh;
}

}  // namespace archetide
