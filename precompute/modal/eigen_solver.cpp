#include "precompute/modal/eigen_solver.h"

#include <arpack/arpack.h>
#include <dlfcn.h>
#include <fmt/core.h>
#include <sys/mman.h>

#include <cmath>

#include "common/base/check.h"
#include "common/base/input_error.h"

extern "C" void dpotrf_(const char* triangle, const int* n, double* a, const int* lda, int* info);

namespace archetide {
namespace {

using Segment = Eigen::Map<VecX>;

/// y = (K - sigma M)^-1 M x on the M-complement of the deflated vectors.
class DeflatedInverse {
 public:
  DeflatedInverse(ShiftedCholesky& factor, const SparseMatrix& mass, const MatX& deflated)
      : factor_(factor), mass_(mass), deflated_(deflated), weighted_(apply_mass(mass, deflated)) {}

  /// `m_x` = M x
  void apply_to_weighted(const double* m_x, double* y) {
    factor_.solve(m_x, y);
    project(Segment(y, factor_.size()));
    ++calls_;
  }
  void project(Eigen::Ref<VecX> y) const { y -= deflated_ * (weighted_.transpose() * y); }
  VecX times_mass(const Eigen::Ref<const VecX>& x) const { return apply_mass(mass_, x); }
  int calls() const { return calls_; }

 private:
  ShiftedCholesky& factor_;
  const SparseMatrix& mass_;
  const MatX& deflated_;
  MatX weighted_;  // M times the deflated vectors
  int calls_ = 0;
};

/// A fixed start vector without symmetry, so that it has a part in every mode: golden-ratio
/// sequence.
VecX start_vector(Eigen::Index n) {
  VecX x(n);
  for (Eigen::Index i = 0; i < n; ++i)
    x[i] = std::fmod(0.6180339887498949 * double(i + 1), 1.0) - 0.5;
  return x;
}

/// ARPACK's state for dsaupd/dseupd in shift-invert mode.
struct Arpack {
  int n, nev, ncv, info = 1, ido = 0;  // info 1: residual holds the start vector
  double tolerance;
  VecX residual;
  MatX basis;
  std::vector<double> workd, workl;
  int iparam[11] = {}, ipntr[14] = {};

  Arpack(int size, const EigenOptions& o)
      : n(size),
        nev(o.count),
        ncv(2 * o.count + 1),
        tolerance(o.tolerance),
        residual(start_vector(size)),
        basis(size, 2 * o.count + 1),
        workd(3 * std::size_t(size)),
        workl(std::size_t(ncv) * (ncv + 8)) {
    iparam[0] = 1;  // exact shifts
    iparam[2] = o.max_restarts;
    iparam[6] = 3;  // shift-invert
  }

  /// One turn of the reverse communication; false when it is over.
  bool advance() {
    dsaupd_c(&ido, "G", n, "LM", nev, tolerance, residual.data(), ncv, basis.data(), n, iparam,
             ipntr, workd.data(), workl.data(), int(workl.size()), &info);
    return ido != 99;
  }
  double* slot(int k) { return workd.data() + ipntr[k] - 1; }

  void extract(double sigma, VecX& values, MatX& vectors) {
    std::vector<int> select(ncv, 1);
    values.resize(nev);
    vectors.resize(n, nev);
    int status = 0;
    dseupd_c(1, "A", select.data(), values.data(), vectors.data(), n, sigma, "G", n, "LM", nev,
             tolerance, residual.data(), ncv, basis.data(), n, iparam, ipntr, workd.data(),
             workl.data(), int(workl.size()), &status);
    if (status != 0)
      throw NumericsError(fmt::format("ARPACK dseupd failed with status {}", status));
  }
};

void iterate(Arpack& arpack, DeflatedInverse& inverse) {
  inverse.project(arpack.residual);
  while (arpack.advance()) {
    Segment y(arpack.slot(1), arpack.n);
    if (arpack.ido == -1) {
      const VecX m_x = inverse.times_mass(Segment(arpack.slot(0), arpack.n));
      inverse.apply_to_weighted(m_x.data(), y.data());
    } else if (arpack.ido == 1) {
      inverse.apply_to_weighted(arpack.slot(2), y.data());
    } else {
      y = inverse.times_mass(Segment(arpack.slot(0), arpack.n));
    }
  }
  if (arpack.info == 1)
    throw NumericsError(fmt::format("the eigensolver found only {} of {} modes in {} restarts",
                                    arpack.iparam[4], arpack.nev, arpack.iparam[2]));
  if (arpack.info != 0)
    throw NumericsError(fmt::format("ARPACK dsaupd failed with status {}", arpack.info));
}

}  // namespace

// Eq. P3.
EigenResult lowest_eigenpairs(ShiftedCholesky& factor, const SparseMatrix& mass,
                              const MatX& deflated, const EigenOptions& options) {
  ARCHETIDE_CHECK_OP(options.count, >=, 1);
  ARCHETIDE_CHECK_OP(2 * options.count + 1, <=, factor.size() - deflated.cols());
  DeflatedInverse inverse(factor, mass, deflated);
  Arpack arpack(factor.size(), options);
  iterate(arpack, inverse);

  EigenResult result;
  arpack.extract(options.sigma, result.values, result.vectors);
  result.operator_calls = inverse.calls();
  return result;
}

namespace {

/// OpenBLAS tries for ever to map its working buffer when it cannot. So it maps it here, behind a
/// trial that can fail, and keeps it: on one thread it needs no other.
void take_working_buffer() {
  constexpr std::size_t kBuffer = std::size_t{129} << 20;  // bytes: its BUFFER_SIZE, and some pages
  void* room = ::mmap(nullptr, kBuffer, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (room == MAP_FAILED)
    throw MachineError("no memory for the working buffer of OpenBLAS (129 MiB); raise ulimit -v");
  ::munmap(room, kBuffer);
  constexpr int n = 2;  // dpotrf takes it for any n; small products do without
  MatX a = MatX::Identity(n, n);
  int info = -1;
  dpotrf_("L", &n, a.data(), &n, &info);
  ARCHETIDE_CHECK_OP(info, ==, 0);
}

}  // namespace

BlasInfo prepare_blas() {
  using Config = char* (*)();
  using SetThreads = void (*)(int);
  const auto config = reinterpret_cast<Config>(dlsym(RTLD_DEFAULT, "openblas_get_config"));
  const auto set_threads =
      reinterpret_cast<SetThreads>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"));
  if (set_threads) set_threads(1);
  Eigen::setNbThreads(1);
  if (config) {
    take_working_buffer();
    return {config(), false};
  }
  if (dlsym(RTLD_DEFAULT, "MKL_Get_Version_String")) return {"MKL", false};
  if (dlsym(RTLD_DEFAULT, "bli_info_get_version_str")) return {"BLIS", false};
  return {"reference BLAS", true};
}

}  // namespace archetide
