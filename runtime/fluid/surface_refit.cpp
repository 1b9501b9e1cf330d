#include "runtime/fluid/surface_refit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/fluid/cell_list.h"
#include "runtime/fluid/level_set.h"
#include "runtime/fluid/sampling.h"

namespace archetide {
namespace {

constexpr double kOpen = 0.02;       // a cell less open than this holds no residual
constexpr double kNothing = 1e-12;   // residual, dx^3
constexpr double kReach = 4.9;       // from the surface that residual is distributed, dx
constexpr double kDeep = 1e-3;       // residual deep in water that is carried, dx^3
constexpr double kStep = 0.1;        // dx, of the difference that the surface's area stems from
constexpr double kLeastArea = 0.02;  // of surface in reach, dx^2, that residual is given to
constexpr double kMostShift = 0.5;   // of a pass, dx
constexpr double kWideFrom = 1e-3;   // dx^3, that is worth looking for surface farther away
constexpr int kPasses = 4, kNear = 1, kWide = 6;  // times the kernel is applied
constexpr double kMuch = 0.01;                    // dx^3, that is worth another round ..
constexpr int kRounds = 3, kPassesOfRound = 2;    // .. of near passes and a wide one ..
constexpr double kWorthARound = 0.7;  // .. if the last round left no more of it than this

}  // namespace

double held_by_surface(const Grid& g, const Array3<double>& phi, const Array3<double>& solid, int i,
                       int j, int k, std::size_t n) {
  const double wet = phi[n] >= g.dx ? 0.0 : wet_fraction(g, phi, i, j, k, n);
  return wet > 0.0 ? wet * open_fraction(solid[n]) : 0.0;
}

// Eq. V4.
void measure_held(const Grid& g, const Array3<double>& phi, const Array3<double>& solid,
                  Array3<double>& held, Array3<double>& residual) {
#pragma omp parallel for schedule(dynamic)
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j) {
      std::size_t n = phi.index(0, j, k);
      for (int i = 0; i < g.nx; ++i, ++n) {
        const double now = held_by_surface(g, phi, solid, i, j, k, n);
        if (now == held[n]) continue;
        residual[n] += held[n] - now;
        held[n] = now;
      }
    }
}

namespace {

// Where the residual of a cell goes: up to eight cells and what each gets.
struct Delivery {
  std::array<int, 8> cell;
  std::array<double, 8> volume;
  int count = 0;
};

// Gives what solid cells hold to open ones around; what has none stays.
void leave_solids(const Array3<double>& solid, Array3<double>& residual) {
  const std::vector<int> inside = collect_cells(residual, [&](int, int, int, int n) {
    return residual[n] != 0.0 && open_fraction(solid[n]) < kOpen;
  });
  for (const int n : inside) {
    double sum = 0.0;
    for_each_around(solid, unravel(solid, n), [&](int m) {
      const double o = open_fraction(solid[m]);
      if (o >= kOpen) sum += o;
    });
    if (sum == 0.0) continue;
    const double volume = residual[n];
    for_each_around(solid, unravel(solid, n), [&](int m) {
      const double o = open_fraction(solid[m]);
      if (o >= kOpen) residual[m] += volume * o / sum;
    });
    residual[n] = 0.0;
  }
}

}  // namespace

void carry_residual(const Grid& g, const MacField& u, double dt, const Array3<double>& phi,
                    const Array3<double>& solid, Array3<double>& residual) {
  leave_solids(solid, residual);
  const double deep = -kReach * g.dx, h = dt / g.dx;
  const std::vector<int> cells = collect_cells(residual, [&](int, int, int, int n) {
    const double r = std::abs(residual[n]);
    return r > kNothing && (phi[n] > deep || r > kDeep);
  });
  const int count = static_cast<int>(cells.size());
  std::vector<Delivery> to(count);
  const MacSampler sampler(g, u);
  LatticeEnds centres;
  for (int a = 0; a < 3; ++a) centres.set(a, g.size(a));
#pragma omp parallel for schedule(static) if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) {
    const Ijk c = unravel(residual, cells[t]);
    Axes x = {c.i + 0.5, c.j + 0.5, c.k + 0.5, 0.0}, v, end;
    sampler.at(x, v);
    const double way = h * std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])});
    if (way == 0.0) continue;
    const int pieces = std::clamp(static_cast<int>(std::ceil(way)), 1, 16);
    for (int p = 0; p < pieces; ++p) {
      if (p > 0) sampler.at(x, v);
      sampler.trace(x, v, h / pieces, end);
      x = end;
    }
    Slot s[3];
    centres.clamp(x - 0.5, s);
    Delivery& d = to[t];
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1.0;
      int at[3];
      for (int a = 0; a < 3; ++a) {
        const int up = (corner >> a) & 1;
        at[a] = std::min(s[a].i + up, g.size(a) - 1);
        weight *= up ? s[a].f : 1.0 - s[a].f;
      }
      const auto m = static_cast<int>(residual.index(at[0], at[1], at[2]));
      if (weight == 0.0 || open_fraction(solid[m]) < kOpen) continue;
      d.cell[d.count] = m, d.volume[d.count++] = weight, sum += weight;
    }
    for (int m = 0; m < d.count; ++m) d.volume[m] *= residual[cells[t]] / sum;
  }
  for (int t = 0; t < count; ++t)
    if (to[t].count > 0) residual[cells[t]] = 0.0;
  for (const Delivery& d : to)
    for (int m = 0; m < d.count; ++m) residual[d.cell[m]] += d.volume[m];
}

void bring_to_surface(const Grid& g, const Array3<double>& phi, const Vec3& gravity,
                      const Array3<double>& solid, Array3<double>& residual) {
  constexpr double kInAir = 3.0, kUnder = 1.5;  // from the surface, dx
  int axis = 0;
  if (gravity.cwiseAbs().maxCoeff(&axis) == 0.0) return;
  const std::ptrdiff_t strides[3] = {1, g.nx, static_cast<std::ptrdiff_t>(g.nx) * g.ny};
  for (const bool falls : {true, false}) {
    const bool up = (gravity[axis] > 0.0) == falls;
    std::vector<int> cells = collect_cells(residual, [&](int i, int j, int k, int n) {
      const bool there = falls ? residual[n] != 0.0 && phi[n] >= kInAir * g.dx
                               : std::abs(residual[n]) > kNothing && phi[n] <= -kUnder * g.dx;
      if (!there) return false;
      Vec3i to(i, j, k);
      to[axis] += up ? 1 : -1;
      return residual.contains(to[0], to[1], to[2]) &&
             open_fraction(solid(to[0], to[1], to[2])) >= 0.5;
    });
    if (up) std::reverse(cells.begin(), cells.end());  // what moves is out of the way of the next
    for (const int n : cells) {
      residual[n + (up ? strides[axis] : -strides[axis])] += residual[n];
      residual[n] = 0.0;
    }
  }
}

// The cells around the surface and through which of their faces they touch.
void SurfaceRefit::collect(const Grid& g, const FaceField<double>& open, const Array3<double>& phi,
                           const Array3<double>& solid) {
  if (number_.nx() != g.nx || number_.ny() != g.ny || number_.nz() != g.nz)
    number_.resize(g.nx, g.ny, g.nz, -1);
  else
    for (const int n : cells_) number_[n] = -1;
  cells_ = collect_cells(phi, [&](int, int, int, int n) {
    return std::abs(phi[n]) < kReach * g.dx && open_fraction(solid[n]) >= kOpen;
  });
  const int count = static_cast<int>(cells_.size());
#pragma omp parallel for if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) number_[cells_[t]] = t;
  for (auto& side : beside_) side.resize(count);
#pragma omp parallel for if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) {
    const int n = cells_[t];
    for (auto& side : beside_) side[t] = t;
    const Ijk c = unravel(phi, n);
    for_each_neighbour(phi, c, n, [&](int axis, int side, int m) {
      const bool up = side > 0;
      const double w =
          open[axis](c.i + (axis == 0 && up), c.j + (axis == 1 && up), c.k + (axis == 2 && up));
      if (w > 0.0 && number_[m] >= 0) beside_[2 * axis + up][t] = number_[m];
    });
  }
}

// f: every cell gives an eighth to both sides, axis after axis, or in the reversed order.
void SurfaceRefit::smooth(std::vector<double>& f, int passes, bool reversed) {
  const int count = static_cast<int>(f.size());
  spare_.resize(count);
  for (int p = 0; p < passes; ++p)
    for (int a = 0; a < 3; ++a) {
      const int axis = reversed ? 2 - a : a;
      const int *low = beside_[2 * axis].data(), *high = beside_[2 * axis + 1].data();
      const double* from = f.data();
      double* to = spare_.data();
#pragma omp parallel for schedule(static) if (count > kParallelFrom)
      for (int t = 0; t < count; ++t)
        to[t] = 0.75 * from[t] + 0.125 * (from[low[t]] + from[high[t]]);
      f.swap(spare_);
    }
}

// A symmetric kernel: M M^T.
void SurfaceRefit::smooth_both(std::vector<double>& f, int passes) {
  smooth(f, passes, true);
  smooth(f, passes, false);
}

double SurfaceRefit::pass(const Grid& g, const Array3<double>& solid, int passes,
                          Array3<double>& phi, Array3<double>& held, Array3<double>& residual) {
  const int count = static_cast<int>(cells_.size());
  share_.resize(count);
  std::vector<double> own(count);  // d held / d phi, per dx
  const double step = kStep * g.dx;
#pragma omp parallel for schedule(static) if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) {
    const int n = cells_[t];
    own[t] = 0.0;
    if (std::abs(phi[n]) >= g.dx + step) continue;
    const Ijk c = unravel(phi, n);
    own[t] = open_fraction(solid[n]) *
             (wet_fraction(g, phi, c.i, c.j, c.k, n, -step) -
              wet_fraction(g, phi, c.i, c.j, c.k, n, step)) /
             (2.0 * kStep);
  }
  area_ = own;
  smooth_both(area_, passes);
#pragma omp parallel for schedule(static) if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) {
    const double r = residual[cells_[t]];
    share_[t] = std::abs(r) > kNothing && area_[t] > kLeastArea ? r / area_[t] : 0.0;
    if (share_[t] != 0.0) residual[cells_[t]] = 0.0;
  }
  smooth_both(share_, passes);
#pragma omp parallel for schedule(static) if (count > kParallelFrom)
  for (int t = 0; t < count; ++t)
    phi[cells_[t]] -= g.dx * std::clamp(share_[t], -kMostShift, kMostShift);
  double moved = 0.0;
#pragma omp parallel for schedule(static) if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) {
    const int n = cells_[t];
    residual[n] += own[t] * share_[t];
    const Ijk c = unravel(phi, n);
    const double now = open_fraction(solid[n]) * wet_fraction(g, phi, c.i, c.j, c.k, n);
    spare_[t] = now - held[n];
    residual[n] -= spare_[t];
    held[n] = now;
  }
  for (const double change : spare_) moved += std::abs(change);
  return moved;
}

double SurfaceRefit::refit(const Grid& g, const Array3<double>& solid,
                           const FaceField<double>& open, Array3<double>& phi, Array3<double>& held,
                           Array3<double>& residual) {
  double moved = 0.0;
  collect(g, open, phi, solid);
  const auto any = [&](double least) {
    return std::any_of(cells_.begin(), cells_.end(),
                       [&](int n) { return std::abs(residual[n]) > least; });
  };
  const auto near = [&](int passes) {
    for (int p = 0; p < passes && any(kNothing); ++p)
      moved += pass(g, solid, kNear, phi, held, residual);
  };
  const auto much = [&] {  // of residual, dx^3
    double sum = 0.0;
    for (const int n : cells_)
      if (std::abs(residual[n]) > kMuch) sum += std::abs(residual[n]);
    return sum;
  };
  near(kPasses);
  if (any(kWideFrom)) moved += pass(g, solid, kWide, phi, held, residual);
  // A pocket of air that vanishes within a step leaves more than a shift of half a cell. What
  // fragments hold that have no surface to shift stays.
  double before = INFINITY;
  for (int r = 0; r < kRounds; ++r) {
    const double left = much();
    if (left == 0.0 || left > kWorthARound * before) break;
    near(kPassesOfRound);
    moved += pass(g, solid, kWide, phi, held, residual);
    before = left;
  }
  measure_held(g, phi, solid, held, residual);  // slopes beside the cells that moved are others
  return moved * g.dx * g.dx * g.dx;
}

}  // namespace archetide
