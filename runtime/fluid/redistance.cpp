#include "runtime/fluid/redistance.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/fluid/cell_list.h"
#include "runtime/fluid/tricubic.h"

namespace archetide {
namespace {

constexpr double kUnchanged = 1e-9;  // in dx: smaller changes are rounding
constexpr double kConverged = 1e-3;  // in dx: sweeps end when no cell moves more (1e-2: a third of
                                     // the sweeps less, but a breaking dam of 48 cells loses 2.1
                                     // to 2.3 % of its volume in place of 1.7 to 2.0 %)
constexpr double kStartSlack = 0.2;  // in dx: error of the first-order distance across the band
constexpr int kMaxSweeps = 24;
// Interface cells with | |grad phi| - 1 | below these keep phi, where it is smooth and where not: a
// surface that is only carried along is not worn down by being measured over and over.
constexpr double kTrueSlope = 0.02, kGoodSlope = 0.1;
constexpr double kSmooth =
    0.5;  // slopes that differ by more than this part of the steepest one are a kink

constexpr double kJump = 2.0;  // in dx a cell: steeper is no distance

using Mask = Array3<unsigned char>;

bool wet(double phi) { return phi < 0.0; }
bool inside(const Mask& solid, int n) { return solid.size() != 0 && solid[n] != 0; }

// The box of cells as strides, so that the three axes are one loop.
struct Box {
  int size[3];
  int stride[3];
  explicit Box(const Array3<double>& a)
      : size{a.nx(), a.ny(), a.nz()}, stride{1, a.nx(), a.nx() * a.ny()} {}
};

// It goes on into a solid beside which it stands, in the cells of `sheet`; what phi does in solids
// elsewhere, left from when the body was dry, is no surface.
bool at_interface(const Array3<double>& phi, const Mask& solid, const Mask& sheet, Ijk c, int n) {
  const bool open = !inside(solid, n);
  if (crosses_in_the_open(phi, solid, c, n)) return true;
  if (sheet.size() == 0 || !(open || sheet[n])) return false;
  bool crossed = false;
  for_each_neighbour(phi, c, n, [&](int, int, int m) {
    crossed |= wet(phi[m]) != wet(phi[n]) && (sheet[m] != 0 || (!open && !inside(solid, m)));
  });
  if (!open || !crossed) return crossed;
  bool stands_beside = false;
  for_each_around(phi, c, [&](int m) {
    stands_beside = stands_beside || crosses_in_the_open(phi, solid, unravel(phi, m), m);
  });
  return stands_beside;
}

// Slopes of phi to both sides of a cell along one axis (m per cell) and whether the interface lies
// there.
struct Slopes {
  double low = 0.0, high = 0.0;
  bool crosses_low = false, crosses_high = false;

  Slopes(const double* p, int stride, int i, int n) {
    const bool has_low = i > 0, has_high = i < n - 1;
    if (has_low) low = p[0] - p[-stride], crosses_low = wet(p[0]) != wet(p[-stride]);
    if (has_high) high = p[stride] - p[0], crosses_high = wet(p[0]) != wet(p[stride]);
    if (!has_low) low = high;
    if (!has_high) high = low;
  }
  double steepest() const { return std::max(std::abs(low), std::abs(high)); }
  // Central where phi is smooth; at a kink the side where the interface is, or the flatter one.
  double slope(double smooth) const {
    if (std::abs(high - low) <= smooth) return 0.5 * (high + low);
    if (crosses_low != crosses_high) return crosses_low ? low : high;
    const bool low_is_steeper = std::abs(low) > std::abs(high);
    if (crosses_low) return low_is_steeper ? low : high;
    return low * high <= 0.0 ? 0.0 : low_is_steeper ? high : low;
  }
};

// The slope to divide by: 1 while phi is nearly a distance, the measured one when it is not.
// Dividing always feeds grid-scale noise back into the interface: 100 calls moved a sphere of 20
// cells by 0.52 dx, now by 0.
double slope_to_remove(double slope) {
  const double blend = std::clamp((std::abs(slope - 1.0) - kGoodSlope) / kGoodSlope, 0.0, 1.0);
  return 1.0 + blend * (slope - 1.0);
}

// Distance (m) of the centre of cell c to the zero level of the tricubic interpolant: Newton
// towards the surface, and along it towards the foot of the perpendicular [Chopp 2001]. Negative
// when it does not get there. Fourth order, so that doing it often does not wander: dividing phi by
// its slope moved a compressed drop's surface out by 0.1 dx in 200 steps.
double distance_to_foot(const Array3<double>& phi, Ijk c, double dx) {
  constexpr int kMaxIterations = 8;
  constexpr double kDone = 1e-5, kFarthest = 1.5;  // dx
  const Vec3 x(c.i, c.j, c.k);
  Vec3 y = x, slope;
  for (int n = 0; n < kMaxIterations; ++n) {
    const double value = tricubic(phi, y.data(), slope);
    const double slope2 = slope.squaredNorm();
    if (slope2 < 0.04 * dx * dx) return -1.0;
    const Vec3 off = x - y;
    const Vec3 move = off - (value + off.dot(slope)) / slope2 * slope;
    y += move;
    if ((x - y).squaredNorm() > kFarthest * kFarthest) return -1.0;
    if (move.squaredNorm() < kDone * kDone) return (x - y).norm() * dx;
  }
  return -1.0;
}

// Distance of a cell next to the interface, m: to the foot on it where phi is smooth, elsewhere
// |phi| / |grad phi|, at most the nearest crossing on an axis.
double interface_distance(const Array3<double>& phi, const Box& box, double dx, int n) {
  const Ijk c = unravel(phi, n);
  const double* p = phi.data() + n;
  const Slopes axes[3] = {{p, box.stride[0], c.i, box.size[0]},
                          {p, box.stride[1], c.j, box.size[1]},
                          {p, box.stride[2], c.k, box.size[2]}};
  const double value = std::abs(*p);
  const double steepest = std::max({axes[0].steepest(), axes[1].steepest(), axes[2].steepest()});
  double slope2 = 0.0, steepest_crossing = 0.0;
  for (const Slopes& s : axes) {
    const double slope = s.slope(kSmooth * steepest);
    slope2 += slope * slope;
    if (s.crosses_low) steepest_crossing = std::max(steepest_crossing, std::abs(s.low));
    if (s.crosses_high) steepest_crossing = std::max(steepest_crossing, std::abs(s.high));
  }
  if (value == 0.0) return 0.0;
  const bool smooth = std::all_of(axes, axes + 3, [&](const Slopes& s) {
    return std::abs(s.high - s.low) <= kSmooth * steepest;
  });
  const double excess = std::abs(std::sqrt(slope2) / dx - 1.0);
  if (smooth && excess <= kTrueSlope) return value;
  const double foot = smooth ? distance_to_foot(phi, c, dx) : -1.0;
  if (foot >= 0.0)
    return value + std::min((excess - kTrueSlope) / kTrueSlope, 1.0) * (foot - value);
  return value / slope_to_remove(std::max(std::sqrt(slope2), steepest_crossing) / dx);
}

// One axis of the upwind eikonal equation: (c (psi - b))^2 is its share of |grad psi|^2 dx^2, for
// psi > b.
struct UpwindAxis {
  double b, c;
};

// Root of sum_a (c_a (psi - b_a))^2 = dx^2 over the axes with b_a < psi: |grad psi| = 1.
double solve_eikonal(UpwindAxis x, UpwindAxis y, UpwindAxis z, double dx) {
  if (y.b < x.b) std::swap(x, y);
  if (z.b < y.b) std::swap(y, z);
  if (y.b < x.b) std::swap(x, y);
  double psi = x.b + dx / x.c;
  double A = x.c * x.c, B = A * x.b, C = B * x.b - dx * dx;
  for (const UpwindAxis& axis : {y, z}) {
    if (psi <= axis.b) break;
    const double c2 = axis.c * axis.c;
    A += c2, B += c2 * axis.b, C += c2 * axis.b * axis.b;
    const double root = B * B - A * C;
    if (root < 0.0) break;
    psi = (B + std::sqrt(root)) / A;
  }
  return psi;
}

// What one neighbour of a cell says, m: `near` next to it, `next` beyond. Where distances come down
// towards the surface second order, (3 psi - 4 psi_1 + psi_2) / 2 = 3/2 (psi - (4 psi_1 -
// psi_2)/3); less of it the flatter they are, exact for planes all the way: no choice hangs on a
// last digit.
UpwindAxis upwind_side(double near, double next, double dx) {
  constexpr double kSteep = 0.05;  // slope from which on it is all second order
  const double fall = near - next;
  const double c = 1.0 + 0.5 * std::clamp(fall / (kSteep * dx), 0.0, 1.0);
  return {near + (1.0 - 1.0 / c) * fall, c};
}

// The axis of cell i of n along `stride`; p points to the cell, sign makes its side positive. Of
// two neighbours the one that implies the smaller distance.
UpwindAxis upwind_axis(const double* p, int stride, int i, int n, double sign, double dx,
                       double band, bool second_order) {
  UpwindAxis nearest{band, 1.0};
  for (const int side : {-1, 1}) {
    if (i + side < 0 || i + side >= n) continue;
    // Beyond a change of sign that is no surface nothing is known; there distances jump.
    const double near = sign * p[side * stride];
    if (near < 0.0 || near >= band) continue;
    UpwindAxis axis{near, 1.0};
    if (second_order && i + 2 * side >= 0 && i + 2 * side < n) {
      const double next = sign * p[2 * side * stride];
      if (next >= 0.0 || near - next <= kJump * dx) axis = upwind_side(near, next, dx);
    }
    if (axis.b + dx / axis.c < nearest.b + dx / nearest.c) nearest = axis;
  }
  return nearest;
}

// Distance (m, on the side of n) that the neighbours of n imply, at most `band`.
double upwind_distance(const Array3<double>& phi, const Box& box, double dx, double band, int n,
                       bool second_order) {
  const Ijk c = unravel(phi, n);
  const double* p = phi.data() + n;
  const double sign = wet(*p) ? -1.0 : 1.0;
  const UpwindAxis x =
      upwind_axis(p, box.stride[0], c.i, box.size[0], sign, dx, band, second_order);
  const UpwindAxis y =
      upwind_axis(p, box.stride[1], c.j, box.size[1], sign, dx, band, second_order);
  const UpwindAxis z =
      upwind_axis(p, box.stride[2], c.k, box.size[2], sign, dx, band, second_order);
  return std::min(solve_eikonal(x, y, z, dx), band);
}

// Start of the cells that the front has just reached: their old distance, kept near to what the
// neighbours known so far imply (first order).
void start_layer(Array3<double>& phi, const Array3<double>& old, const std::vector<int>& cells,
                 std::vector<double>& values, const Box& box, double dx, double band) {
  const int count = static_cast<int>(cells.size());
  values.resize(count);
#pragma omp parallel for if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) {
    const int n = cells[t];
    const double guess = upwind_distance(phi, box, dx, band, n, false);
    const double low = std::max(guess - dx, 0.0), high = std::min(guess + kStartSlack * dx, band);
    values[t] = std::copysign(std::clamp(std::abs(old[n]), low, high), phi[n]);
  }
#pragma omp parallel for if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) phi[cells[t]] = values[t];
}

// One Jacobi update of a layer, second order; returns the largest change, m.
double relax(Array3<double>& phi, const std::vector<int>& cells, std::vector<double>& values,
             const Box& box, double dx, double band) {
  const int count = static_cast<int>(cells.size());
  values.resize(count);
  double change = 0.0;
#pragma omp parallel for reduction(max : change) if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) {
    const double old = phi[cells[t]];
    values[t] = std::copysign(upwind_distance(phi, box, dx, band, cells[t], true), old);
    change = std::max(change, std::abs(values[t] - old));
  }
#pragma omp parallel for if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) phi[cells[t]] = values[t];
  return change;
}

// Updates outwards, layer after layer, over and over until nothing moves; a layer rests while the
// two on either side of it, which its stencil reaches, rest.
void relax_band(Array3<double>& phi, const std::vector<std::vector<int>>& layers, const Box& box,
                double dx, double band) {
  const int count = static_cast<int>(layers.size());
  std::vector<double> change(count, band), values;
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep)
    for (int l = 0; l < count; ++l) {
      const auto first = change.begin() + std::max(l - 2, 0),
                 last = change.begin() + std::min(l + 3, count);
      if (*std::max_element(first, last) > kConverged * dx)
        change[l] = relax(phi, layers[l], values, box, dx, band);
    }
}

// Cells next to the interface, their distance in `out`.
std::vector<int> fix_interface(const Array3<double>& phi, const Mask& solid, const Mask& sheet,
                               const Box& box, double dx, double band, Array3<double>& out) {
  const std::vector<int> cells = collect_cells_at_changes(
      phi, [&](std::size_t n) { return wet(phi[n]); },
      [&](int i, int j, int k, int n) {
        return at_interface(phi, solid, sheet, {i, j, k}, n);
      });
#pragma omp parallel for
  for (std::size_t t = 0; t < cells.size(); ++t) {
    const int n = cells[t];
    out[n] = std::copysign(std::min(interface_distance(phi, box, dx, n), band), phi[n]);
  }
  return cells;
}

}  // namespace

void redistance(const Grid& g, Array3<double>& phi, double band, const Mask& solid,
                const Mask& sheet) {
  const Box box(phi);
  Array3<double> out(phi.nx(), phi.ny(), phi.nz());
#pragma omp parallel for
  for (std::size_t n = 0; n < phi.size(); ++n) out[n] = wet(phi[n]) ? -band : band;

  std::vector<int> layer = fix_interface(phi, solid, sheet, box, g.dx, band, out);
  Mask reached(phi.nx(), phi.ny(), phi.nz(), 0);
  for (int n : layer) reached[n] = 1;

  // Outwards layer by layer as far as the band goes.
  std::vector<std::vector<int>> layers;
  std::vector<double> values;
  const auto inside_band = [&](int n) { return std::abs(out[n]) < band; };
  while (!(layer = claim_neighbours(reached, layer, 1, inside_band)).empty()) {
    start_layer(out, phi, layer, values, box, g.dx, band);
    layers.push_back(layer);
  }
  relax_band(out, layers, box, g.dx, band);

  // Take what changed by more than rounding.
#pragma omp parallel for
  for (std::size_t n = 0; n < phi.size(); ++n)
    phi[n] = unless_rounding(phi[n], out[n], kUnchanged * g.dx);
}

}  // namespace archetide
