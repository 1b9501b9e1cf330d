#include <CGAL/Polygon_mesh_processing/corefinement.h>

#include "common/base/input_error.h"
#include "precompute/intake/cgal_surface.h"
#include "precompute/intake/repair_steps.h"

namespace archetide {

TriMesh unite(const std::vector<TriMesh>& solids) {
  namespace pmp = CGAL::Polygon_mesh_processing;
  cgal::SurfaceMesh all = cgal::to_surface_mesh(cgal::to_soup(solids.at(0)));
  try {
    for (std::size_t s = 1; s < solids.size(); ++s) {
      cgal::SurfaceMesh next = cgal::to_surface_mesh(cgal::to_soup(solids[s]));
      const auto watch = CGAL::parameters::throw_on_self_intersection(true);
      cgal::SurfaceMesh result;
      if (!pmp::corefine_and_compute_union(all, next, result, watch, watch)) {
        throw InputError("the union of the parts is not manifold (they touch along an edge)",
                         "move them apart or into each other, or set repair = \"wrap\"");
      }
      all = std::move(result);
    }
  } catch (const pmp::Corefinement::Self_intersection_exception&) {
    throw InputError("repair = \"union\": a part intersects itself", "set repair = \"wrap\"");
  }
  return cgal::to_tri_mesh(all);
}

}  // namespace archetide
