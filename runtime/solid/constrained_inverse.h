#pragma once

#include <vector>

#include "common/base/types.h"
#include "runtime/solid/row_factor.h"

namespace archetide {

/// Linear rows on the generalised velocities of one or two bodies: A y_a + B y_b = target. An
/// impulse lambda (m) on them gives A^T lambda to body a and B^T lambda to body b.
struct RowBlock {
  int a = -1;   // a body
  int b = -1;   // another one, or < 0: nothing that moves
  MatX A;       // m x (6 + r_a)
  MatX B;       // m x (6 + r_b)
  VecX target;  // m, m/s
};

/// The inverse mass of bodies that rows C y = target tie to each other (docs/method.md, C17;
/// Eq. 49 with lambda_a eliminated):
///     H^-1 - H^-1 C^T (C H^-1 C^T)^+ C H^-1,
/// the (1,1) block of the inverse of [[H, C^T], [C, 0]]; C H^-1 C^T is a_33 of Eq. 49. Never
/// formed: it is H^-1 body by body and then `constrain`, O(rows) for trees of bodies.
///
/// Redundant rows are ordinary. Rows of a pair of bodies are scaled to unit diagonal of a_33; where
/// they depend on each other they are reduced to the eigenvectors whose eigenvalues exceed kRankCut
/// of the largest. Dependence that closes in loops shows as pivots below RowFactor::kPivotCut.
class ConstrainedInverse {
 public:
  static constexpr double kRankCut = 1e-10;

  /// `inverse_mass`: H^-1 of every body, (6 + r)^2 (semi-definite is allowed). Of a body of nodes
  /// in the coordinates z of its rows (NodalRows), K for 6 + r here and everywhere below.
  void setup(const std::vector<const MatX*>& inverse_mass, std::vector<RowBlock> rows);

  bool empty() const { return blocks_.empty(); }
  /// Bodies that rows touch, ascending.
  const std::vector<int>& bodies() const { return bodies_; }
  bool touches(int body) const { return touched_[static_cast<std::size_t>(body)] != 0; }
  const std::vector<RowBlock>& blocks() const { return blocks_; }
  int rank() const { return factor_.rank(); }

  /// y -= H^-1 C^T (C H^-1 C^T)^+ C y: what H^-1 f becomes for bodies that are held; one entry per
  /// body, columns side by side; those without rows are not looked at.
  template <class Matrix>
  void constrain(std::vector<Matrix>& y) const;
  /// The same; y of the bodies that `as_forces` marks becomes the force C^T (C H^-1 C^T)^+ C y
  /// whose answer they lose.
  template <class Matrix>
  void constrain(std::vector<Matrix>& y, const std::vector<char>& as_forces) const;

  /// lambda = (C H^-1 C^T)^+ (target - C y), a vector per block, N s: y + H^-1 C^T lambda keeps the
  /// rows.
  std::vector<VecX> multipliers(const std::vector<VecX>& y) const;
  /// lambda = (C H^-1 C^T)^+ speed: the multipliers that change C y by `speed` (a vector per
  /// block).
  std::vector<VecX> solve(const std::vector<VecX>& speed) const;
  /// C^T lambda of every body, 6 + r; of those without rows empty.
  std::vector<VecX> impulses(const std::vector<VecX>& lambda) const;

  /// The block of one body, (6 + r)^2: what it answers to impulses on itself.
  MatX own_block(int body) const;
  /// V^T C^T (C H^-1 C^T)^+ C V of one body that rows touch, V (6 + r) x k: with V = H^-1 what its
  /// block loses.
  MatX own_loss(int body, const MatX& V) const;

 private:
  /// All rows of a pair of bodies, reduced to independent ones: C' = T^T C.
  struct Pair {
    int a, b;
    std::vector<int> blocks;
    MatX T;         // m x k
    MatX C_a, C_b;  // k x (6 + r)
    MatX W_a, W_b;  // (6 + r) x k, H^-1 C'^T
  };
  void reduce(Pair& pair) const;
  static MatX independent(const MatX& gram);
  template <class Matrix>
  std::vector<Matrix> held_back(const std::vector<Matrix>& y) const;
  template <class OfPair>
  MatX of_own_pairs(int body, Eigen::Index n, const OfPair& of_pair) const;
  MatX coupling(const Pair& p, const Pair& q) const;
  std::vector<VecX> to_pairs(const std::vector<VecX>& blocks) const;
  std::vector<VecX> to_blocks(const std::vector<VecX>& pairs) const;

  std::vector<const MatX*> inverse_mass_;
  std::vector<RowBlock> blocks_;
  std::vector<int> bodies_;
  std::vector<char> touched_;  // per body
  std::vector<Pair> pairs_;
  RowFactor factor_;  // of C' H^-1 C'^T
};

}  // namespace archetide
