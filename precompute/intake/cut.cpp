#include "precompute/intake/cut.h"

#include <CGAL/Polygon_mesh_processing/corefinement.h>

#include "common/base/input_error.h"
#include "precompute/intake/cgal_surface.h"

namespace archetide {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;

double reach_of(const TriMesh& solid, const Region& region) {
  double reach = 0.0;
  for (const Vec3& x : solid.vertices)
    reach = std::max(reach, (x - region.half_space->point).norm());
  return 2.0 * reach;
}

cgal::SurfaceMesh apply(cgal::SurfaceMesh solid, const TriMesh& region, const Cut& cut) {
  const auto fail = [&](const std::string& what) {
    throw InputError({Diagnostic{cut.where, what, "move the region a little"}});
  };
  cgal::SurfaceMesh tool = cgal::to_surface_mesh(cgal::to_soup(region)), result;
  const auto watch = CGAL::parameters::throw_on_self_intersection(true);
  try {
    const bool manifold =
        cut.inside ? pmp::corefine_and_compute_intersection(solid, tool, result, watch, watch)
                   : pmp::corefine_and_compute_difference(solid, tool, result, watch, watch);
    if (!manifold) fail("what is left hangs together by an edge or a corner");
  } catch (const pmp::Corefinement::Self_intersection_exception&) {
    fail("the surface to be cut intersects itself");
  }
  if (result.number_of_faces() == 0) fail("nothing is left of the body");
  return result;
}

}  // namespace

TriMesh cut_solid(const TriMesh& solid, const std::vector<Cut>& cuts) {
  cgal::SurfaceMesh left = cgal::to_surface_mesh(cgal::to_soup(solid));
  for (const Cut& cut : cuts) {
    const double reach = cut.region.half_space ? reach_of(solid, cut.region) : 0.0;
    left = apply(std::move(left), region_surface(cut.region, reach), cut);
  }
  return cgal::to_tri_mesh(left);
}

}  // namespace archetide
