#include <CGAL/Polyhedral_mesh_domain_3.h>

#include "precompute/meshing/cgal_mesher.h"

namespace archetide {
namespace {

using Domain = CGAL::Polyhedral_mesh_domain_3<cgal::Polyhedron, cgal::Kernel>;

/// Also begins with the seeds: where a short segment through the middle of the triangle meets the
/// surface.
class SeededDomain : public Domain {
 public:
  SeededDomain(const cgal::Polyhedron& polyhedron, std::vector<cgal::Seed> seeds)
      : Domain(polyhedron, &CGAL::get_default_random()), seeds_(std::move(seeds)) {}

  struct Construct_initial_points {
    const SeededDomain& domain;
    template <class Out>
    Out operator()(Out out, int n = 8) const {
      out = domain.Domain::construct_initial_points_object()(out, n);
      for (const cgal::Seed& seed : domain.seeds_) {
        const auto met = domain.construct_intersection_object()(
            cgal::Kernel::Segment_3(seed.point + seed.across, seed.point - seed.across));
        if (std::get<2>(met) != 0) *out++ = std::make_pair(std::get<0>(met), std::get<1>(met));
      }
      return out;
    }
  };
  Construct_initial_points construct_initial_points_object() const { return {*this}; }

 private:
  std::vector<cgal::Seed> seeds_;
};

}  // namespace

TetMesh mesh_with_cgal(const TriMesh& surface, const MeshRequest& request) {
  CGAL::get_default_random() = CGAL::Random(request.seed);
  const cgal::Polyhedron polyhedron = cgal::to_polyhedron(surface);
  return cgal::mesh_domain(SeededDomain(polyhedron, cgal::seeds(surface, request)), request);
}

}  // namespace archetide
