#pragma once

#include <vector>

#include "common/archetype/archetype.h"

namespace archetide {

/// Linear modes turn elements inside out, or draw them to any length, when they are pulled far
/// enough: nothing in them resists. This keeps det F >= kLeastVolume with F = 1 + grad(S q), and
/// |grad(S q)| <= kLargestGradient, at every tet (linear) or at its ten nodes (quadratic). An
/// archetype without tets has no limit.
class InversionLimit {
 public:
  static constexpr double kLeastVolume = 0.1;  // of an element, against its rest volume
  /// Frobenius norm: five times as long. What lies beyond is no shape of the body.
  static constexpr double kLargestGradient = 4.0;

  /// Keeps a reference to the archetype. O(tets r), once for all its instances.
  explicit InversionLimit(const Archetype& archetype);

  /// No mode can do harm at q: |grad(S q)| <= sum |q_i| max |grad phi_i| <= 1 - kLeastVolume^(1/3),
  /// so that every principal stretch, and with it det F, is large enough. O(r), and conservative.
  bool surely_holds(const VecX& q) const;

  /// The largest s <= 1 such that s' q is within both limits for all s' <= s. O(r) where
  /// surely_holds, else O(tets r), and the gradients of the tets where the same bound does not hold.
  double allowed_share(const VecX& q) const;

  /// Smallest det F, 1 where there are no tets. O(nodes r + tets).
  double least_volume(const VecX& q) const;

  /// Largest |grad(S q)|, 0 where there are no tets. O(nodes r + tets).
  double largest_gradient(const VecX& q) const;

  /// Takes from q_dot what leads elements that stand at a limit beyond it, with the least change in
  /// the modal mass M_q (r x r, kg), so kinetic energy only falls: impulses along n = grad det F, or
  /// -grad |grad(S q)|^2 / 2.
  /// Returns these n, r x k.
  MatX stop_closing(const VecX& q, const MatX& M_q, VecX& q_dot) const;

 private:
  VecX displacement(const VecX& q) const;  // S q at the nodes, 3 n
  std::vector<int> doubtful_tets(const VecX& q) const;

  const Archetype& archetype_;
  Eigen::MatrixXf steep_;  // tets x r: of each mode, the largest |grad phi| (Frobenius) in a tet, 1
  VecX steepest_;          // r: in any tet
};

}  // namespace archetide
