#pragma once

#include <memory>
#include <vector>

#include "runtime/solid/nodal_space.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// J of the surface of a body of nodes as it stands, 3 ns x (6 + 3 n): its rows are those of
/// point_jacobian(). Never formed: one node moves a vertex, and seven numbers (velocity, spin and
/// swelling that the nodes bring) move all of them.
///
/// A coupled solve splits the motion of the nodes in two (docs/method.md, C14a): the stored modes,
/// which are met as those of a reduced body, and the rest, met vertex by vertex. `to_solve` of
/// velocities and `to_body` of forces are transposes of each other.
class NodalSurface {
 public:
  /// `points`: surface_points of the body.
  NodalSurface(const ReducedBody& body, const ConfigurationTerms& terms,
               const std::vector<Vec3>& points);

  int vertices() const { return static_cast<int>(arms_.size()); }  // ns
  int reduced_dofs() const { return space_->reduced_dofs(); }      // 6 + r
  int rows() const { return reduced_dofs() + 3 * vertices(); }     // 6 + r + 3 ns
  const NodalSpace& space() const { return *space_; }

  MatX velocity(const MatX& y) const;  // J y, columns side by side
  MatX force(const MatX& g) const;     // J^T g
  /// J of the stored modes, 3 ns x (6 + r), and the spin that is taken out of them, 3 x r.
  const MatX& reduced_jacobian() const { return reduced_jacobian_; }
  const MatX& spin_of_modes() const { return spin_of_modes_; }

  /// (reduced velocity, J of the rest): 6 + r + 3 ns.
  MatX to_solve(const MatX& y) const;
  /// Its transpose: (reduced force, forces on the vertices) to 6 + 3 n.
  MatX to_body(const MatX& f) const;

 private:
  std::shared_ptr<const NodalSpace> space_;
  Mat3 R_;
  ShapeCorrection shape_;
  MatX spin_;               // 3 x 3 n
  std::vector<Vec3> arms_;  // ns, world, m
  MatX reduced_jacobian_, spin_of_modes_;
};

}  // namespace archetide
