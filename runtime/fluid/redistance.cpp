#include "runtime/fluid/redistance.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/fluid/cell_list.h"

namespace archetide {
namespace {

constexpr double kUnchanged = 1e-9;     // in dx: smaller changes are rounding
constexpr double kConverged = 1e-12;    // in dx: sweeps end when no cell moves more
constexpr int kMaxSweeps = 24;
constexpr double kSmooth = 0.5;         // slopes that differ by more than this part of the steepest one are a kink

bool wet(double phi) { return phi < 0.0; }

// The box of cells as strides, so that the three axes are one loop.
struct Box {
  int size[3];
  int stride[3];
  explicit Box(const Array3<double>& a)
      : size{a.nx(), a.ny(), a.nz()}, stride{1, a.nx(), a.nx() * a.ny()} {}
};

bool at_interface(const Array3<double>& phi, Ijk c, int n) {
  bool crossed = false;
  for_each_neighbour(phi, c, n, [&](int, int, int m) { crossed |= wet(phi[m]) != wet(phi[n]); });
  return crossed;
}

// Slopes of phi to both sides of a cell along one axis (m per cell) and whether the interface lies there.
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

// Distance of a cell next to the interface, m: |phi| / |grad phi|, at most the nearest crossing on an axis.
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
  return dx * value / std::max(std::sqrt(slope2), steepest_crossing);
}

// Root of sum_a (psi - b_a)^2 c_a^2 = dx^2 over the axes whose b lies below it (b ascending): the upwind
// eikonal equation |grad psi| = 1.
double solve_eikonal(double b[3], double c[3], double dx) {
  const auto order = [&](int p, int q) {
    if (b[q] < b[p]) std::swap(b[p], b[q]), std::swap(c[p], c[q]);
  };
  order(0, 1), order(1, 2), order(0, 1);
  double psi = b[0] + dx / c[0];
  double A = c[0] * c[0], B = A * b[0], C = B * b[0];
  for (int axis = 1; axis < 3 && psi > b[axis]; ++axis) {
    const double c2 = c[axis] * c[axis];
    A += c2, B += c2 * b[axis], C += c2 * b[axis] * b[axis];
    const double root = B * B - A * (C - dx * dx);
    if (root < 0.0) break;
    psi = (B + std::sqrt(root)) / A;
  }
  return psi;
}

// Distance (m, on the side of n) that the neighbours of n imply, at most `band`.
double upwind_distance(const Array3<double>& phi, const Box& box, double dx, double band, int n, bool second_order) {
  const Ijk cell = unravel(phi, n);
  const int at[3] = {cell.i, cell.j, cell.k};
  const double* p = phi.data() + n;
  const double sign = wet(*p) ? -1.0 : 1.0;
  double b[3], c[3];
  for (int a = 0; a < 3; ++a) {
    const int stride = box.stride[a];
    const double low = at[a] > 0 ? sign * p[-stride] : band;
    const double high = at[a] < box.size[a] - 1 ? sign * p[stride] : band;
    const int side = low <= high ? -1 : 1;
    const int beyond = at[a] + 2 * side;
    b[a] = std::min(low, high), c[a] = 1.0;
    if (!second_order || b[a] >= band || beyond < 0 || beyond >= box.size[a]) continue;
    // (3 psi - 4 psi_1 + psi_2) / 2 = 3/2 (psi - (4 psi_1 - psi_2)/3)
    const double next = sign * p[2 * side * stride];
    if (next <= b[a]) b[a] += (b[a] - next) / 3.0, c[a] = 1.5;
  }
  return std::min(solve_eikonal(b, c, dx), band);
}

// One Jacobi sweep; returns the largest change, m.
double sweep(Array3<double>& phi, const std::vector<int>& cells, std::vector<double>& values, const Box& box,
             double dx, double band, bool second_order) {
  const int count = static_cast<int>(cells.size());
  values.resize(count);
  double change = 0.0;
#pragma omp parallel for reduction(max : change)
  for (int t = 0; t < count; ++t) {
    const double old = phi[cells[t]];
    values[t] = std::copysign(upwind_distance(phi, box, dx, band, cells[t], second_order), old);
    change = std::max(change, std::abs(values[t] - old));
  }
#pragma omp parallel for
  for (int t = 0; t < count; ++t) phi[cells[t]] = values[t];
  return change;
}

}  // namespace

void redistance(const Grid& g, Array3<double>& phi, double band) {
  const Box box(phi);
  Array3<double> out(phi.nx(), phi.ny(), phi.nz());
  Array3<unsigned char> reached(phi.nx(), phi.ny(), phi.nz(), 0);
#pragma omp parallel for
  for (std::size_t n = 0; n < phi.size(); ++n) out[n] = wet(phi[n]) ? -band : band;

  // Cells next to the interface fix it.
  std::vector<int> layer =
      collect_cells(phi, [&](int i, int j, int k, int n) { return at_interface(phi, {i, j, k}, n); });
#pragma omp parallel for
  for (std::size_t t = 0; t < layer.size(); ++t) {
    const int n = layer[t];
    out[n] = std::copysign(std::min(interface_distance(phi, box, g.dx, n), band), phi[n]);
    reached[n] = 1;
  }

  // Outwards layer by layer, first order; then second order everywhere until nothing moves.
  std::vector<int> cells;
  std::vector<double> values;
  const auto inside_band = [&](int n) { return std::abs(out[n]) < band; };
  while (!(layer = claim_neighbours(reached, layer, 1, inside_band)).empty()) {
    sweep(out, layer, values, box, g.dx, band, false);
    cells.insert(cells.end(), layer.begin(), layer.end());
  }
  for (int s = 0; s < kMaxSweeps; ++s)
    if (sweep(out, cells, values, box, g.dx, band, true) <= kConverged * g.dx) break;

  // Take what changed by more than rounding.
#pragma omp parallel for
  for (std::size_t n = 0; n < phi.size(); ++n)
    if (!(std::abs(out[n] - phi[n]) <= kUnchanged * g.dx)) phi[n] = out[n];
}

}  // namespace archetide
