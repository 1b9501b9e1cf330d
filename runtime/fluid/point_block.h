#pragma once

#include "runtime/fluid/path_block.h"
#include "runtime/fluid/sampling.h"

namespace archetide {

/// Eight points that lie near to each other, as particles do that were seeded cell by cell: all of
/// them read the same three lattice points along an axis, with the weights of a hat function.

/// The coordinates along one axis and their range.
struct Spread {
  Block at;
  double low, high;

  explicit Spread(const Block& x) : at(x) {
    Block least = x, most = x;
    const auto meet = [&](const Block& a, const Block& b) {
      least = a < least ? a : least, most = b > most ? b : most;
    };
    meet(halves(least), halves(most));
    meet(pairs(least), pairs(most));
    meet(neighbours(least), neighbours(most));
    low = least[0], high = most[0];
  }

 private:
  // Halves, pairs within a half, and members of a pair change places.
  static Block halves(const Block& x) {
    return __builtin_shufflevector(x, x, 4, 5, 6, 7, 0, 1, 2, 3);
  }
  static Block pairs(const Block& x) {
    return __builtin_shufflevector(x, x, 2, 3, 0, 1, 6, 7, 4, 5);
  }
  static Block neighbours(const Block& x) {
    return __builtin_shufflevector(x, x, 1, 0, 3, 2, 5, 4, 7, 6);
  }
};

/// The points middle - 1, middle, middle + 1 of a lattice that begins at `origin` and has n points,
/// as clamped_slot reads them. `fits` is false where they do not suffice.
struct SharedSlot {
  int middle = 1;
  bool fits = false;
  Hat weight;

  SharedSlot(const Spread& x, double origin, int n) : weight(Block{}) {
    const double end = n - 1;
    const auto inside = [end](double s) { return s > 0.0 ? s < end ? s : end : 0.0; };
    middle = std::min(static_cast<int>(inside(x.low - origin)) + 1, n - 2);
    fits = middle >= 1 && inside(x.high - origin) <= middle + 1.0;
    const Block zero = {};
    Block s = x.at - origin;
    s = s > 0.0 ? s : zero, s = s < end ? s : zero + end;
    weight = Hat(s - static_cast<double>(middle));
  }
};

/// Trilinear values.
inline void interpolate_shared(const Lattice& a, const SharedSlot& x, const SharedSlot& y,
                               const SharedSlot& z, Block& out) {
  const double* p = a.values + x.middle + a.row * y.middle + a.slab * z.middle;
  out = Block{};
  for (int k = 0; k < 3; ++k) {
    Block plane = {};
    for (int j = 0; j < 3; ++j) {
      const double* q = p + a.slab * k + a.row * j - (a.slab + a.row);
      plane +=
          y.weight.at[j] * (x.weight.at[0] * q[-1] + x.weight.at[1] * q[0] + x.weight.at[2] * q[1]);
    }
    out += z.weight.at[k] * plane;
  }
}

/// Velocities at positions x, in cell units, as MacSampler gives them; false where the points are
/// too far apart.
inline bool velocity_shared(const MacSampler& u, const Block x[3], Block v[3]) {
  const Spread spread[3] = {Spread(x[0]), Spread(x[1]), Spread(x[2])};
  const SharedSlot face[3] = {{spread[0], 0.0, u.u.nx},
                              {spread[1], 0.0, u.v.ny},
                              {spread[2], 0.0, u.w.nz}},
                   centre[3] = {{spread[0], 0.5, u.v.nx},
                                {spread[1], 0.5, u.u.ny},
                                {spread[2], 0.5, u.u.nz}};
  for (int a = 0; a < 3; ++a)
    if (!face[a].fits || !centre[a].fits) return false;
  interpolate_shared(u.u, face[0], centre[1], centre[2], v[0]);
  interpolate_shared(u.v, centre[0], face[1], centre[2], v[1]);
  interpolate_shared(u.w, centre[0], centre[1], face[2], v[2]);
  return true;
}

/// Coordinates of eight points that follow each other in memory.
inline void load_points(const Vec3* points, Block x[3]) {
  const double* p = points->data();
  for (int a = 0; a < 3; ++a)
    x[a] = Block{p[a], p[a + 3], p[a + 6], p[a + 9], p[a + 12], p[a + 15], p[a + 18], p[a + 21]};
}

}  // namespace archetide
