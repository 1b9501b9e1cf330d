#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "runtime/grid/grid.h"
#include "runtime/numerics/poisson_matrix.h"
#include "tests/support/random_vectors.h"

namespace archetide::testing {

struct Sphere {
  Vec3 centre;    // cells
  double radius;  // cells
};

/// A tank of cells with water below a height field and solid spheres cut out of it.
struct Tank {
  int nx, ny, nz;
  double level = 0.4;               // mean height of the water / nz; above 1: full
  double wave = 0.0;                // amplitude of the wavy surface, cells
  std::vector<Sphere> obstacles{};  // solid
  Sides open_side{};
  double theta_min = 1e-3;

  /// Level set of the surface at a cell centre, cells, negative in water.
  double phi(int i, int j, int k) const {
    const double x = (i + 0.5) / nx, y = (j + 0.5) / ny;
    return k + 0.5 - level * nz - wave * std::sin(11.0 * x + 0.3) * std::cos(7.0 * y + 1.0);
  }
};

inline Grid unit_grid(int nx, int ny, int nz) {
  Grid g;
  g.nx = nx, g.ny = ny, g.nz = nz, g.dx = 1.0;
  return g;
}

/// diag from kind, w, open sides and theta(axis, water cell, neighbour cell).
template <class Theta>
void sum_diagonal(PoissonMatrix& a, Theta&& theta) {
  a.diag.resize(a.nx, a.ny, a.nz, 0.0);
  for (int k = 0; k < a.nz; ++k)
    for (int j = 0; j < a.ny; ++j)
      for (int i = 0; i < a.nx; ++i) {
        if (a.kind(i, j, k) != CellKind::kUnknown) continue;
        for (int side = 0; side < 6; ++side) {
          const int axis = side / 2, high = side % 2;
          Vec3i face(i, j, k), other(i, j, k);
          face[axis] += high, other[axis] += high ? 1 : -1;
          const double w = a.w[axis](face[0], face[1], face[2]);
          if (!a.kind.contains(other[0], other[1], other[2])) {
            if (a.open_side[side]) a.diag(i, j, k) += w / 0.5;
          } else if (a.kind(other[0], other[1], other[2]) == CellKind::kUnknown) {
            a.diag(i, j, k) += w;
          } else if (a.kind(other[0], other[1], other[2]) == CellKind::kDirichlet) {
            a.diag(i, j, k) += w / theta(axis, Vec3i(i, j, k), other);
          }
        }
      }
}

/// Open fraction of a unit face centred at x: 8 x 8 samples outside all spheres.
inline double open_fraction(const std::vector<Sphere>& spheres, const Vec3& x, int axis) {
  constexpr int kSamples = 8;
  // Faces out of reach of every sphere surface need no samples.
  bool cut = false;
  for (const Sphere& s : spheres) {
    const double distance = (x - s.centre).norm() - s.radius;
    if (distance < -1.0) return 0.0;
    cut = cut || distance < 1.0;
  }
  if (!cut) return 1.0;
  int open = 0;
  for (int a = 0; a < kSamples; ++a)
    for (int b = 0; b < kSamples; ++b) {
      Vec3 p = x;
      p[(axis + 1) % 3] += (a + 0.5) / kSamples - 0.5;
      p[(axis + 2) % 3] += (b + 0.5) / kSamples - 0.5;
      open += std::all_of(spheres.begin(), spheres.end(),
                          [&](const Sphere& s) { return (p - s.centre).norm() > s.radius; });
    }
  return static_cast<double>(open) / (kSamples * kSamples);
}

inline PoissonMatrix make_matrix(const Tank& t) {
  const Grid g = unit_grid(t.nx, t.ny, t.nz);
  PoissonMatrix a;
  a.nx = t.nx, a.ny = t.ny, a.nz = t.nz;
  a.open_side = t.open_side;
  a.w.resize(g, 1.0);
  for (int axis = 0; axis < 3; ++axis) {
    Array3<double>& w = a.w[axis];
    for (int k = 0; k < w.nz(); ++k)
      for (int j = 0; j < w.ny(); ++j)
        for (int i = 0; i < w.nx(); ++i) {
          const int at = axis == 0 ? i : axis == 1 ? j : k;
          const bool low = at == 0, high = at == g.size(axis);
          const bool closed =
              (low && !t.open_side[2 * axis]) || (high && !t.open_side[2 * axis + 1]);
          w(i, j, k) =
              closed ? 0.0 : open_fraction(t.obstacles, g.face_centre(axis, i, j, k), axis);
        }
  }
  a.kind.resize(t.nx, t.ny, t.nz, CellKind::kOutside);
  for (int k = 0; k < t.nz; ++k)
    for (int j = 0; j < t.ny; ++j)
      for (int i = 0; i < t.nx; ++i) {
        const double open = a.w[0](i, j, k) + a.w[0](i + 1, j, k) + a.w[1](i, j, k) +
                            a.w[1](i, j + 1, k) + a.w[2](i, j, k) + a.w[2](i, j, k + 1);
        if (open > 0.0)
          a.kind(i, j, k) = t.phi(i, j, k) < 0.0 ? CellKind::kUnknown : CellKind::kDirichlet;
      }
  sum_diagonal(a, [&](int, const Vec3i& water, const Vec3i& air) {
    const double inside = -t.phi(water[0], water[1], water[2]);
    const double outside = t.phi(air[0], air[1], air[2]);
    return std::clamp(inside / (inside + outside), t.theta_min, 1.0);
  });
  return a;
}

/// Spheres of random place and size in the box.
inline std::vector<Sphere> random_spheres(int count, int nx, int ny, int nz, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double size = std::min({nx, ny, nz});
  std::vector<Sphere> spheres;
  for (int s = 0; s < count; ++s)
    spheres.push_back({random_vec3(unit, random).cwiseProduct(Vec3(nx, ny, nz)),
                       size * (0.03 + 0.09 * unit(random))});
  return spheres;
}

/// A small box in which every cell is water, air or solid and every face open by a fraction, all by
/// chance.
inline PoissonMatrix random_matrix(int nx, int ny, int nz, unsigned seed, Sides open_side = {}) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const Grid g = unit_grid(nx, ny, nz);
  PoissonMatrix a;
  a.nx = nx, a.ny = ny, a.nz = nz;
  a.open_side = open_side;
  a.kind.resize(nx, ny, nz);
  for (std::size_t n = 0; n < a.kind.size(); ++n) {
    const double u = unit(random);
    a.kind[n] = u < 0.7 ? CellKind::kUnknown : u < 0.8 ? CellKind::kDirichlet : CellKind::kOutside;
  }
  a.w.resize(g, 0.0);
  for (auto& component : a.w.axis)
    for (std::size_t n = 0; n < component.size(); ++n) component[n] = 0.05 + 0.95 * unit(random);
  sum_diagonal(a, [&](int, const Vec3i&, const Vec3i&) { return 0.5; });
  return a;
}

/// The number of each unknown, -1 elsewhere.
inline std::vector<int> number_unknowns(const PoissonMatrix& a) {
  std::vector<int> number(a.size(), -1);
  int count = 0;
  for (std::size_t n = 0; n < a.size(); ++n)
    if (a.kind[n] == CellKind::kUnknown) number[n] = count++;
  return number;
}

/// The matrix written out from its definition, unknowns only.
inline MatX dense_matrix(const PoissonMatrix& a) {
  const std::vector<int> number = number_unknowns(a);
  const int count = *std::max_element(number.begin(), number.end()) + 1;
  MatX dense = MatX::Zero(count, count);
  for (int k = 0; k < a.nz; ++k)
    for (int j = 0; j < a.ny; ++j)
      for (int i = 0; i < a.nx; ++i) {
        const int row = number[a.kind.index(i, j, k)];
        if (row < 0) continue;
        dense(row, row) = a.diag(i, j, k);
        for (int axis = 0; axis < 3; ++axis) {
          Vec3i low(i, j, k);
          if (--low[axis] < 0) continue;
          const int column = number[a.kind.index(low[0], low[1], low[2])];
          if (column >= 0) dense(row, column) = dense(column, row) = -a.w[axis](i, j, k);
        }
      }
  return dense;
}

/// The entries of unknowns, in order.
inline VecX gather(const PoissonMatrix& a, const std::vector<double>& v) {
  std::vector<double> packed;
  for (std::size_t n = 0; n < v.size(); ++n)
    if (a.kind[n] == CellKind::kUnknown) packed.push_back(v[n]);
  return Eigen::Map<const VecX>(packed.data(), static_cast<Eigen::Index>(packed.size()));
}

/// Uniform in [-1, 1] on unknowns, 0 elsewhere.
inline std::vector<double> random_vector(const PoissonMatrix& a, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<double> v(a.size(), 0.0);
  for (std::size_t n = 0; n < v.size(); ++n)
    if (a.kind[n] == CellKind::kUnknown) v[n] = unit(random);
  return v;
}

}  // namespace archetide::testing
