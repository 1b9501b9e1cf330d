#include "runtime/fluid/level_set.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/fluid/advection.h"
#include "runtime/fluid/cell_list.h"
#include "runtime/fluid/path_block.h"
#include "runtime/fluid/sampling.h"
#include "runtime/fluid/tricubic.h"

namespace archetide {
namespace {

// Volume fraction of t in [0,1] where slope t < beta, slope >= 0, shifted by every t: the mean over
// t of clamp((beta - m1 t) / m2, 0, 1); m2 >= m1 >= 0, m2 > 0. The integrand is linear between its
// breakpoints.
double square_fraction(double beta, double m1, double m2) {
  const auto height = [&](double t) { return std::clamp((beta - m1 * t) / m2, 0.0, 1.0); };
  const auto breakpoint = [&](double b) {
    return m1 > 0 ? std::clamp((beta - b) / m1, 0.0, 1.0) : 0.0;
  };
  const double t[4] = {0.0, breakpoint(m2), breakpoint(0.0), 1.0};
  double area = 0.0;
  for (int p = 0; p < 3; ++p) area += (t[p + 1] - t[p]) * height(0.5 * (t[p] + t[p + 1]));
  return area;
}

// Central difference of phi along one axis, one-sided at the tank, m per cell.
double difference(const double* p, std::ptrdiff_t stride, int i, int n) {
  if (n == 1) return 0.0;
  if (i == 0) return p[stride] - p[0];
  if (i == n - 1) return p[0] - p[-stride];
  return 0.5 * (p[stride] - p[-stride]);
}

// phi at the point s (cells from the low corner) where it lies beyond the last centres before an
// open side: with the last slope and at least the distance to the side, outside of which is air.
double with_air_outside(const Grid& g, const Sides& open_side, const Array3<double>& phi,
                        const double s[3], double value) {
  int c[3];
  for (int a = 0; a < 3; ++a) c[a] = std::clamp(static_cast<int>(s[a]), 0, g.size(a) - 1);
  for (int side = 0; side < 6; ++side) {
    if (!open_side[side]) continue;
    const int a = side / 2;
    const double beyond = side % 2 ? s[a] - (g.size(a) - 0.5) : 0.5 - s[a];  // the last centre
    if (beyond <= 0.0) continue;
    int inner[3] = {c[0], c[1], c[2]};
    inner[a] = std::clamp(c[a] + (side % 2 ? -1 : 1), 0, g.size(a) - 1);
    const double slope = phi(c[0], c[1], c[2]) - phi(inner[0], inner[1], inner[2]);
    value = std::max(value + beyond * std::clamp(slope, 0.0, g.dx), (beyond - 0.5) * g.dx);
  }
  return value;
}

// Component A at places d (|d| <= 1/2) from the centres of the cells with the low faces p, p + 1,
// ..
template <int A>
void component_block(const double* p, const std::array<std::ptrdiff_t, 3>& stride, const Block d[3],
                     Block& out) {
  constexpr int B = (A + 1) % 3, C = (A + 2) % 3;
  const Block low = 0.5 - d[A], high = 0.5 + d[A];
  const Hat b(d[B]), c(d[C]);
  out = Block{};
  for (int n = 0; n < 3; ++n) {
    Block plane = {};
    for (int m = 0; m < 3; ++m) {
      const double* q = p + (n - 1) * stride[C] + (m - 1) * stride[B];
      Block before, after;
      load(q, before), load(q + stride[A], after);
      plane += b.at[m] * (low * before + high * after);
    }
    out += c.at[n] * plane;
  }
}

// Where the water that arrives at a cell comes from; h = -dt/dx.
struct BackTrace {
  const Grid& g;
  const MacField& u;
  const Array3<double>& phi;
  const Sides& open_side;
  double h;
  MacSampler sampler;

  double value(Ijk c) const {
    const Axes x = {c.i + 0.5, c.j + 0.5, c.k + 0.5, 0.0};
    Axes v, end;
    sampler.at(x, v);
    sampler.trace(x, v, h, end);
    const double s[3] = {end[0], end[1], end[2]};
    const double foot[3] = {s[0] - 0.5, s[1] - 0.5, s[2] - 0.5};
    return with_air_outside(g, open_side, phi, s, tricubic(phi, foot));
  }

  // Of eight cells from c on, far enough from the tank's sides; false where a path is too long.
  bool values(Ijk c, Block& out) const {
    const double* p[3];
    std::array<std::ptrdiff_t, 3> s[3];
    Block v[3], d[3];
    for (int a = 0; a < 3; ++a) {
      p[a] = &u[a](c.i, c.j, c.k), s[a] = strides(u[a]);
      Block before, after;
      load(p[a], before), load(p[a] + s[a][a], after);
      d[a] = 0.25 * h * (before + after);
    }
    if (!all_within(d, 0.5)) return false;
    component_block<0>(p[0], s[0], d, v[0]);
    component_block<1>(p[1], s[1], d, v[1]);
    component_block<2>(p[2], s[2], d, v[2]);
    for (int a = 0; a < 3; ++a) d[a] = h * v[a];
    if (!all_within(d, 1.0)) return false;
    tricubic_block(&phi(c.i, c.j, c.k), strides(phi), d, out);
    return true;
  }
};

// Cells that the eight at once must keep from the tank's sides.
constexpr int kRoom = 2;

// The values of `count` cells of a row, from cell c on; at most eight.
void trace_run(const BackTrace& trace, Ijk c, int count, double* values) {
  const Array3<double>& phi = trace.phi;
  const auto inner = [](int i, int n) { return i >= kRoom && i < n - kRoom; };
  const int first = std::min(c.i, phi.nx() - kRoom - kBlock);
  Block block;
  if (inner(c.j, phi.ny()) && inner(c.k, phi.nz()) && inner(c.i, phi.nx()) && first >= kRoom &&
      trace.values({first, c.j, c.k}, block))
    for (int l = 0; l < count; ++l) values[l] = block[c.i - first + l];
  else
    for (int l = 0; l < count; ++l) values[l] = trace.value({c.i + l, c.j, c.k});
}

// How many of the cells from the t-th on, before the end-th, trace_run can take.
int run_length(const Array3<double>& phi, const std::vector<int>& cells, int t, int end, int i) {
  const int inner_end = phi.nx() - kRoom, row_end = i < kRoom       ? kRoom
                                                    : i < inner_end ? inner_end
                                                                    : phi.nx();
  const int most = std::min({kBlock, end - t, row_end - i});
  int count = 1;
  while (count < most && cells[t + count] == cells[t] + count) ++count;
  return count;
}

// Cells of the band, and those beyond it where the way is long (advect_level_set), ascending.
std::vector<int> cells_to_move(const Grid& g, const MacField& u, double dt,
                               const Array3<double>& phi, double band, double still) {
  std::vector<int> cells =
      collect_cells(phi, [&](int, int, int, int n) { return std::abs(phi[n]) < band; });
  const double per_cell = dt / g.dx;
  if (!(cfl_speed(u) * per_cell > still)) return cells;
  // From the band into such a cell, in steps to neighbours: along a diagonal a way is up to sqrt 3
  // of them.
  const auto layers = [&](int n) {
    const Ijk c = unravel(phi, n);
    double fastest = 0.0;
    for (int a = 0; a < 3; ++a)
      for (int side = 0; side < 2; ++side)
        fastest = std::max(fastest, std::abs(u[a](c.i + (a == 0) * side, c.j + (a == 1) * side,
                                                  c.k + (a == 2) * side)));
    return 2.0 * std::ceil(fastest * per_cell - still);
  };
  constexpr unsigned char kInside = 1, kEdge = 2;
  constexpr int kMost = 250;  // layers that a mark can tell apart; no step is as long
  const double edge = band - 1.5 * g.dx;
  Array3<unsigned char> mark(phi.nx(), phi.ny(), phi.nz(), 0);
#pragma omp parallel for
  for (std::size_t t = 0; t < cells.size(); ++t)
    mark[cells[t]] = std::abs(phi[cells[t]]) < edge ? kInside : kEdge;
  std::vector<int> front = collect_from(cells, [&](int n, std::vector<int>& out) {
    if (mark[n] == kEdge) out.push_back(n);
  });
  std::vector<int> beyond;
  for (int layer = 1; layer <= kMost && !front.empty(); ++layer) {
    const auto last = static_cast<unsigned char>(kEdge + layer - 1);
    front = collect_from(next_front(mark, front, last), [&](int n, std::vector<int>& out) {
      if (layers(n) >= layer) out.push_back(n);
    });
    for (const int n : front) mark[n] = last + 1;
    beyond.insert(beyond.end(), front.begin(), front.end());
  }
  std::sort(beyond.begin(), beyond.end());
  const auto count = static_cast<std::ptrdiff_t>(cells.size());
  cells.insert(cells.end(), beyond.begin(), beyond.end());
  std::inplace_merge(cells.begin(), cells.begin() + count, cells.end());
  return cells;
}

}  // namespace

void advect_level_set(const Grid& g, const MacField& u, double dt, Array3<double>& phi, double band,
                      const Sides& open_side, double still) {
  const std::vector<int> cells = cells_to_move(g, u, dt, phi, band, still);
  const BackTrace trace{g, u, phi, open_side, -dt / g.dx, MacSampler(g, u)};
  constexpr int kChunk = 1024;
  const int count = static_cast<int>(cells.size());
  std::vector<double> values(count);
#pragma omp parallel for schedule(dynamic)
  for (int chunk = 0; chunk < count; chunk += kChunk) {
    const int end = std::min(chunk + kChunk, count);
    for (int t = chunk; t < end;) {
      const Ijk c = unravel(phi, cells[t]);
      const int run = run_length(phi, cells, t, end, c.i);
      trace_run(trace, c, run, values.data() + t);
      t += run;
    }
  }
#pragma omp parallel for
  for (int t = 0; t < count; ++t) phi[cells[t]] = values[t];
}

double half_space_fraction(double value, const Vec3& m) {
  double a[3] = {std::abs(m[0]), std::abs(m[1]), std::abs(m[2])};
  std::sort(a, a + 3);
  const double alpha = 0.5 * (a[0] + a[1] + a[2]) - value;  // water: a . s < alpha, s in [0,1]^3
  if (alpha <= 0.0) return 0.0;
  if (alpha >= a[0] + a[1] + a[2]) return 1.0;

  // Mean over s0 of the area of the slice, which is quadratic between the breakpoints: two-point
  // Gauss is exact.
  const auto breakpoint = [&](double b) {
    return a[0] > 0 ? std::clamp((alpha - b) / a[0], 0.0, 1.0) : 0.0;
  };
  const double s[6] = {
      0.0, breakpoint(a[1] + a[2]), breakpoint(a[2]), breakpoint(a[1]), breakpoint(0.0), 1.0};
  const double gauss = 0.5 / std::sqrt(3.0);
  double fraction = 0.0;
  for (int p = 0; p < 5; ++p) {
    const double width = s[p + 1] - s[p], middle = 0.5 * (s[p] + s[p + 1]);
    if (width == 0.0) continue;
    for (double offset : {-gauss, gauss})
      fraction +=
          0.5 * width * square_fraction(alpha - a[0] * (middle + offset * width), a[1], a[2]);
  }
  return fraction;
}

double wet_fraction(const Grid& g, const Array3<double>& phi, int i, int j, int k, std::size_t n,
                    double shift) {
  const double value = phi[n] + shift;
  if (value >= g.dx) return 0.0;
  if (value <= -g.dx) return 1.0;
  const double* p = phi.data() + n;
  return half_space_fraction(
      value, Vec3(difference(p, 1, i, g.nx), difference(p, g.nx, j, g.ny),
                  difference(p, static_cast<std::ptrdiff_t>(g.nx) * g.ny, k, g.nz)));
}

double water_volume(const Grid& g, const Array3<double>& phi,
                    const Array3<double>* solid_fraction) {
  // One sum per row, added in order: the result does not depend on the number of threads.
  std::vector<double> rows(static_cast<std::size_t>(g.ny) * g.nz, 0.0);
#pragma omp parallel for collapse(2) schedule(dynamic, 16)
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j) {
      double sum = 0.0;
      for (int i = 0; i < g.nx; ++i) {
        const std::size_t n = phi.index(i, j, k);
        if (phi[n] >= g.dx) continue;
        const double fraction = wet_fraction(g, phi, i, j, k, n);
        sum += solid_fraction ? fraction * open_fraction((*solid_fraction)[n]) : fraction;
      }
      rows[j + static_cast<std::size_t>(g.ny) * k] = sum;
    }
  double total = 0.0;
  for (double row : rows) total += row;
  return total * g.dx * g.dx * g.dx;
}

}  // namespace archetide
