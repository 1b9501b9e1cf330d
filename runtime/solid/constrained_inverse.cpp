#include "runtime/solid/constrained_inverse.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <utility>

#include "common/base/check.h"

namespace archetide {
namespace {

// What a H^-1 a^T is at most for each row a of A: where no coordinate's part takes another's away.
// Coordinates have units of their own (m, rad, modes), so that no other norm of H^-1 would do.
VecX largest_answers(const MatX& A, const MatX& inverse_mass) {
  const VecX each = inverse_mass.diagonal().cwiseMax(0.0).cwiseSqrt();
  return (A.cwiseAbs() * each).cwiseAbs2();
}

}  // namespace

void ConstrainedInverse::setup(const std::vector<const MatX*>& inverse_mass,
                               std::vector<RowBlock> rows) {
  inverse_mass_ = inverse_mass;
  blocks_ = std::move(rows);
  bodies_.clear();
  touched_.assign(inverse_mass.size(), 0);
  pairs_.clear();
  std::map<std::pair<int, int>, std::vector<int>> by_pair;
  std::erase_if(blocks_, [](const RowBlock& block) { return block.A.rows() == 0; });
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    const int a = blocks_[k].a, b = std::max(blocks_[k].b, -1);
    ARCHETIDE_CHECK_OP(a, >=, 0);
    ARCHETIDE_CHECK_OP(a, !=, b);
    touched_[a] = 1;
    if (b >= 0) touched_[b] = 1;
    const std::pair<int, int> key(b < 0 ? a : std::min(a, b), b < 0 ? b : std::max(a, b));
    by_pair[key].push_back(static_cast<int>(k));
  }
  for (std::size_t b = 0; b < touched_.size(); ++b)
    if (touched_[b]) bodies_.push_back(static_cast<int>(b));

  for (auto& [key, list] : by_pair) {
    Pair pair{key.first, key.second, std::move(list), {}, {}, {}, {}, {}};
    reduce(pair);
    if (pair.T.cols() > 0) pairs_.push_back(std::move(pair));
  }
  std::vector<std::vector<int>> at(inverse_mass.size());  // pairs that touch a body
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    at[pairs_[p].a].push_back(static_cast<int>(p));
    if (pairs_[p].b >= 0) at[pairs_[p].b].push_back(static_cast<int>(p));
  }
  std::vector<std::map<int, MatX>> S(pairs_.size());
  for (const std::vector<int>& list : at)
    for (const int p : list)
      for (const int q : list) S[p][q] = coupling(pairs_[p], pairs_[q]);
  factor_.setup(std::move(S));
}

// a_33 of Eq. 49. Rows of one pair, scaled to unit diagonal of C H^-1 C^T; those that depend on
// each other drop out: C' H^-1 C'^T = 1.
void ConstrainedInverse::reduce(Pair& pair) const {
  const MatX& inverse_a = *inverse_mass_[pair.a];
  Eigen::Index m = 0;
  for (const int k : pair.blocks) m += blocks_[k].A.rows();
  MatX A = MatX::Zero(m, inverse_a.rows());
  MatX B = MatX::Zero(m, pair.b < 0 ? 0 : inverse_mass_[pair.b]->rows());
  Eigen::Index at = 0;
  for (const int k : pair.blocks) {
    const RowBlock& block = blocks_[k];
    const bool turned = block.a != pair.a;
    A.middleRows(at, block.A.rows()) = turned ? block.B : block.A;
    if (pair.b >= 0) B.middleRows(at, block.A.rows()) = turned ? block.A : block.B;
    at += block.A.rows();
  }
  MatX gram = A * inverse_a * A.transpose();
  if (pair.b >= 0) gram += B * *inverse_mass_[pair.b] * B.transpose();
  VecX scale = gram.diagonal(), size = largest_answers(A, inverse_a);
  if (pair.b >= 0) size += largest_answers(B, *inverse_mass_[pair.b]);
  constexpr double kNothing = 1e-13;  // a row that no body answers to
  for (Eigen::Index k = 0; k < m; ++k)
    scale[k] = scale[k] > kNothing * size[k] ? 1.0 / std::sqrt(scale[k]) : 0.0;
  gram = scale.asDiagonal() * gram * scale.asDiagonal();
  pair.T = scale.asDiagonal() * independent(0.5 * (gram + gram.transpose()));
  pair.C_a = pair.T.transpose() * A;
  pair.W_a = inverse_a * pair.C_a.transpose();
  if (pair.b < 0) return;
  pair.C_b = pair.T.transpose() * B;
  pair.W_b = *inverse_mass_[pair.b] * pair.C_b.transpose();
}

// T with T^T gram T = 1, gram with unit diagonal (or zero). A Cholesky factor where it shows that all
// rows are independent, as those of bodies that give way at each point are.
MatX ConstrainedInverse::independent(const MatX& gram) {
  constexpr double kClearly = 1e-6;  // of what a row does that the rows before it do not
  const Eigen::LLT<MatX> cholesky(gram);
  const auto L = cholesky.matrixL();
  if (cholesky.info() == Eigen::Success && MatX(L).diagonal().cwiseAbs2().minCoeff() > kClearly) {
    MatX T = MatX::Identity(gram.rows(), gram.cols());
    L.transpose().solveInPlace(T);
    return T;
  }
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(gram);
  const VecX& values = eigen.eigenvalues();
  const Eigen::Index kept = (values.array() > kRankCut * values.maxCoeff()).count();
  return eigen.eigenvectors().rightCols(kept) *
         values.tail(kept).cwiseSqrt().cwiseInverse().asDiagonal();
}

// The block of C' H^-1 C'^T of two pairs: what they share.
MatX ConstrainedInverse::coupling(const Pair& p, const Pair& q) const {
  MatX S = MatX::Zero(p.T.cols(), q.T.cols());
  if (p.a == q.a) S += p.C_a * q.W_a;
  if (p.b >= 0 && p.b == q.b) S += p.C_b * q.W_b;
  if (p.a == q.b) S += p.C_a * q.W_b;
  if (p.b >= 0 && p.b == q.a) S += p.C_b * q.W_a;
  return S;
}

// (C′ H⁻¹ C′ᵀ)⁻¹ C′ y of every pair.
template <class Matrix>
std::vector<Matrix> ConstrainedInverse::held_back(const std::vector<Matrix>& y) const {
  std::vector<Matrix> x(pairs_.size());
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const Pair& pair = pairs_[p];
    x[p] = pair.C_a * y[pair.a];
    if (pair.b >= 0) x[p].noalias() += pair.C_b * y[pair.b];
  }
  factor_.solve(x);
  return x;
}

// Eq. 49 with λ_a eliminated: y − H⁻¹ Cᵀ (C H⁻¹ Cᵀ)⁺ C y.
template <class Matrix>
void ConstrainedInverse::constrain(std::vector<Matrix>& y) const {
  constrain(y, std::vector<char>(y.size(), 0));
}
template <class Matrix>
void ConstrainedInverse::constrain(std::vector<Matrix>& y,
                                   const std::vector<char>& as_forces) const {
  if (pairs_.empty()) {
    for (const int b : bodies_)
      if (as_forces[b]) y[b].setZero();
    return;
  }
  const std::vector<Matrix> x = held_back(y);
  for (const int b : bodies_)
    if (as_forces[b]) y[b].setZero();
  const auto take = [&](int b, const MatX& C, const MatX& W, const Matrix& lambda) {
    if (as_forces[b])
      y[b].noalias() += C.transpose() * lambda;
    else
      y[b].noalias() -= W * lambda;
  };
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const Pair& pair = pairs_[p];
    take(pair.a, pair.C_a, pair.W_a, x[p]);
    if (pair.b >= 0) take(pair.b, pair.C_b, pair.W_b, x[p]);
  }
}
template void ConstrainedInverse::constrain(std::vector<VecX>& y) const;
template void ConstrainedInverse::constrain(std::vector<MatX>& y) const;
template void ConstrainedInverse::constrain(std::vector<VecX>&, const std::vector<char>&) const;
template void ConstrainedInverse::constrain(std::vector<MatX>&, const std::vector<char>&) const;

// T^T g of every pair.
std::vector<VecX> ConstrainedInverse::to_pairs(const std::vector<VecX>& blocks) const {
  std::vector<VecX> out;
  for (const Pair& pair : pairs_) {
    VecX g(pair.T.rows());
    Eigen::Index row = 0;
    for (const int k : pair.blocks) {
      g.segment(row, blocks[k].size()) = blocks[k];
      row += blocks[k].size();
    }
    out.emplace_back(pair.T.transpose() * g);
  }
  return out;
}

// T x of every pair, cut to its blocks.
std::vector<VecX> ConstrainedInverse::to_blocks(const std::vector<VecX>& pairs) const {
  std::vector<VecX> out(blocks_.size());
  for (std::size_t k = 0; k < blocks_.size(); ++k) out[k] = VecX::Zero(blocks_[k].A.rows());
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const VecX all = pairs_[p].T * pairs[p];
    Eigen::Index row = 0;
    for (const int k : pairs_[p].blocks) {
      out[k] = all.segment(row, out[k].size());
      row += out[k].size();
    }
  }
  return out;
}

std::vector<VecX> ConstrainedInverse::solve(const std::vector<VecX>& speed) const {
  std::vector<VecX> x = to_pairs(speed);
  factor_.solve(x);
  return to_blocks(x);
}

// Eqs. 47 and 48: λ_a from the rows of the joints.
std::vector<VecX> ConstrainedInverse::multipliers(const std::vector<VecX>& y) const {
  std::vector<VecX> lambda(blocks_.size()), now = y, missing(blocks_.size());
  // twice: the second time takes away what rounding left
  for (int turn = 0; turn < 2; ++turn) {
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      const RowBlock& block = blocks_[k];
      missing[k] = block.target - block.A * now[block.a];
      if (block.b >= 0) missing[k] -= block.B * now[block.b];
    }
    const std::vector<VecX> more = solve(missing), f = impulses(more);
    for (std::size_t k = 0; k < blocks_.size(); ++k)
      lambda[k] = turn == 0 ? more[k] : VecX(lambda[k] + more[k]);
    for (const int b : bodies_) now[b] += *inverse_mass_[b] * f[b];
  }
  return lambda;
}

// Eq. 46: Cᵀ λ_a, what the joints give to the bodies.
std::vector<VecX> ConstrainedInverse::impulses(const std::vector<VecX>& lambda) const {
  std::vector<VecX> f(inverse_mass_.size());
  for (const int b : bodies_) f[b] = VecX::Zero(inverse_mass_[b]->rows());
  for (std::size_t k = 0; k < blocks_.size(); ++k) {
    f[blocks_[k].a] += blocks_[k].A.transpose() * lambda[k];
    if (blocks_[k].b >= 0) f[blocks_[k].b] += blocks_[k].B.transpose() * lambda[k];
  }
  return f;
}

// B (C′ H⁻¹ C′ᵀ)⁻¹ Bᵀ with B of the pairs of one body: what `of_pair` gives of each, as n columns.
template <class OfPair>
MatX ConstrainedInverse::of_own_pairs(int body, Eigen::Index n, const OfPair& of_pair) const {
  std::vector<MatX> x(pairs_.size());
  const auto for_own = [&](const auto& f) {
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      if (pairs_[p].a == body) f(p, of_pair(pairs_[p].C_a, pairs_[p].W_a));
      if (pairs_[p].b == body) f(p, of_pair(pairs_[p].C_b, pairs_[p].W_b));
    }
  };
  for_own([&](std::size_t p, const auto& columns) { x[p] = columns.transpose(); });
  factor_.solve_given(x);
  MatX sum = MatX::Zero(n, n);
  for_own([&](std::size_t p, const auto& columns) { sum.noalias() += columns * x[p]; });
  return 0.5 * (sum + sum.transpose());
}

MatX ConstrainedInverse::own_block(int body) const {
  const MatX& H_inverse = *inverse_mass_[body];
  if (!touches(body)) return H_inverse;
  return 0.5 * (H_inverse + H_inverse.transpose()) -
         of_own_pairs(body, H_inverse.rows(),
                      [](const MatX&, const MatX& W) -> const MatX& { return W; });
}

MatX ConstrainedInverse::own_loss(int body, const MatX& V) const {
  ARCHETIDE_CHECK(touches(body));
  return of_own_pairs(body, V.cols(),
                      [&](const MatX& C, const MatX&) { return MatX((C * V).transpose()); });
}

}  // namespace archetide
