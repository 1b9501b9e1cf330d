#include <CGAL/Polyhedral_mesh_domain_with_features_3.h>

#include "precompute/meshing/cgal_mesher.h"

namespace archetide {

TetMesh mesh_with_cgal_sharp(const TriMesh& surface, double sharp_angle,
                             const MeshRequest& request) {
  using Domain = CGAL::Polyhedral_mesh_domain_with_features_3<cgal::Kernel, cgal::Polyhedron>;
  CGAL::get_default_random() = CGAL::Random(request.seed);
  Domain domain(cgal::to_polyhedron(surface), &CGAL::get_default_random());
  domain.detect_features(sharp_angle);
  std::vector<cgal::Kernel::Point_3> corners;
  for (const cgal::Seed& seed : cgal::seeds(surface, request)) corners.push_back(seed.point);
  domain.add_corners(corners.begin(), corners.end());
  return cgal::mesh_domain(domain, request);
}

}  // namespace archetide
