#include "runtime/solid/row_factor.h"

#include <Eigen/Eigenvalues>

namespace archetide {
namespace {

using Blocks = std::vector<std::map<int, MatX>>;

/// The block that is left with the fewest rows beside it.
int least_degree(const Blocks& blocks, const std::vector<char>& done) {
  int best = -1;
  long least = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (done[i]) continue;
    long degree = 0;
    for (const auto& [j, block] : blocks[i])
      if (j != static_cast<int>(i)) degree += block.cols();
    if (best < 0 || degree < least) best = static_cast<int>(i), least = degree;
  }
  return best;
}

MatX pivot_inverse(const MatX& pivot, int& rank) {
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(0.5 * (pivot + pivot.transpose()));
  VecX inverse = eigen.eigenvalues();
  for (double& v : inverse) {
    rank += v > RowFactor::kPivotCut;
    v = v > RowFactor::kPivotCut ? 1.0 / v : 0.0;
  }
  return eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace

void RowFactor::setup(Blocks blocks) {
  columns_.clear();
  rank_ = 0;
  std::vector<char> done(blocks.size(), 0);
  for (std::size_t step = 0; step < blocks.size(); ++step) {
    const int i = least_degree(blocks, done);
    done[i] = 1;
    std::map<int, MatX> row = std::move(blocks[i]);
    Column column{i, pivot_inverse(row.at(i), rank_), {}};
    row.erase(i);
    for (const auto& [j, S_ij] : row) {
      blocks[j].erase(i);
      column.below.emplace_back(j, S_ij.transpose() * column.pivot_inverse);
    }
    // S_jl -= L_j S_il
    for (const auto& [j, L] : column.below)
      for (const auto& [l, S_il] : row) {
        MatX& target = blocks[j][l];
        if (target.size() == 0) target = MatX::Zero(L.rows(), S_il.cols());
        target.noalias() -= L * S_il;
      }
    columns_.push_back(std::move(column));
  }
}

void RowFactor::solve_given(std::vector<MatX>& x) const {
  for (const Column& c : columns_) {
    const MatX& given = x[c.block];
    if (given.size() == 0) continue;
    for (const auto& [j, L] : c.below) {
      if (x[j].size() == 0) x[j] = MatX::Zero(L.rows(), given.cols());
      x[j].noalias() -= L * given;
    }
  }
  for (auto c = columns_.rbegin(); c != columns_.rend(); ++c) {
    if (x[c->block].size() == 0) continue;
    MatX z = c->pivot_inverse * x[c->block];
    for (const auto& [j, L] : c->below) z.noalias() -= L.transpose() * x[j];
    x[c->block] = std::move(z);
  }
}

}  // namespace archetide
