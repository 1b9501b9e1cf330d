#include "runtime/fluid/level_set.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/fluid/cell_list.h"
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

}  // namespace

void advect_level_set(const Grid& g, const MacField& u, double dt, Array3<double>& phi, double band,
                      const Sides& open_side) {
  const std::vector<int> cells =
      collect_cells(phi, [&](int, int, int, int n) { return std::abs(phi[n]) < band; });
  const MacSampler sampler(g, u);
  const int count = static_cast<int>(cells.size());
  std::vector<double> values(count);
#pragma omp parallel for schedule(dynamic, 1024)
  for (int t = 0; t < count; ++t) {
    const Ijk c = unravel(phi, cells[t]);
    const Axes x = {c.i + 0.5, c.j + 0.5, c.k + 0.5, 0.0};
    Axes v, end;
    sampler.at(x, v);
    sampler.trace(x, v, -dt / g.dx, end);
    const double s[3] = {end[0], end[1], end[2]};
    const double foot[3] = {s[0] - 0.5, s[1] - 0.5, s[2] - 0.5};
    values[t] = with_air_outside(g, open_side, phi, s, tricubic(phi, foot));
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
        double fraction = 1.0;
        if (phi[n] > -g.dx) {
          const double* p = phi.data() + n;
          fraction = half_space_fraction(
              phi[n], Vec3(difference(p, 1, i, g.nx), difference(p, g.nx, j, g.ny),
                           difference(p, static_cast<std::ptrdiff_t>(g.nx) * g.ny, k, g.nz)));
        }
        sum += solid_fraction ? fraction * open_fraction((*solid_fraction)[n]) : fraction;
      }
      rows[j + static_cast<std::size_t>(g.ny) * k] = sum;
    }
  double total = 0.0;
  for (double row : rows) total += row;
  return total * g.dx * g.dx * g.dx;
}

}  // namespace archetide
