#pragma once

#include <memory>
#include <vector>

#include "runtime/solid/nodal_space.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// H^-1 of a body of nodes as a coupled solve sees it: with the water that the body carries, and
/// with the points of walls that hold it. 6 + 3 n rows, never formed: H^-1 - sum X G X^T with few
/// columns X.
class NodalInverse {
 public:
  explicit NodalInverse(GeneralisedMass H);

  const NodalSpace& space() const { return H_.nodal->space(); }
  int size() const { return H_.size(); }
  /// What seen forces (6 + r) do to seen velocities: the block of NodalSpace::seen_velocity.
  const MatX& block() const { return block_; }

  /// The mass gains C (6 + r)^2 in seen velocities; before anything else.
  void add_seen(const MatX& C);
  /// The mass gains U C U^T, U (6 + 3 n) x k.
  void add(const MatX& U, const MatX& C);
  /// The inverse loses X G X^T, X (6 + 3 n) x k, G symmetric.
  void take(MatX X, const MatX& G);

  MatX solve(const MatX& f) const;
  /// The same of seen forces, once the mass has gained what is seen; no pass over the factor.
  MatX solve_seen(const MatX& f) const;
  /// The same of many bodies at once, f[b] through inverses[b], in place.
  static void solve(const std::vector<const NodalInverse*>& inverses, std::vector<MatX>& f);

 private:
  struct Loss {
    MatX X, G;
    MatX seen;  // NodalSpace::seen_velocity of X
  };
  MatX seen_answers() const;

  GeneralisedMass H_;
  MatX block_;
  std::vector<std::shared_ptr<const Loss>> losses_;
};

}  // namespace archetide
