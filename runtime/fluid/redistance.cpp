#include "runtime/fluid/redistance.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "runtime/fluid/cell_list.h"
#include "runtime/fluid/path_block.h"
#include "runtime/fluid/tricubic.h"

namespace archetide {
namespace {

constexpr double kUnchanged = 1e-9;  // in dx: smaller changes are rounding
constexpr double kConverged = 1e-2;  // in dx: sweeps end when no cell moves more
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
// towards the surface, and along it towards the foot of the perpendicular [Cho01]. Negative
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
double interface_distance(const Array3<double>& phi, const Box& box, double dx, Ijk c, int n) {
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

// Distances on their way outwards: on a lattice with a rim two points wide around that of phi,
// which is not a number, so that nothing outside of the tank is nearer than anything. Cells that
// are not reached hold their old distance, raised by `band`: beyond it all are alike.
struct Front {
  static constexpr int kRim = 2;
  // closed: reached, but not inside `band`. Once all are, a cell rests or is due to be updated.
  enum : unsigned char { kUnreached, kReached, kClosed, kResting, kDue };

  double dx, band;
  std::ptrdiff_t stride[3];
  Array3<double> distance;  // signed, m
  Mask marks;

  Front(const Array3<double>& phi, double dx_, double band_)
      : dx(dx_),
        band(band_),
        stride{1, phi.nx() + 2 * kRim, (phi.nx() + 2 * kRim) * (phi.ny() + 2 * kRim)},
        distance(phi.nx() + 2 * kRim, phi.ny() + 2 * kRim, phi.nz() + 2 * kRim, Unfilled{}),
        marks(distance.nx(), distance.ny(), distance.nz(), Unfilled{}) {
    const int nx = phi.nx(), wide = distance.nx();
#pragma omp parallel for collapse(2)
    for (int k = 0; k < distance.nz(); ++k)
      for (int j = 0; j < distance.ny(); ++j) {
        double* to = &distance(0, j, k);
        unsigned char* mark = &marks(0, j, k);
        const bool in_tank = j >= kRim && j < phi.ny() + kRim && k >= kRim && k < phi.nz() + kRim;
        std::fill_n(mark, wide, kClosed);
        std::fill_n(to, in_tank ? kRim : wide, std::numeric_limits<double>::quiet_NaN());
        if (!in_tank) continue;
        std::fill_n(to + wide - kRim, kRim, std::numeric_limits<double>::quiet_NaN());
        std::fill_n(mark + kRim, nx, kUnreached);
        const double *from = &phi(0, j - kRim, k - kRim), far = band;
        double* inner = to + kRim;
#pragma omp simd
        for (int i = 0; i < nx; ++i) inner[i] = from[i] + (from[i] < 0.0 ? -far : far);
      }
  }
  std::size_t index(int i, int j, int k) const {
    return distance.index(i + kRim, j + kRim, k + kRim);
  }
  void reach(int n, double value) {
    distance[n] = value, marks[n] = std::abs(value) < band ? kReached : kClosed;
  }
};

// One axis of the upwind eikonal equation for eight cells: (c (psi - b))^2 is its share of
// |grad psi|^2 dx^2, for psi > b.
struct UpwindAxis {
  Block b, c;

  template <class Flags>
  void take(const Flags& where, const UpwindAxis& other) {
    b = where ? other.b : b, c = where ? other.c : c;
  }
};

void swap_where_less(UpwindAxis& x, UpwindAxis& y) {
  const UpwindAxis first = x;
  const auto less = y.b < x.b;
  x.take(less, y), y.take(less, first);
}

// Root of sum_a (c_a (psi - b_a))^2 = dx^2 over the axes with b_a < psi: |grad psi| = 1.
[[gnu::always_inline]] inline void solve_eikonal(UpwindAxis& x, UpwindAxis& y, UpwindAxis& z,
                                                 double dx, Block& psi) {
  swap_where_less(x, y), swap_where_less(y, z), swap_where_less(x, y);
  psi = x.b + dx / x.c;
  Block A = x.c * x.c, B = A * x.b, C = B * x.b - dx * dx;
  auto more = psi == psi;
  for (const UpwindAxis* axis : {&y, &z}) {
    const Block c2 = axis->c * axis->c;
    A += c2, B += c2 * axis->b, C += c2 * axis->b * axis->b;
    const Block root2 = B * B - A * C;
    more &= (psi > axis->b) & (root2 >= 0.0);
    Block root;
    for (int l = 0; l < kBlock; ++l) root[l] = std::sqrt(root2[l]);
    psi = more ? (B + root) / A : psi;
  }
}

// What the neighbours to one side say, m: `near` next to the cells, `next` beyond. Where distances
// come down towards the surface second order, (3 psi - 4 psi_1 + psi_2) / 2 = 3/2 (psi - (4 psi_1 -
// psi_2)/3); less of it the flatter they are, exact for planes all the way: no choice depends on a
// last digit.
template <bool kSecondOrder>
void upwind_side(const Block& near, const Block& next, const Front& f, UpwindAxis& out,
                 Block& alone) {
  constexpr double kSteep = 0.05;  // slope from which on it is all second order
  const Block zero = {}, one = zero + 1.0;
  // Beyond a change of sign that is no surface nothing is known; there distances jump.
  const auto known = (near >= 0.0) & (near < f.band);
  out.b = known ? near : zero + f.band, out.c = one, alone = out.b + f.dx;
  if constexpr (kSecondOrder) {
    const Block drop = near - next;
    const auto smooth = known & ((next >= 0.0) | (drop <= kJump * f.dx));
    const Block fall = smooth ? drop : zero;
    Block steep = fall * (1.0 / (kSteep * f.dx));
    steep = steep > 0.0 ? steep : zero;
    steep = steep < 1.0 ? steep : one;
    out.c = 1.0 + 0.5 * steep;
    const Block part = 1.0 / out.c;
    out.b += (1.0 - part) * fall, alone = out.b + part * f.dx;
  }
}

// Eight cells of a list.
struct Cells {
  const double* at[kBlock];

  // From the t-th on; at the end of the list the last one again.
  Cells(const Front& f, const std::vector<int>& list, std::size_t t) {
    for (int l = 0; l < kBlock; ++l)
      at[l] = f.distance.data() + list[std::min(t + l, list.size() - 1)];
  }
  void gather(std::ptrdiff_t step, Block& out) const {
    out = Block{at[0][step], at[1][step], at[2][step], at[3][step],
                at[4][step], at[5][step], at[6][step], at[7][step]};
  }
};

// One axis; sign makes the cells' side positive. Of two neighbours the one that implies the smaller
// distance.
template <bool kSecondOrder>
void upwind_axis(const Front& f, const Cells& cells, std::ptrdiff_t stride, const Block& sign,
                 UpwindAxis& nearest) {
  Block near, next = {}, alone, other;
  UpwindAxis high;
  cells.gather(-stride, near);
  if constexpr (kSecondOrder) cells.gather(-2 * stride, next);
  upwind_side<kSecondOrder>(sign * near, sign * next, f, nearest, alone);
  cells.gather(stride, near);
  if constexpr (kSecondOrder) cells.gather(2 * stride, next);
  upwind_side<kSecondOrder>(sign * near, sign * next, f, high, other);
  nearest.take(other < alone, high);
}

// Distances (m, signed) that the neighbours imply, at most `band`; `old` are those that the cells
// have.
template <bool kSecondOrder>
void upwind_distance(const Front& f, const Cells& cells, Block& old, Block& value) {
  const Block zero = {}, band = zero + f.band;
  cells.gather(0, old);
  const Block sign = old < 0.0 ? zero - 1.0 : zero + 1.0;
  UpwindAxis axes[3];
  for (int a = 0; a < 3; ++a) upwind_axis<kSecondOrder>(f, cells, f.stride[a], sign, axes[a]);
  solve_eikonal(axes[0], axes[1], axes[2], f.dx, value);
  value = sign * (value < band ? value : band);
}

// The cell next to m from which the front comes: of several the first.
int comes_from(const Front& f, int m) {
  for (const std::ptrdiff_t stride : f.stride)
    for (const std::ptrdiff_t step : {-stride, stride})
      if (f.marks[m + step] == Front::kReached) return static_cast<int>(m + step);
  return -1;
}

// The cells next to those of `layer` inside the band that are not reached yet, each once.
std::vector<int> next_layer(const Front& f, const std::vector<int>& layer) {
  return collect_from(layer, [&](int n, std::vector<int>& out) {
    if (f.marks[n] != Front::kReached) return;
    for (const std::ptrdiff_t stride : f.stride)
      for (const std::ptrdiff_t step : {-stride, stride}) {
        const int m = static_cast<int>(n + step);
        if (f.marks[m] == Front::kUnreached && comes_from(f, m) == n) out.push_back(m);
      }
  });
}

// Start of the cells that the front has just reached: their old distance, kept near to what the
// neighbours known so far imply (first order).
void start_layer(Front& f, const std::vector<int>& layer, std::vector<double>& values) {
  const int count = static_cast<int>(layer.size());
  values.resize(count + kBlock);
  const Block zero = {};
#pragma omp parallel for if (count > kParallelFrom)
  for (int t = 0; t < count; t += kBlock) {
    const Cells cells(f, layer, t);
    Block old, guess;
    upwind_distance<false>(f, cells, old, guess);
    const Block sign = guess < 0.0 ? zero - 1.0 : zero + 1.0, distance = sign * guess;
    Block low = distance - f.dx, high = distance + kStartSlack * f.dx, start = sign * old - f.band;
    low = low > 0.0 ? low : zero, high = high < f.band ? high : zero + f.band;
    start = start > low ? start : low;
    start = sign * (start < high ? start : high);
    store(start, values.data() + t);
  }
#pragma omp parallel for if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) f.reach(layer[t], values[t]);
}

// Those of a layer that something in their stencil has moved for; they are not due any more.
std::vector<int> take_due(Front& f, const std::vector<int>& layer) {
  return collect_from(layer, [&](int n, std::vector<int>& out) {
    if (f.marks[n] != Front::kDue) return;
    f.marks[n] = Front::kResting;
    out.push_back(n);
  });
}

// One Jacobi update of the cells, second order; whose stencil a cell belongs to that has moved is
// due. Returns the largest change, m.
double relax(Front& f, const std::vector<int>& layer, std::vector<double>& values) {
  const int count = static_cast<int>(layer.size());
  values.resize(count + kBlock);
  double change = 0.0;
#pragma omp parallel reduction(max : change) if (count > kParallelFrom)
  {
    Block most = {};
#pragma omp for
    for (int t = 0; t < count; t += kBlock) {
      Block old, value;
      upwind_distance<true>(f, Cells(f, layer, t), old, value);
      store(value, values.data() + t);
      Block by;
      magnitude(value - old, by);
      most = by > most ? by : most;
    }
    for (int l = 0; l < kBlock; ++l) change = std::max(change, most[l]);
  }
#pragma omp parallel for if (count > kParallelFrom)
  for (int t = 0; t < count; ++t) {
    double& distance = f.distance[layer[t]];
    const bool moved = std::abs(values[t] - distance) > kConverged * f.dx;
    distance = values[t];
    if (!moved) continue;
    for (const std::ptrdiff_t stride : f.stride)
      for (const std::ptrdiff_t step : {-2 * stride, -stride, stride, 2 * stride})
        std::atomic_ref(f.marks[layer[t] + step]).store(Front::kDue, std::memory_order_relaxed);
  }
  return change;
}

// Updates outwards, layer after layer, over and over until nothing moves. After the first time only
// cells whose stencil has moved, and only layers whose stencil reaches one that has.
void relax_band(Front& f, const std::vector<std::vector<int>>& layers) {
  const int count = static_cast<int>(layers.size());
  std::vector<double> change(count, f.band), values;
  for (const std::vector<int>& layer : layers)
    for (const int n : layer) f.marks[n] = Front::kDue;
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep)
    for (int l = 0; l < count; ++l) {
      const auto first = change.begin() + std::max(l - 2, 0),
                 last = change.begin() + std::min(l + 3, count);
      if (*std::max_element(first, last) <= kConverged * f.dx) continue;
      change[l] = relax(f, take_due(f, layers[l]), values);
    }
}

// Reaches the cells next to the interface.
std::vector<int> fix_interface(const Array3<double>& phi, const Mask& solid, const Mask& sheet,
                               Front& f) {
  const Box box(phi);
  std::vector<int> cells = collect_cells_at_changes(
      phi, [&](std::size_t n) { return wet(phi[n]); },
      [&](int i, int j, int k, int n) {
        return at_interface(phi, solid, sheet, {i, j, k}, n);
      });
#pragma omp parallel for
  for (std::size_t t = 0; t < cells.size(); ++t) {
    const int n = cells[t];
    const Ijk c = unravel(phi, n);
    const double distance = std::min(interface_distance(phi, box, f.dx, c, n), f.band);
    cells[t] = static_cast<int>(f.index(c.i, c.j, c.k));
    f.reach(cells[t], std::copysign(distance, phi[n]));
  }
  return cells;
}

// The same for water that stands at an open side: it ends there, or before.
void fix_at_side(const Grid& g, const Array3<double>& phi, const Mask& solid, int side, Front& f,
                 std::vector<int>& cells) {
  for_cells_at_side(g, side, [&](Ijk c) {
    const auto n = static_cast<int>(phi.index(c.i, c.j, c.k));
    if (!wet(phi[n]) || inside(solid, n)) return;
    const auto m = static_cast<int>(f.index(c.i, c.j, c.k));
    const bool reached = f.marks[m] != Front::kUnreached;
    f.reach(m, std::max(reached ? f.distance[m] : phi[n], -0.5 * g.dx));
    if (!reached) cells.push_back(m);
  });
}

}  // namespace

void redistance(const Grid& g, Array3<double>& phi, double band, const Mask& solid,
                const Mask& sheet, const Sides& air_beyond) {
  Front front(phi, g.dx, band);
  std::vector<int> layer = fix_interface(phi, solid, sheet, front);
  for (int side = 0; side < 6; ++side)
    if (air_beyond[side]) fix_at_side(g, phi, solid, side, front, layer);

  // Outwards layer by layer as far as the band goes.
  std::vector<std::vector<int>> layers;
  std::vector<double> values;
  while (!(layer = next_layer(front, layer)).empty()) {
    start_layer(front, layer, values);
    layers.push_back(layer);
  }
  relax_band(front, layers);

  // Take what changed by more than rounding.
#pragma omp parallel for collapse(2)
  for (int k = 0; k < phi.nz(); ++k)
    for (int j = 0; j < phi.ny(); ++j) {
      double* p = phi.data() + phi.index(0, j, k);
      const double* distance = front.distance.data() + front.index(0, j, k);
      for (int i = 0; i < phi.nx(); ++i)
        p[i] = unless_rounding(p[i], std::clamp(distance[i], -band, band), kUnchanged * g.dx);
    }
}

}  // namespace archetide
