#include "precompute/intake/remesh_surface.h"

#include <CGAL/Polygon_mesh_processing/detect_features.h>
#include <CGAL/Polygon_mesh_processing/remesh.h>

#include "precompute/intake/cgal_surface.h"

namespace archetide {

TriMesh remesh_surface(const TriMesh& surface, double edge, double sharp_angle) {
  namespace pmp = CGAL::Polygon_mesh_processing;
  constexpr unsigned kIterations = 3;  // of split, collapse, flip and smooth; more change little
  cgal::SurfaceMesh mesh = cgal::to_surface_mesh(cgal::to_soup(surface));
  auto sharp = mesh.add_property_map<cgal::SurfaceMesh::Edge_index, bool>("e:sharp", false).first;
  pmp::detect_sharp_edges(mesh, sharp_angle, sharp);
  pmp::isotropic_remeshing(
      mesh.faces(), edge, mesh,
      CGAL::parameters::number_of_iterations(kIterations).edge_is_constrained_map(sharp));
  return cgal::to_tri_mesh(mesh);
}

}  // namespace archetide
