#pragma once

#include <algorithm>
#include <cstddef>

#include "runtime/grid/grid.h"

namespace archetide {

/// Cell of an interpolation lattice along one axis and the fraction in it.
struct Slot {
  int i;
  double f;
};

/// The slot of lattice coordinate s among n points, clamped to the outermost points.
inline Slot clamped_slot(double s, int n) {
  s = std::min(std::max(s, 0.0), static_cast<double>(n - 1));
  const int i = std::min(static_cast<int>(s), std::max(n - 2, 0));
  return {i, s - i};
}

/// The same, but f leaves [0,1] beyond the outermost points: linear extrapolation.
inline Slot open_slot(double s, int n) {
  const int i = std::clamp(static_cast<int>(s), 0, std::max(n - 2, 0));
  return {i, n > 1 ? s - i : 0.0};
}

/// Trilinear view of an array, without the bookkeeping of positions. An axis with one point repeats
/// it.
struct Lattice {
  const double* values;
  int nx, ny, nz;
  std::size_t row, slab;   // strides of the array along y and z
  std::size_t sx, sy, sz;  // steps to the next corner

  explicit Lattice(const Array3<double>& a)
      : values(a.data()),
        nx(a.nx()),
        ny(a.ny()),
        nz(a.nz()),
        row(a.nx()),
        slab(row * a.ny()),
        sx(nx > 1 ? 1 : 0),
        sy(ny > 1 ? row : 0),
        sz(nz > 1 ? slab : 0) {}

  std::size_t base(Slot x, Slot y, Slot z) const { return x.i + row * y.i + slab * z.i; }

  double at(std::size_t n, double fx, double fy, double fz) const {
    const double* p = values + n;
    const double* q = p + sz;
    const double c00 = p[0] + fx * (p[sx] - p[0]);
    const double c10 = p[sy] + fx * (p[sy + sx] - p[sy]);
    const double c01 = q[0] + fx * (q[sx] - q[0]);
    const double c11 = q[sy] + fx * (q[sy + sx] - q[sy]);
    const double c0 = c00 + fy * (c10 - c00), c1 = c01 + fy * (c11 - c01);
    return c0 + fz * (c1 - c0);
  }
  double at(Slot x, Slot y, Slot z) const { return at(base(x, y, z), x.f, y.f, z.f); }

  /// Smallest and largest of the eight corner values.
  void range(std::size_t n, double& low, double& high) const {
    const double* p = values + n;
    const double c[8] = {p[0],  p[sx],      p[sy],      p[sx + sy],
                         p[sz], p[sx + sz], p[sy + sz], p[sx + sy + sz]};
    low = high = c[0];
    for (int m = 1; m < 8; ++m) low = std::min(low, c[m]), high = std::max(high, c[m]);
  }
};

/// All components of a MAC field at positions in cell units (0..nx, 0..ny, 0..nz), clamped at the
/// boundary.
struct MacSampler {
  Lattice u, v, w;
  int nx, ny, nz;

  MacSampler(const Grid& g, const MacField& field)
      : u(field[0]), v(field[1]), w(field[2]), nx(g.nx), ny(g.ny), nz(g.nz) {}

  void operator()(double x, double y, double z, double out[3]) const {
    const Slot xf = clamped_slot(x, nx + 1), xc = clamped_slot(x - 0.5, nx);
    const Slot yf = clamped_slot(y, ny + 1), yc = clamped_slot(y - 0.5, ny);
    const Slot zf = clamped_slot(z, nz + 1), zc = clamped_slot(z - 0.5, nz);
    out[0] = u.at(xf, yc, zc);
    out[1] = v.at(xc, yf, zc);
    out[2] = w.at(xc, yc, zf);
  }

  /// x + h v at the midpoint: second-order Runge-Kutta from x with velocity v0 there. h = dt/dx,
  /// s/m.
  void trace(const double x[3], const double v0[3], double h, double out[3]) const {
    double v_mid[3];
    (*this)(x[0] + 0.5 * h * v0[0], x[1] + 0.5 * h * v0[1], x[2] + 0.5 * h * v0[2], v_mid);
    for (int a = 0; a < 3; ++a) out[a] = x[a] + h * v_mid[a];
  }
};

}  // namespace archetide
