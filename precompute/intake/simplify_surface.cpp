#include "precompute/intake/simplify_surface.h"

#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include "precompute/intake/cgal_surface.h"

namespace archetide {
namespace {

namespace sms = CGAL::Surface_mesh_simplification;

/// Stops at a number of triangles; an edge of a closed surface takes two of them with it.
class StopAtFaces {
 public:
  explicit StopAtFaces(std::size_t faces) : faces_(faces) {}
  template <class Cost, class Profile>
  bool operator()(const Cost&, const Profile& profile, std::size_t, std::size_t) const {
    return profile.surface_mesh().number_of_faces() <= faces_;
  }

 private:
  std::size_t faces_;
};

}  // namespace

TriMesh simplify_surface(const TriMesh& surface, std::size_t faces) {
  cgal::SurfaceMesh mesh = cgal::to_surface_mesh(cgal::to_soup(surface));
  sms::edge_collapse(mesh, StopAtFaces(faces),
                     CGAL::parameters::get_cost(sms::LindstromTurk_cost<cgal::SurfaceMesh>())
                         .get_placement(sms::LindstromTurk_placement<cgal::SurfaceMesh>())
                         .filter(sms::Bounded_normal_change_filter<>()));
  return cgal::to_tri_mesh(mesh);
}

}  // namespace archetide
