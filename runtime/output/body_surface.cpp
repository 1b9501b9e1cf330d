#include "runtime/output/body_surface.h"

#include "common/mesh/tri_mesh.h"

namespace archetide {
namespace {

void append(const TriMesh& surface, const std::vector<Vec3>& rest, int mark, SurfaceMesh& all) {
  std::vector<Vec3> normals;
  std::vector<double> areas;
  vertex_normals_and_areas(surface, normals, areas);
  const int first = static_cast<int>(all.vertices.size());
  all.vertices.insert(all.vertices.end(), surface.vertices.begin(), surface.vertices.end());
  all.normals.insert(all.normals.end(), normals.begin(), normals.end());
  all.rest.insert(all.rest.end(), rest.begin(), rest.end());
  all.body.resize(all.vertices.size(), mark);
  for (const Vec3i& t : surface.triangles) all.triangles.push_back(t + Vec3i::Constant(first));
}

}  // namespace

SurfaceMesh bodies_surface(const std::vector<ReducedBody>& bodies,
                           const std::vector<SkinnedBodies>& skins) {
  SurfaceMesh all;
  TriMesh surface;
  const std::vector<char> skinned = skinned_bodies(bodies.size(), skins);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (skinned[b]) continue;
    const TriMesh& rest = bodies[b].archetype->surface;
    surface_points(bodies[b], surface.vertices);
    surface.triangles = rest.triangles;
    append(surface, rest.vertices, static_cast<int>(b), all);
  }
  for (const SkinnedBodies& skin : skins) {
    skin_points(
        skin, [&](int b) -> const ReducedBody& { return bodies[b]; }, surface.vertices);
    const TriMesh& rest = skin.shape->skin->surface;
    surface.triangles = rest.triangles;
    append(surface, rest.vertices, skin.bodies.front(), all);
  }
  return all;
}

}  // namespace archetide
