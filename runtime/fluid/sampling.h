#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>

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

  /// Along z, y, x in this order: the two corners along x, neighbours in memory, go together.
  double at(std::size_t n, double fx, double fy, double fz) const {
    const double* p = values + n;
    const double* q = p + sz;
    const Pair low = blend(pair(p), pair(q), fz), high = blend(pair(p + sy), pair(q + sy), fz);
    const Pair line = blend(low, high, fy);
    return line[0] + fx * (line[1] - line[0]);
  }
  double at(Slot x, Slot y, Slot z) const { return at(base(x, y, z), x.f, y.f, z.f); }

  /// The eight corner values, x fastest.
  void corners(std::size_t n, double c[8]) const {
    const double* p = values + n;
    c[0] = p[0], c[1] = p[sx], c[2] = p[sy], c[3] = p[sx + sy];
    c[4] = p[sz], c[5] = p[sx + sz], c[6] = p[sy + sz], c[7] = p[sx + sy + sz];
  }
  /// Smallest and largest of them.
  void range(std::size_t n, double& low, double& high) const {
    double c[8];
    corners(n, c);
    low = high = c[0];
    for (int m = 1; m < 8; ++m) low = std::min(low, c[m]), high = std::max(high, c[m]);
  }

 private:
  typedef double Pair __attribute__((vector_size(16)));
  Pair pair(const double* p) const {
    if (sx == 0) return Pair{p[0], p[0]};
    Pair both;
    std::memcpy(&both, p, sizeof(both));
    return both;
  }
  static Pair blend(Pair a, Pair b, double f) { return a + f * (b - a); }
};

/// Trilinear mean over the corners of a cell, by index in the array, that count; `otherwise` when
/// none does.
template <class Counts>
double mean_where(const Lattice& f, const Slot s[3], const Counts& counts, double otherwise) {
  const std::size_t n = f.base(s[0], s[1], s[2]);
  double sum = 0.0, weight = 0.0;
  for (int c = 0; c < 8; ++c) {
    const std::size_t m = n + (c & 1 ? f.sx : 0) + (c & 2 ? f.sy : 0) + (c & 4 ? f.sz : 0);
    if (!counts(m)) continue;
    const double w = (c & 1 ? s[0].f : 1 - s[0].f) * (c & 2 ? s[1].f : 1 - s[1].f) *
                     (c & 4 ? s[2].f : 1 - s[2].f);
    sum += w * f.values[m], weight += w;
  }
  return weight > 1e-12 ? sum / weight : otherwise;
}

/// Three numbers, one an axis, in one register; the fourth is 0. (Passed by reference: without AVX
/// in the flags the calling convention differs.)
typedef double Axes __attribute__((vector_size(32)));

/// The ends of a lattice; clamped_slot of the three axes at once.
struct LatticeEnds {
  Axes end = {}, last = {};  // largest coordinate, last slot

  void set(int axis, int n) { end[axis] = n - 1, last[axis] = std::max(n - 2, 0); }
  void clamp(const Axes& s, Slot slots[3]) const {
    typedef int Cells __attribute__((vector_size(16)));
    Axes inside = s > 0.0 ? s : Axes{};
    inside = inside < end ? inside : end;
    const Cells cell = __builtin_convertvector(inside < last ? inside : last, Cells);
    const Axes f = inside - __builtin_convertvector(cell, Axes);
    for (int a = 0; a < 3; ++a) slots[a] = {cell[a], f[a]};
  }
};

/// A cell-centred field at positions in cell units (0..nx, 0..ny, 0..nz), clamped at the boundary.
struct CellSampler {
  Lattice lattice;
  LatticeEnds ends;

  CellSampler(const Grid& g, const Array3<double>& field) : lattice(field) {
    for (int a = 0; a < 3; ++a) ends.set(a, g.size(a));
  }
  double at(const Axes& x) const {
    Slot s[3];
    ends.clamp(x - 0.5, s);
    return lattice.at(s[0], s[1], s[2]);
  }
};

/// All components of a MAC field at positions in cell units (0..nx, 0..ny, 0..nz), clamped at the
/// boundary.
struct MacSampler {
  Lattice u, v, w;
  LatticeEnds faces, centres;   // all axes as the staggered one, or as the others
  LatticeEnds of_component[3];  // of the points of each component

  MacSampler(const Grid& g, const MacField& field) : u(field[0]), v(field[1]), w(field[2]) {
    for (int a = 0; a < 3; ++a) {
      faces.set(a, g.size(a) + 1), centres.set(a, g.size(a));
      for (int c = 0; c < 3; ++c) of_component[c].set(a, g.size(a) + (a == c));
    }
  }

  void at(const Axes& x, Axes& out) const {
    Slot f[3], c[3];
    faces.clamp(x, f);
    centres.clamp(x - 0.5, c);
    out = Axes{u.at(f[0], c[1], c[2]), v.at(c[0], f[1], c[2]), w.at(c[0], c[1], f[2]), 0.0};
  }

  /// x + h v at the midpoint: second-order Runge-Kutta from x with velocity v0 there. h = dt/dx,
  /// s/m.
  void trace(const Axes& x, const Axes& v0, double h, Axes& out) const {
    Axes v_mid;
    at(x + 0.5 * h * v0, v_mid);
    out = x + h * v_mid;
  }

  /// The slots of position x among the points of component A.
  template <int A>
  void slots(const Axes& x, Slot s[3]) const {
    const Axes half = {A == 0 ? 0.0 : 0.5, A == 1 ? 0.0 : 0.5, A == 2 ? 0.0 : 0.5, 0.0};
    of_component[A].clamp(x - half, s);
  }
};

}  // namespace archetide
