#include "runtime/output/body_surface.h"

#include "common/tri_mesh.h"

namespace archetide {

SurfaceMesh bodies_surface(const std::vector<ReducedBody>& bodies) {
  SurfaceMesh all;
  TriMesh surface;
  std::vector<Vec3> normals;
  std::vector<double> areas;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    surface_points(bodies[b], surface.vertices);
    surface.triangles = bodies[b].archetype->surface.triangles;
    vertex_normals_and_areas(surface, normals, areas);
    const int first = static_cast<int>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), surface.vertices.begin(), surface.vertices.end());
    all.normals.insert(all.normals.end(), normals.begin(), normals.end());
    all.body.resize(all.vertices.size(), static_cast<int>(b));
    for (const Vec3i& t : surface.triangles) all.triangles.push_back(t + Vec3i::Constant(first));
  }
  return all;
}

}  // namespace archetide
