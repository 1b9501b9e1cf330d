#include "common/mesh/grid_sdf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace archetide {
namespace {

/// The grid cell around a point: the 8 corner values and the point's position in the cell, in
/// [0,1]^3.
struct CellSample {
  std::array<double, 8> corner;  // m, x fastest
  Vec3 s;
};

Vec3 clamp_to_box(const GridSdf& grid, const Vec3& x) {
  const Vec3 top = grid.origin + grid.spacing * (grid.nodes.cast<double>() - Vec3::Ones());
  return x.cwiseMax(grid.origin).cwiseMin(top);
}

CellSample sample_cell(const GridSdf& grid, const Vec3& inside) {
  CellSample cell;
  std::array<std::size_t, 3> i{};
  for (int axis = 0; axis < 3; ++axis) {
    const double g = (inside[axis] - grid.origin[axis]) / grid.spacing;
    const int low =
        std::clamp(static_cast<int>(std::floor(g)), 0, std::max(grid.nodes[axis] - 2, 0));
    i[axis] = static_cast<std::size_t>(low);
    cell.s[axis] = std::clamp(g - low, 0.0, 1.0);
  }
  const std::size_t nx = grid.nodes[0];
  const std::size_t ny = grid.nodes[1];
  for (std::size_t c = 0; c < 8; ++c) {
    const std::size_t x = i[0] + (c & 1), y = i[1] + (c >> 1 & 1), z = i[2] + (c >> 2);
    cell.corner[c] = grid.values[x + nx * (y + ny * z)];
  }
  return cell;
}

double lerp(double a, double b, double s) { return a + s * (b - a); }

double interpolate(const CellSample& cell) {
  const std::array<double, 8>& v = cell.corner;
  const Vec3& s = cell.s;
  return lerp(lerp(lerp(v[0], v[1], s[0]), lerp(v[2], v[3], s[0]), s[1]),
              lerp(lerp(v[4], v[5], s[0]), lerp(v[6], v[7], s[0]), s[1]), s[2]);
}

/// Derivative by the position in the cell, per cell width.
Vec3 slope(const CellSample& cell) {
  const std::array<double, 8>& v = cell.corner;
  const Vec3& s = cell.s;
  return {lerp(lerp(v[1] - v[0], v[3] - v[2], s[1]), lerp(v[5] - v[4], v[7] - v[6], s[1]), s[2]),
          lerp(lerp(v[2] - v[0], v[3] - v[1], s[0]), lerp(v[6] - v[4], v[7] - v[5], s[0]), s[2]),
          lerp(lerp(v[4] - v[0], v[5] - v[1], s[0]), lerp(v[6] - v[2], v[7] - v[3], s[0]), s[1])};
}

}  // namespace

double GridSdf::value(const Vec3& x) const {
  if (values.empty()) return std::numeric_limits<double>::infinity();
  const Vec3 inside = clamp_to_box(*this, x);
  return interpolate(sample_cell(*this, inside)) + (x - inside).norm();
}

Vec3 GridSdf::gradient(const Vec3& x) const {
  if (values.empty()) return Vec3::Zero();
  const Vec3 inside = clamp_to_box(*this, x);
  Vec3 g = slope(sample_cell(*this, inside)) / spacing;
  const Vec3 beyond = x - inside;
  if (beyond.isZero(0.0)) return g;
  // Outside, φ = φ(clamped x) + |x - clamped x|: clamped axes lose the interpolant's slope.
  for (int axis = 0; axis < 3; ++axis) {
    if (beyond[axis] != 0.0) g[axis] = 0.0;
  }
  return g + beyond.normalized();
}

}  // namespace archetide
