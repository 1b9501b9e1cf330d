#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "runtime/numerics/poisson_matrix.h"

namespace archetide {

/// Modified incomplete Cholesky, no fill, tau = 0.97, sigma = 0.25 ([Bri15], section 5.4) on
/// the unknowns packed in x-y-z order: the usual preconditioner of this problem, to compare with.
class Mic0 {
 public:
  explicit Mic0(const PoissonMatrix& a) {
    std::vector<std::int32_t> number(a.size(), -1);
    for (std::size_t c = 0; c < a.size(); ++c) {
      if (a.kind[c] != CellKind::kUnknown) continue;
      number[c] = static_cast<std::int32_t>(cell_.size());
      cell_.push_back(c);
    }
    const std::size_t n = cell_.size();
    low_.resize(n + 1), scaled_.resize(n + 1), work_.resize(n + 1);
    for (std::size_t m = 0; m <= n; ++m)
      for (int d = 0; d < 3; ++d)
        low_[m].cell[d] = static_cast<std::int32_t>(n);  // reads work_[n] = 0
    factor(a, number);
  }

  /// z = (L L^T)^-1 r
  void apply(const double* r, double* z) {
    const auto n = static_cast<std::ptrdiff_t>(cell_.size());
    work_[n] = 0.0;
    for (std::ptrdiff_t m = 0; m < n; ++m) {
      double t = r[cell_[m]];
      for (int d = 0; d < 3; ++d)
        t += low_[m].w[d] * scaled_[low_[m].cell[d]] * work_[low_[m].cell[d]];
      work_[m] = t * scaled_[m];
    }
    for (std::ptrdiff_t m = n - 1; m >= 0; --m) {
      const double t = work_[m] * scaled_[m];
      z[cell_[m]] = t;
      for (int d = 0; d < 3; ++d)
        work_[low_[m].cell[d]] += low_[m].w[d] * scaled_[low_[m].cell[d]] * t;
    }
  }

 private:
  struct Low {
    std::int32_t cell[3];
    double w[3] = {0.0, 0.0, 0.0};
  };

  void factor(const PoissonMatrix& a, const std::vector<std::int32_t>& number) {
    constexpr double kTau = 0.97, kSigma = 0.25;
    const int stride[3] = {1, a.nx, a.nx * a.ny};
    // Coefficients of a cell's high faces to unknowns.
    const auto high = [&](std::size_t c, int d) {
      const int i[3] = {int(c % a.nx), int(c / a.nx % a.ny), int(c / a.nx / a.ny)};
      const int size[3] = {a.nx, a.ny, a.nz};
      if (i[d] + 1 >= size[d] || number[c + stride[d]] < 0) return 0.0;
      return a.w[d](i[0] + (d == 0), i[1] + (d == 1), i[2] + (d == 2));
    };
    scaled_.back() = 0.0;
    for (std::size_t m = 0; m < cell_.size(); ++m) {
      const double diag = a.diag[cell_[m]];
      double e = diag;
      for (int d = 0; d < 3; ++d) {
        const std::size_t c = cell_[m];
        if (c < static_cast<std::size_t>(stride[d]) || number[c - stride[d]] < 0) continue;
        const double w = high(c - stride[d], d);
        if (w == 0.0) continue;
        const std::int32_t l = number[c - stride[d]];
        low_[m].cell[d] = l, low_[m].w[d] = w;
        double others = 0.0;
        for (int o = 0; o < 3; ++o)
          if (o != d) others += high(c - stride[d], o);
        e -= scaled_[l] * scaled_[l] * w * (w + kTau * others);
      }
      if (e < kSigma * diag) e = diag;
      scaled_[m] = e > 0.0 ? 1.0 / std::sqrt(e) : 0.0;
    }
  }

  std::vector<std::size_t> cell_;
  std::vector<Low> low_;
  std::vector<double> scaled_, work_;  // 1 / L_mm; q
};

}  // namespace archetide
