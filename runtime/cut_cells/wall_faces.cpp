#include "runtime/cut_cells/wall_faces.h"

#include <algorithm>

#include "runtime/cut_cells/dual_faces.h"

namespace archetide {
namespace {

// Solid fraction of a cell; beyond the tank that of the last cell in it.
double solid_at(const Array3<double>& cell, Vec3i c) {
  const Vec3i last(cell.nx() - 1, cell.ny() - 1, cell.nz() - 1);
  c = c.cwiseMax(Vec3i::Zero()).cwiseMin(last);
  return cell(c[0], c[1], c[2]);
}

// Gradient of the solid fraction at a face, over the ten cells around it, per cell.
Vec3 solid_gradient(const Array3<double>& cell, int axis, const Vec3i& high) {
  const Vec3i low = high - Vec3i::Unit(axis);
  Vec3 gradient;
  gradient[axis] = solid_at(cell, high) - solid_at(cell, low);
  for (int b = 0; b < 3; ++b) {
    if (b == axis) continue;
    const Vec3i step = Vec3i::Unit(b);
    gradient[b] = 0.25 * (solid_at(cell, high + step) - solid_at(cell, high - step) +
                          solid_at(cell, low + step) - solid_at(cell, low - step));
  }
  return gradient;
}

// Mean of component c at the four faces around a face of another axis; those beyond the tank are
// left out.
double mean_around(const Array3<double>& u, int axis, int c, const Vec3i& face) {
  double sum = 0.0;
  int count = 0;
  for (int side = 0; side < 4; ++side) {
    Vec3i at = face;
    at[axis] -= side & 1, at[c] += side >> 1;
    if (!u.contains(at[0], at[1], at[2])) continue;
    sum += u(at[0], at[1], at[2]), ++count;
  }
  return count > 0 ? sum / count : 0.0;
}

}  // namespace

std::vector<WallFace> wall_faces(const SolidFractions& obstacles) {
  // Solid fractions; where they change less in a cell, a corner of the wall says nothing of it.
  constexpr double kSteep = 0.2;
  std::vector<WallFace> walls;
  for (int a = 0; a < 3; ++a) {
    const Array3<double>& covered = obstacles.face[a];
    for (int k = 0; k < covered.nz(); ++k)
      for (int j = 0; j < covered.ny(); ++j)
        for (int i = 0; i < covered.nx(); ++i) {
          if (covered(i, j, k) < 1.0 - kSliver) continue;
          const Vec3 gradient = solid_gradient(obstacles.cell, a, {i, j, k});
          if (gradient.norm() > kSteep) walls.push_back({a, {i, j, k}, gradient.normalized()});
        }
  }
  return walls;
}

void keep_behind_walls(const std::vector<WallFace>& walls, MacField& u) {
  std::vector<double> held(walls.size());
#pragma omp parallel for schedule(static)
  for (std::size_t n = 0; n < walls.size(); ++n) {
    const WallFace& w = walls[n];
    const double here = u[w.axis](w.face[0], w.face[1], w.face[2]);
    double through = w.normal[w.axis] * here;
    for (int c = 0; c < 3; ++c)
      if (c != w.axis) through += w.normal[c] * mean_around(u[c], w.axis, c, w.face);
    held[n] = here - w.normal[w.axis] * through;
  }
  for (std::size_t n = 0; n < walls.size(); ++n) {
    const Vec3i& f = walls[n].face;
    u[walls[n].axis](f[0], f[1], f[2]) = held[n];
  }
}

}  // namespace archetide
