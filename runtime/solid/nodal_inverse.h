#pragma once

#include <memory>
#include <vector>

#include "runtime/solid/nodal_space.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// Forces J^T on a body of nodes, K columns: `whole` on (P, L), `few` on a few nodes each, and
/// `spread` times `share` on all of them.
struct RowForces {
  MatX whole;                       // 6 x K
  Eigen::SparseMatrix<double> few;  // 3 n x K
  MatX spread, share;               // 3 n x s, s x K

  MatX forces(const MatX& g) const;      // J^T g, (6 + 3 n) rows
  MatX velocities(const MatX& y) const;  // J y, columns side by side
};

/// H^-1 of a body of nodes as a coupled solve sees it: with the water that the body carries, and
/// with the points of walls that hold it. 6 + 3 n rows, never formed: H^-1 - sum X G X^T with few
/// columns X.
class NodalInverse {
 public:
  explicit NodalInverse(GeneralisedMass H);

  const NodalSpace& space() const { return H_.nodal->space(); }
  int size() const { return H_.size(); }
  /// What reduced forces (6 + r) do to reduced velocities: the block of NodalSpace::reduced_velocity.
  const MatX& block() const { return block_; }

  /// The mass gains C (6 + r)^2 in reduced velocities; before anything else.
  void add_reduced(const MatX& C);
  /// The mass gains U C U^T, U (6 + 3 n) x k.
  void add(const MatX& U, const MatX& C);
  /// The inverse loses X G X^T, X (6 + 3 n) x k, G symmetric.
  void take(MatX X, const MatX& G);

  MatX solve(const MatX& f) const;
  /// The same of reduced forces; no pass over the factor.
  MatX solve_reduced(const MatX& f) const;
  /// J H^-1 J^T, K x K; half a pass over a part of the factor.
  MatX compliance(const RowForces& J) const;
  /// The same of many bodies at once, f[b] through inverses[b], in place.
  static void solve(const std::vector<const NodalInverse*>& inverses, std::vector<MatX>& f);

 private:
  struct Loss {
    MatX X, G;
    MatX reduced;  // NodalSpace::reduced_velocity of X
  };
  GeneralisedMass H_;
  std::shared_ptr<const MatX>
      reduced_;  // H^-1 of unit reduced forces, losses apart, (6 + 3 n) x (6 + r)
  MatX block_;
  std::vector<std::shared_ptr<const Loss>> losses_;
};

}  // namespace archetide
