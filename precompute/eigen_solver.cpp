#include "precompute/eigen_solver.h"

#include <dlfcn.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/check.h"
#include "common/input_error.h"

namespace archetide {
namespace {

constexpr int kBlock = 4;     // vectors a step: the solves are for four at a time
constexpr int kExpected = 5;  // vectors that it takes, in units of the count: 3 to 5 measured
constexpr double kDependent = 1e-8;  // part of a new vector that counts as nothing new

/// (K - sigma M)^-1 M on the M-complement of the deflated vectors.
class DeflatedInverse {
 public:
  DeflatedInverse(ShiftedCholesky& factor, const SparseMatrix& mass, const MatX& deflated)
      : factor_(factor), mass_(mass), deflated_(deflated), weighted_(apply_mass(mass, deflated)) {}

  MatX operator()(const MatX& x) {
    calls_ += int(x.cols());
    MatX y = factor_.solve(apply_mass(mass_, x));
    project(y);
    return y;
  }
  void project(MatX& y) const { y -= deflated_ * (weighted_.transpose() * y); }
  MatX times_mass(const MatX& x) const { return apply_mass(mass_, x); }
  int calls() const { return calls_; }

 private:
  ShiftedCholesky& factor_;
  const SparseMatrix& mass_;
  const MatX& deflated_;
  MatX weighted_;  // M times the deflated vectors
  int calls_ = 0;
};

/// A fixed start block without symmetry, so that it has a part in every mode: golden-ratio
/// sequence.
MatX start_block(Eigen::Index n) {
  MatX x(n, kBlock);
  for (Eigen::Index i = 0; i < x.size(); ++i)
    x.data()[i] = std::fmod(0.6180339887498949 * double(i + 1), 1.0) - 0.5;
  return x;
}

/// Block Lanczos with full reorthogonalisation, [Golub, Underwood 1977]: an M-orthonormal basis V
/// of the Krylov space of the start block and T = V^T M Op V.
class Krylov {
 public:
  Krylov(DeflatedInverse& inverse, Eigen::Index n, int expected)
      : inverse_(inverse), basis_(n, expected), T_(MatX::Zero(expected, expected)) {
    MatX start = start_block(n);
    inverse_.project(start);
    orthonormalise(start);
    append(start);
  }

  int size() const { return size_ - last_; }  // of what is in T: all but the last block
  bool exhausted() const { return last_ == 0; }

  /// Op times the last block gives the next one; none when the space holds all there is.
  void extend() {
    const int from = size_ - last_;
    MatX next = inverse_(basis_.middleCols(from, last_));
    const double norm = std::sqrt((next.transpose() * inverse_.times_mass(next)).trace());
    for (int pass = 0; pass < 2; ++pass) T_.block(0, from, size_, last_) += take_off_basis(next);
    const MatX gram = next.transpose() * inverse_.times_mass(next);
    const Eigen::SelfAdjointEigenSolver<MatX> eigen(gram);
    const double least = std::pow(kDependent * norm, 2);
    const Eigen::Index fresh = (eigen.eigenvalues().array() > least).count();
    const VecX scale = eigen.eigenvalues().tail(fresh).cwiseSqrt();
    coupling_ = scale.asDiagonal() * eigen.eigenvectors().rightCols(fresh).transpose();
    next = next * eigen.eigenvectors().rightCols(fresh) * scale.cwiseInverse().asDiagonal();
    take_off_basis(next);  // what dividing has enlarged
    orthonormalise(next);
    const int to = size_, wide = last_;
    append(next);
    T_.block(to, from, fresh, wide) = coupling_;
  }

  /// Eigenpairs of T, ascending.
  Eigen::SelfAdjointEigenSolver<MatX> ritz() const {
    const MatX T = T_.topLeftCorner(size(), size());
    return Eigen::SelfAdjointEigenSolver<MatX>(0.5 * (T + T.transpose()));
  }
  /// |Op v - theta v| in the M-norm for the Ritz vector V s.
  double residual(const Eigen::Ref<const VecX>& s) const {
    return (coupling_ * s.tail(coupling_.cols())).norm();
  }
  MatX vectors(const MatX& s) const { return basis_.leftCols(s.rows()) * s; }

 private:
  MatX take_off_basis(MatX& x) const {
    const MatX part = basis_.leftCols(size_).transpose() * inverse_.times_mass(x);
    x.noalias() -= basis_.leftCols(size_) * part;
    return part;
  }
  void orthonormalise(MatX& x) const {
    if (x.cols() == 0) return;
    for (int pass = 0; pass < 2; ++pass) {
      const MatX gram = x.transpose() * inverse_.times_mass(x);
      gram.llt().matrixU().solveInPlace<Eigen::OnTheRight>(x);
    }
  }
  void append(const MatX& block) {
    if (size_ + block.cols() > basis_.cols()) {
      const Eigen::Index room = 2 * (size_ + block.cols());
      basis_.conservativeResize(Eigen::NoChange, room);
      T_.conservativeResizeLike(MatX::Zero(room, room));
    }
    basis_.middleCols(size_, block.cols()) = block;
    last_ = int(block.cols());
    size_ += last_;
  }

  DeflatedInverse& inverse_;
  MatX basis_;               // n x room, the first size_ columns in use
  MatX T_;                   // its last block of rows is not there yet
  MatX coupling_;            // last block x the one before it, of T
  int size_ = 0, last_ = 0;  // columns in use; of them in the last block
};

}  // namespace

EigenResult lowest_eigenpairs(ShiftedCholesky& factor, const SparseMatrix& mass,
                              const MatX& deflated, const EigenOptions& options) {
  const int count = options.count;
  ARCHETIDE_CHECK_OP(count, >=, 1);
  ARCHETIDE_CHECK_OP(2 * count + 1, <=, factor.size() - deflated.cols());
  DeflatedInverse inverse(factor, mass, deflated);
  Krylov space(inverse, factor.size(), kExpected * count);
  int found = 0;
  while (!space.exhausted() && space.size() < options.most_vectors * count) {
    space.extend();
    if (space.size() < count) continue;
    const auto ritz = space.ritz();
    const auto theta = ritz.eigenvalues().tail(count).reverse();
    const auto s = ritz.eigenvectors().rightCols(count).rowwise().reverse();
    found = 0;
    while (found < count && space.residual(s.col(found)) <= options.tolerance * theta[found])
      ++found;
    if (found < count) continue;
    return {options.sigma + theta.cwiseInverse().array(), space.vectors(s), inverse.calls()};
  }
  throw NumericsError("the eigensolver found only " + std::to_string(found) + " of " +
                      std::to_string(count) + " modes in " + std::to_string(inverse.calls()) +
                      " solves");
}

BlasInfo prepare_blas() {
  using Config = char* (*)();
  using SetThreads = void (*)(int);
  const auto config = reinterpret_cast<Config>(dlsym(RTLD_DEFAULT, "openblas_get_config"));
  const auto set_threads =
      reinterpret_cast<SetThreads>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"));
  if (set_threads) set_threads(1);
  Eigen::setNbThreads(1);
  if (config) return {config(), false};
  if (dlsym(RTLD_DEFAULT, "MKL_Get_Version_String")) return {"MKL", false};
  if (dlsym(RTLD_DEFAULT, "bli_info_get_version_str")) return {"BLIS", false};
  return {"reference BLAS", true};
}

}  // namespace archetide
