#include "runtime/fluid/extrapolation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "common/base/exception_carrier.h"
#include "runtime/fluid/cell_list.h"

namespace archetide {
namespace {

using Mask = Array3<unsigned char>;
constexpr unsigned char kWaiting = 255;  // beside known points, value not known yet
constexpr int kMaxLayers = 253;
constexpr int kLinearLayers =
    2;  // of velocities: what moves a surface between two faces is second order
constexpr double kUnchanged = 1e-9;  // in dx: smaller changes of phi are rounding

// Whether point n is known before this layer is.
bool known(const Mask& valid, int n, int layer) { return valid[n] != 0 && valid[n] <= layer; }

// Invalid points with a valid neighbour.
std::vector<int> first_frontier(const Mask& valid) {
  const int nx = valid.nx(), ny = valid.ny(), nz = valid.nz();
  const std::size_t layer = static_cast<std::size_t>(nx) * ny;
  std::vector<std::vector<int>> parts(nz);
  ExceptionCarrier carrier;
#pragma omp parallel
  {
    std::vector<unsigned char> touches;
    carrier.run([&] { touches.resize(nx); });
#pragma omp for schedule(dynamic)
    for (int k = 0; k < nz; ++k)
      carrier.run([&] {
        for (int j = 0; j < ny; ++j) {
          const unsigned char* row = &valid(0, j, k);
          if (!std::memchr(row, 0, nx)) continue;
          const unsigned char *south = j > 0 ? row - nx : row, *north = j + 1 < ny ? row + nx : row,
                              *down = k > 0 ? row - layer : row,
                              *up = k + 1 < nz ? row + layer : row;
          unsigned char* found = touches.data();
#pragma omp simd
          for (int i = 0; i < nx; ++i) found[i] = south[i] | north[i] | down[i] | up[i];
#pragma omp simd
          for (int i = 1; i < nx; ++i) found[i] |= row[i - 1];
#pragma omp simd
          for (int i = 1; i < nx; ++i) found[i - 1] |= row[i];
          unsigned char any = 0;
#pragma omp simd reduction(| : any)
          for (int i = 0; i < nx; ++i) {
            found[i] = (row[i] == 0) & (found[i] != 0);
            any |= found[i];
          }
          if (!any) continue;
          const auto first = static_cast<int>(valid.index(0, j, k));
          for (int i = 0; i < nx; ++i)
            if (found[i]) parts[k].push_back(first + i);
        }
      });
  }
  carrier.rethrow();
  return concatenate(parts);
}

// The points of the layers around the valid ones, the n-th (from 1) marked n + 1.
std::vector<std::vector<int>> grow_layers(Mask& valid, int count) {
  count = std::min(count, kMaxLayers);
  std::vector<std::vector<int>> layers;
  std::vector<int> front;
  if (count > 0) front = first_frontier(valid);
  while (!front.empty()) {
    const auto mark = static_cast<unsigned char>(layers.size() + 2);
    const int points = static_cast<int>(front.size());
#pragma omp parallel for if (points > kParallelFrom)
    for (int t = 0; t < points; ++t) valid[front[t]] = mark;
    layers.push_back(std::move(front));
    front.clear();
    if (static_cast<int>(layers.size()) < count) front = next_front(valid, layers.back(), mark);
  }
  return layers;
}

// Layer by layer, set(n, layer) of every point; reads points before this layer only.
template <class Set>
void for_each_layer(const std::vector<std::vector<int>>& layers, const Set& set) {
  for (std::size_t l = 0; l < layers.size(); ++l) {
    const std::vector<int>& points = layers[l];
    const int count = static_cast<int>(points.size()), layer = static_cast<int>(l) + 1;
#pragma omp parallel for if (count > kParallelFrom)
    for (int t = 0; t < count; ++t) set(points[t], layer);
  }
}

// How far two successive slopes are alike: 1 from a ratio of 3/4 on, 0 below 1/2, where the flow is
// not resolved.
double likeness(double a, double b) {
  if (a * b <= 0.0) return 0.0;
  const double ratio = std::abs(a) < std::abs(b) ? a / b : b / a;
  return std::clamp(4.0 * ratio - 2.0, 0.0, 1.0);
}

// The smaller of the last two slopes as far as all three, from the last on, are alike. Believing
// slopes more easily made splashes throw up spikes: a ring dropped into a tub of 48^3 took 448
// steps for 2.5 s with two slopes of one sign, 407 with two that are alike, 316 so, 317 with
// constants.
double trusted_slope(double a, double b, double c) {
  return likeness(a, b) * likeness(b, c) * (std::abs(a) < std::abs(b) ? a : b);
}

// Flow along a body under water bends within a cell or two of it: no three slopes are alike, and
// constants were what took the most energy beside bodies that move [D91].
double slope_under_water(double a, double b) {
  if (a * b <= 0.0) return 0.0;
  return std::abs(a) < 2.0 * std::abs(b) ? a : 2.0 * b;
}

// The same of water that leaves a wall at `speed` along the way: only walls that move push it, and
// none to more than theirs. A jet out of a wall at rest fed itself: the next step took its water
// from the faster jet inside the wall, half as fast again each time [D95].
double slope_out_of_wall(double a, double b, double speed, double wall_speed) {
  const double slope = slope_under_water(a, b);
  if (slope * speed <= 0.0) return slope;
  const double most = std::max(wall_speed - std::abs(speed), 0.0);
  return std::clamp(slope, -most, most);
}

// The known neighbours of a point, and what lies behind them.
struct KnownBeside {
  int count = 0;
  int axis[6], m[6];
  int step[6];      // to the next point behind m; 0: those that a slope takes are not all known
  bool is_wide[6];  // the valid points behind are as many as make no gap of the water

  KnownBeside(const Mask& valid, int n, int layer) {
    constexpr int kWide = 5;
    const int stride[3] = {1, valid.nx(), valid.nx() * valid.ny()},
              size[3] = {valid.nx(), valid.ny(), valid.nz()};
    const Ijk c = unravel(valid, n);
    const int at[3] = {c.i, c.j, c.k};
    for_each_neighbour(valid, c, n, [&](int a, int side, int beside) {
      if (!known(valid, beside, layer)) return;
      const int back = side * stride[a];
      const auto inside = [&](int points) {
        const int end = at[a] + points * side;
        return end >= 0 && end < size[a];
      };
      axis[count] = a, m[count] = beside, step[count] = 0, is_wide[count] = false;
      if (layer <= kLinearLayers && inside(4) && known(valid, beside + back, layer) &&
          known(valid, beside + 2 * back, layer) && known(valid, beside + 3 * back, layer)) {
        step[count] = back;
        const int first = layer - 1;  // behind m, of the valid ones
        bool all = inside(first + kWide);
        for (int w = first; all && w < first + kWide; ++w) all = valid[beside + w * back] == 1;
        is_wide[count] = all;
      }
      ++count;
    });
  }

  // The mean over the neighbours m of f(m) and the slope on the way to it, 0 if it is not known.
  // In solids under water (`solids` not null) of velocities along axis `component`.
  double mean(const Array3<double>& f, const InSolidsUnderWater* solids, int component) const {
    double sums[3] = {0.0, 0.0, 0.0};
    for (int b = 0; b < count; ++b) {
      const double* behind = f.data() + m[b];
      double value = *behind;
      if (const std::ptrdiff_t s = step[b]) {
        const double last = behind[0] - behind[s], before = behind[s] - behind[2 * s];
        if (!solids || !is_wide[b])
          value += trusted_slope(last, before, behind[2 * s] - behind[3 * s]);
        else if (axis[b] == component && *behind * static_cast<double>(s) > 0.0)
          value += slope_out_of_wall(last, before, *behind, solids->wall_speed);
        else
          value += slope_under_water(last, before);
      }
      sums[axis[b]] += value;
    }
    return (sums[0] + sums[1] + sums[2]) / count;
  }
};

void zero_invalid(Array3<double>& f, const Mask& valid) {
  const int rows = valid.ny() * valid.nz(), nx = valid.nx();
  constexpr int kAtOnce = 64;  // in turn: those of the water are left alone
#pragma omp parallel for schedule(static, kAtOnce)
  for (int r = 0; r < rows; ++r) {
    const unsigned char* known = valid.data() + static_cast<std::size_t>(r) * nx;
    if (!std::memchr(known, 0, nx)) continue;
    double* values = f.data() + static_cast<std::size_t>(r) * nx;
#pragma omp simd
    for (int i = 0; i < nx; ++i) values[i] = known[i] ? values[i] : 0.0;
  }
}

// `value` of solid cell n as far as the open cells beside it allow, from whose distance its own
// differs by at most dx (and a half, or round-off beside a plane surface would take part). Lines
// from elsewhere, continued through a body, came out at its underside as air in the open part of a
// cell amid deep water, which then fell in [D68].
double as_open_cells_allow(const Array3<double>& phi, const Mask& solid, int n, double dx,
                           double value) {
  constexpr double kApart = 1.5;
  double low = -INFINITY, high = INFINITY;
  for_each_neighbour(solid, unravel(solid, n), n, [&](int, int, int m) {
    if (solid[m]) return;
    low = std::max(low, phi[m] - kApart * dx), high = std::min(high, phi[m] + kApart * dx);
  });
  return std::clamp(value, std::min(low, high), std::max(low, high));  // reversed: a thin body
}

// How far the slope of the line through `near` and `far` is used: near the interface, or
// where the line runs along it. Deep water beside a body must not grow an interface inside the body
// out of a slope (a bubble that once stuck to a sphere's underside fed itself so, and ate 1 % of
// the tank a second).
double slope_trust(double near, double slope, double dx) {
  constexpr double kAlong = 0.3;  // |slope| / dx of a line along the interface
  if (std::abs(slope) <= kAlong * dx) return 1.0;
  return std::clamp(2.0 - std::abs(near) / dx, 0.0, 1.0);
}

// Mean over the axes of the straight lines through the two known points next to n, both inside the
// band, the fully trusted ones if there are any. Without a line the old value if it is within 1.5
// cells of the neighbours' mean, and else that mean.
double line_extension(const Array3<double>& phi, const Mask& valid, int n, int layer, double dx,
                      double band) {
  const int stride[3] = {1, phi.nx(), phi.nx() * phi.ny()};
  const int size[3] = {phi.nx(), phi.ny(), phi.nz()};
  const Ijk c = unravel(phi, n);
  const int at[3] = {c.i, c.j, c.k};
  std::array<double, 3> lines = {}, points = {};  // by axis: mirror images have equal sums
  double best_trust = 0.0;
  int line_count = 0, point_count = 0;
  for_each_neighbour(valid, c, n, [&](int axis, int side, int m) {
    if (!known(valid, m, layer)) return;
    points[axis] += phi[m], ++point_count;
    const int beyond = at[axis] + 2 * side, mm = n + 2 * side * stride[axis];
    if (beyond < 0 || beyond >= size[axis] || !known(valid, mm, layer)) return;
    if (std::abs(phi[m]) >= band || std::abs(phi[mm]) >= band) return;
    const double slope = std::clamp(phi[m] - phi[mm], -dx, dx),
                 trust = slope_trust(phi[m], slope, dx);
    if (trust < best_trust) return;
    if (trust == 1.0 && best_trust < 1.0) lines = {}, line_count = 0, best_trust = 1.0;
    lines[axis] += phi[m] + trust * slope, ++line_count;
  });
  const auto sum = [](const std::array<double, 3>& of) { return of[0] + of[1] + of[2]; };
  if (line_count) return std::clamp(sum(lines) / line_count, -band, band);
  const double mean = sum(points) / point_count;
  return std::abs(phi[n] - mean) <= 1.5 * dx && (phi[n] < 0) == (mean < 0) ? phi[n] : mean;
}

// Whether the rows (j, k) and those up to `reach` from them along y and z hold solid cells.
std::vector<char> rows_near_solids(const Mask& solid, int reach) {
  const int ny = solid.ny(), nz = solid.nz();
  const RowShares own =
      row_shares(solid, [marks = solid.data()](std::size_t n) { return marks[n] != 0; });
  std::vector<char> near(own.row.size(), 0);
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j) {
      if (own(j, k) == Share::kNone) continue;
      for (int kk = std::max(k - reach, 0); kk <= std::min(k + reach, nz - 1); ++kk)
        for (int jj = std::max(j - reach, 0); jj <= std::min(j + reach, ny - 1); ++jj)
          near[jj + static_cast<std::size_t>(ny) * kk] = 1;
    }
  return near;
}

// Open cells next to which the surface stands in the open, in rows near solids.
std::vector<int> cells_at_surface(const Array3<double>& phi, const Mask& solid,
                                  const std::vector<char>& near) {
  return collect_cells_at_changes(
      phi, [&](std::size_t n) { return phi[n] < 0.0; },
      [&](int i, int j, int k, int n) {
        return near[j + static_cast<std::size_t>(phi.ny()) * k] &&
               crosses_in_the_open(phi, solid, {i, j, k}, n);
      });
}

// Mean of the fully trusted straight lines through two known points; `none` without any.
double trusted_lines(const Array3<double>& phi, const Mask& valid, int n, double dx, double none) {
  const int stride[3] = {1, phi.nx(), phi.nx() * phi.ny()};
  const int size[3] = {phi.nx(), phi.ny(), phi.nz()};
  const Ijk c = unravel(phi, n);
  const int at[3] = {c.i, c.j, c.k};
  double lines[3] = {0.0, 0.0, 0.0};  // by axis: mirror images have equal sums
  int count = 0;
  for_each_neighbour(valid, c, n, [&](int axis, int side, int m) {
    const int beyond = at[axis] + 2 * side, mm = n + 2 * side * stride[axis];
    if (valid[m] != 1 || beyond < 0 || beyond >= size[axis] || valid[mm] != 1) return;
    const double slope = std::clamp(phi[m] - phi[mm], -dx, dx);
    if (slope_trust(phi[m], slope, dx) == 1.0) lines[axis] += phi[m] + slope, ++count;
  });
  return count ? (lines[0] + lines[1] + lines[2]) / count : none;
}

}  // namespace

Mask continue_surface(const Grid& g, Array3<double>& phi, const Mask& solid, int layers) {
  constexpr double kReach = 2.5;  // dx, from the surface: the cells that say where it is
  constexpr int kRead = 4;        // cells from a solid to the farthest that reads it, and one more
  Mask sheet;
  if (solid.size() == 0) return sheet;
  const std::vector<char> near = rows_near_solids(solid, kRead);
  if (std::find(near.begin(), near.end(), 1) == near.end()) return sheet;
  sheet = Mask(solid.nx(), solid.ny(), solid.nz(), 0);
  Mask valid(solid.nx(), solid.ny(), solid.nz(), 0);
  std::vector<int> front;
  for (const int n : cells_at_surface(phi, solid, near))
    for_each_around(solid, unravel(phi, n), [&](int m) {
      if (!solid[m] && !valid[m]) valid[m] = 1, front.push_back(m);
    });
  std::vector<int> waiting;  // solid cells that no line has reached yet
  std::vector<double> values;
  for (int layer = 0; layer < layers; ++layer) {
    for (const int n : front)
      for_each_neighbour(valid, unravel(valid, n), n, [&](int, int, int m) {
        if (solid[m] && !valid[m]) valid[m] = kWaiting, waiting.push_back(m);
      });
    values.clear();
    for (const int n : waiting) values.push_back(trusted_lines(phi, valid, n, g.dx, kReach * g.dx));
    front.clear();
    std::vector<int> left;
    for (std::size_t t = 0; t < waiting.size(); ++t) {
      const int n = waiting[t];
      if (std::abs(values[t]) >= kReach * g.dx) {
        left.push_back(n);
        continue;
      }
      const double value = as_open_cells_allow(phi, solid, n, g.dx, values[t]);
      phi[n] = unless_rounding(phi[n], value, kUnchanged * g.dx);
      valid[n] = sheet[n] = 1;
      front.push_back(n);
    }
    waiting.swap(left);
  }
  return sheet;
}

bool InSolidsUnderWater::operator()(int axis, int face) const {
  if (open[axis][face] >= 1.0) return false;
  const Ijk c = unravel(open[axis], face);
  Vec3i high(c.i, c.j, c.k), low = high;
  --low[axis];
  const auto is_deep = [&](const Vec3i& cell) {
    return !phi.contains(cell[0], cell[1], cell[2]) || phi(cell[0], cell[1], cell[2]) <= -depth;
  };
  return is_deep(low) && is_deep(high);
}

void extrapolate_velocity(const std::vector<MacField*>& fields, FaceField<unsigned char>& valid,
                          int layers, const InSolidsUnderWater* solids) {
  for (int a = 0; a < 3; ++a) {
    const Mask& known = valid[a];
    const std::vector<std::vector<int>> grown = grow_layers(valid[a], layers);
    for_each_layer(grown, [&](int n, int layer) {
      const KnownBeside beside(known, n, layer);
      const InSolidsUnderWater* here = solids && (*solids)(a, n) ? solids : nullptr;
      for (MacField* u : fields) (*u)[a][n] = beside.mean((*u)[a], here, a);
    });
    for (MacField* u : fields) zero_invalid((*u)[a], known);
  }
}

void extend_level_set(const Grid& g, Array3<double>& phi, const Mask& solid, int layers,
                      double band, const Mask& sheet) {
  if (solid.size() == 0) return;
  Mask valid(solid.nx(), solid.ny(), solid.nz(), Unfilled{});
  const unsigned char *closed = solid.data(), *seen = sheet.size() != 0 ? sheet.data() : nullptr;
  unsigned char* marks = valid.data();
#pragma omp parallel for simd schedule(static)
  for (std::size_t n = 0; n < solid.size(); ++n)
    marks[n] = closed[n] == 0 || (seen && seen[n] != 0);
  for_each_layer(grow_layers(valid, layers), [&](int n, int layer) {
    const double value =
        as_open_cells_allow(phi, solid, n, g.dx, line_extension(phi, valid, n, layer, g.dx, band));
    phi[n] = unless_rounding(phi[n], value, kUnchanged * g.dx);
  });
}

}  // namespace archetide
