#include "common/archetype/surface_rung.h"

#include <cmath>

namespace archetide {

double mean_edge(const TriMesh& surface) {
  // An equilateral triangle of edge a has the area a^2 sqrt(3) / 4.
  return std::sqrt(4.0 / std::sqrt(3.0) * surface_area(surface) /
                   static_cast<double>(surface.triangles.size()));
}

double mean_thickness(const TriMesh& surface) {
  return 2.0 * enclosed_volume(surface) / surface_area(surface);
}

}  // namespace archetide
