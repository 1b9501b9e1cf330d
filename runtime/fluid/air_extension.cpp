#include "runtime/fluid/air_extension.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "runtime/fluid/cell_list.h"
#include "runtime/numerics/vector_ops.h"

namespace archetide {
namespace {

constexpr int kFixed = -1;    // the face keeps its velocity
constexpr int kOutside = -2;  // beyond the band, where psi = 0
// Added to the diagonal: a bubble has no outside. With 1e-3 those of a splash did not converge.
constexpr double kPocket = 0.1;
constexpr double kTolerance = 1e-3;
constexpr int kMaxIterations = 40;
// How much more easily a face changes a cell farther out, as a power of two: what was continued
// from the water next to it is the better known.
constexpr double kEaseOutwards = 3.0;

// Low (side 0) or high face of cell c along `axis`, as an index of that component.
std::size_t face_of(const FaceField<double>& f, const Ijk& c, int axis, int side) {
  return f[axis].index(c.i + (axis == 0) * side, c.j + (axis == 1) * side,
                       c.k + (axis == 2) * side);
}

// The air cells next to the surface and the graph of their faces that may change.
struct Band {
  std::vector<int> cells;                   // lattice indices, ascending
  std::vector<std::array<int, 6>> beyond;   // per face: a band cell, kFixed or kOutside
  std::vector<std::array<double, 6>> ease;  // per face: u += ease grad psi
  std::vector<double> diagonal;

  void apply(const std::vector<double>& x, std::vector<double>& y) const {
    const int count = static_cast<int>(cells.size());
#pragma omp parallel for if (count > kParallelFrom)
    for (int t = 0; t < count; ++t) {
      double sum = diagonal[t] * x[t];
      for (int f = 0; f < 6; ++f)
        if (beyond[t][f] >= 0) sum -= ease[t][f] * x[beyond[t][f]];
      y[t] = sum;
    }
  }
};

// A cell that no solid cuts: its faces are open, or closed sides of the tank.
bool uncut(const Grid& g, const FaceField<double>& open, const Ijk& c) {
  const int at[3] = {c.i, c.j, c.k};
  for (int a = 0; a < 3; ++a)
    for (int side = 0; side < 2; ++side) {
      const int f = at[a] + side;
      const double w = open[a][face_of(open, c, a, side)];
      const bool tank_side = f == 0 || f == g.size(a);
      if (!(w >= 1.0 || (tank_side && w == 0.0))) return false;
    }
  return true;
}

Band build_band(const Grid& g, const Array3<double>& phi, const FaceField<double>& open,
                const FaceField<unsigned char>& solved, double reach) {
  Band band;
  band.cells = collect_cells(phi, [&](int i, int j, int k, int n) {
    return phi[n] >= 0.0 && phi[n] < reach && uncut(g, open, {i, j, k});
  });
  Array3<int> number(phi.nx(), phi.ny(), phi.nz(), kFixed);
  const int count = static_cast<int>(band.cells.size());
#pragma omp parallel for if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) number[band.cells[t]] = t;
  band.beyond.resize(count);
  band.ease.resize(count);
  band.diagonal.resize(count);
#pragma omp parallel for if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) {
    const int n = band.cells[t];
    const Ijk c = unravel(phi, n);
    band.beyond[t].fill(kOutside);  // through an open side of the tank
    band.ease[t].fill(std::exp2(kEaseOutwards * (phi[n] / g.dx)));
    for_each_neighbour(phi, c, n, [&](int axis, int side, int m) {
      const int f = 2 * axis + (side > 0);
      band.beyond[t][f] = phi[m] >= reach ? kOutside : number[m];
      band.ease[t][f] = std::exp2(kEaseOutwards * std::max(0.5 * (phi[n] + phi[m]) / g.dx, 0.0));
    });
    band.diagonal[t] = kPocket;
    for (int f = 0; f < 6; ++f) {
      const std::size_t face = face_of(open, c, f / 2, f % 2);
      if (solved[f / 2][face] == 1 || open[f / 2][face] == 0.0) band.beyond[t][f] = kFixed;
      if (band.beyond[t][f] != kFixed) band.diagonal[t] += band.ease[t][f];
    }
  }
  return band;
}

// Conjugate gradients on the band, preconditioned by the diagonal, from x = 0.
int solve_band(const Band& band, std::vector<double>& r, std::vector<double>& x) {
  const std::size_t n = r.size();
  const Blocks blocks = all_blocks(n);
  std::vector<double> z(n), p(n), q(n);
  const auto precondition = [&] {
#pragma omp parallel for simd schedule(static) if (n > kParallelFrom)
    for (std::size_t t = 0; t < n; ++t) z[t] = r[t] / band.diagonal[t];
    return dot(blocks, r.data(), z.data());
  };
  x.assign(n, 0.0);
  double rz = precondition();
  const double enough = kTolerance * kTolerance * rz;
  p = z;
  int iterations = 0;
  while (rz > enough && iterations < kMaxIterations) {
    band.apply(p, q);
    const double alpha = rz / dot(blocks, p.data(), q.data());
    axpy(blocks, alpha, p.data(), x.data());
    axpy(blocks, -alpha, q.data(), r.data());
    const double next = precondition();
    xpay(blocks, z.data(), next / rz, p.data());
    rz = next;
    ++iterations;
  }
  return iterations;
}

}  // namespace

int make_air_divergence_free(const Grid& g, const Array3<double>& phi,
                             const FaceField<double>& open, const FaceField<unsigned char>& solved,
                             double reach, double most_speedup, MacField& u) {
  const Band band = build_band(g, phi, open, solved, reach);
  const int count = static_cast<int>(band.cells.size());
  // Minus the divergence times dx, and the largest speed of the cell's faces before, m/s.
  std::vector<double> residual(count), fastest(count), psi;
#pragma omp parallel for if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) {
    const Ijk c = unravel(phi, band.cells[t]);
    double out = 0.0;
    for (int f = 0; f < 6; ++f) {
      const double face = u[f / 2][face_of(u, c, f / 2, f % 2)];
      out += f % 2 ? face : -face;
      fastest[t] = std::max(fastest[t], std::abs(face));
    }
    residual[t] = -out;
  }
  const int iterations = solve_band(band, residual, psi);

  // A face between two band cells is set from the lower one.
#pragma omp parallel for if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) {
    const Ijk c = unravel(phi, band.cells[t]);
    for (int f = 0; f < 6; ++f) {
      const int other = band.beyond[t][f];
      if (other == kFixed || (other >= 0 && f % 2 == 0)) continue;
      const double push = band.ease[t][f] * (other >= 0 ? psi[t] - psi[other] : psi[t]);
      const double most =
          most_speedup * (other >= 0 ? std::max(fastest[t], fastest[other]) : fastest[t]);
      double& face = u[f / 2][face_of(u, c, f / 2, f % 2)];
      face += f % 2 ? push : -push;
      face = std::clamp(face, -most, most);
    }
  }
  return iterations;
}

}  // namespace archetide
