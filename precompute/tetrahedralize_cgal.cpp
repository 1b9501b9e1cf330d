#include <CGAL/Polyhedral_mesh_domain_3.h>

#include "precompute/cgal_mesher.h"

namespace archetide {

TetMesh mesh_with_cgal(const TriMesh& surface, const MeshRequest& request) {
  using Domain = CGAL::Polyhedral_mesh_domain_3<cgal::Polyhedron, cgal::Kernel>;
  CGAL::get_default_random() = CGAL::Random(request.seed);
  const cgal::Polyhedron polyhedron = cgal::to_polyhedron(surface);
  return cgal::mesh_domain(Domain(polyhedron, &CGAL::get_default_random()), request);
}

}  // namespace archetide
