#pragma once

#include <map>
#include <vector>

#include "common/base/types.h"

namespace archetide {

/// Block-sparse factor L D L^T of a symmetric positive semi-definite matrix whose diagonal blocks
/// are unit matrices, and the solution with it of consistent systems: directions of a pivot block
/// whose eigenvalues are below kPivotCut depend on rows eliminated before and are left out. Blocks
/// are eliminated in the order of least degree (a chain of blocks fills nothing in).
class RowFactor {
 public:
  static constexpr double kPivotCut = 1e-10;

  /// blocks[i][j], size_i x size_j, for every pair that is not zero; both triangles, diagonal
  /// included.
  void setup(std::vector<std::map<int, MatX>> blocks);

  int rank() const { return rank_; }
  /// x <- S^+ x on consistent right-hand sides; one entry per block, columns side by side.
  template <class Matrix>
  void solve(std::vector<Matrix>& x) const {
    for (const Column& c : columns_)
      for (const auto& [j, L] : c.below) x[j].noalias() -= L * x[c.block];
    for (auto c = columns_.rbegin(); c != columns_.rend(); ++c) {
      Matrix z = c->pivot_inverse * x[c->block];
      for (const auto& [j, L] : c->below) z.noalias() -= L.transpose() * x[j];
      x[c->block] = z;
    }
  }
  /// The same of blocks of which many are nothing: an empty matrix. Right in the blocks that were
  /// given; others are filled in or stay empty. Takes as long as the blocks that those lead to.
  void solve_given(std::vector<MatX>& x) const;

 private:
  struct Column {
    int block;
    MatX pivot_inverse;                       // D^+
    std::vector<std::pair<int, MatX>> below;  // L
  };
  std::vector<Column> columns_;  // in the order of elimination
  int rank_ = 0;
};

}  // namespace archetide
