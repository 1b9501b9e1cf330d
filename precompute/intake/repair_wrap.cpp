#include <CGAL/alpha_wrap_3.h>

#include "precompute/intake/cgal_surface.h"
#include "precompute/intake/repair_steps.h"

namespace archetide {

TriMesh wrap(const TriMesh& mesh, double alpha, double offset) {
  const cgal::Soup soup = cgal::to_soup(mesh);
  cgal::SurfaceMesh result;
  CGAL::alpha_wrap_3(soup.points, soup.faces, alpha, offset, result);
  return cgal::to_tri_mesh(result);
}

}  // namespace archetide
