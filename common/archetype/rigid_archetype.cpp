#include "common/archetype/rigid_archetype.h"

#include <numeric>

namespace archetide {

Archetype rigid_archetype(const std::string& name, const TriMesh& surface, double density) {
  Archetype a;
  a.name = name;
  a.density = density;
  a.surface = surface;
  a.centre = enclosed_centroid(surface);
  for (Vec3& x : a.surface.vertices) x -= a.centre;
  vertex_normals_and_areas(a.surface, a.surface_normals, a.surface_areas);
  a.volume = enclosed_volume(a.surface);
  a.integrals.mass = density * a.volume;
  a.integrals.Sxx = density * enclosed_second_moment(a.surface);
  a.surface_modes.resize(3 * static_cast<long>(surface.vertices.size()), 0);
  a.surface_to_node.resize(surface.vertices.size());
  std::iota(a.surface_to_node.begin(), a.surface_to_node.end(), 0);
  return a;
}

}  // namespace archetide
