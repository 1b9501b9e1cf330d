#include "runtime/coupling/surface_sweep.h"

#include <algorithm>
#include <cmath>

#include "runtime/coupling/clip.h"

namespace archetide {
namespace {

// Solid volume of the lower half of a cell from the solid fractions of its low and high face and
// its volume: the integral of the quadratic through them.
double lower_half(double low, double high, double volume) {
  const double m = std::clamp(volume, 0.0, 1.0);
  return std::clamp(0.5 * m + (low - high) / 8.0, std::max(0.0, m - 0.5), std::min(0.5, m));
}

// Of the face between two cells along `axis`; solid: its fraction, volume: of its dual cell.
DualFace dual_face(int axis, const Vec3i& face, const CellMoments& low, const CellMoments& high,
                   double solid, double volume) {
  const double area = 0.5 * (low.size + high.size);
  const Vec3 n = 0.5 * (low.area + high.area);
  const double curvature = 0.5 * (low.curvature + high.curvature) / 20.0;
  DualFace f{axis, face, -1, -1, solid == 1.0, solid - volume, curvature, 0.0};
  // Two sides of a thin plate: no one normal velocity.
  if (n.norm() > 0.5 * area) f.n_over_A = n[axis] / n.squaredNorm();
  return f;
}

}  // namespace

void CellMoments::add(const Vec3& a, double x, double kappa) {
  area += a;
  size += a.norm();
  moment_x += a[0] * x;
  curvature += a.norm() * kappa;
}

std::vector<CellMoments> cell_moments(const Grid& g, const CellBox& box,
                                      const std::vector<Vec3>& points,
                                      const std::vector<Vec3i>& triangles,
                                      const std::vector<double>& curvature) {
  std::vector<CellMoments> moments(box.count());
  for (const Vec3i& t : triangles) {
    Vec3 x[3], bend;
    for (int v = 0; v < 3; ++v) {
      x[v] = (points[t[v]] - g.origin) / g.dx;
      bend[v] = g.dx * curvature[t[v]];
    }
    for_each_piece(g, x, [&](const Vec3i& cell, const ClipPolygon& piece) {
      const Vec3 w = centroid_weights(piece);
      const double at = w[0] * x[0][0] + w[1] * x[1][0] + w[2] * x[2][0];
      moments[box.index(cell)].add(vector_area(piece), at - cell[0] - 0.5, w.dot(bend));
    });
  }
  return moments;
}

std::vector<double> mean_curvature(const std::vector<Vec3>& points,
                                   const std::vector<Vec3i>& triangles) {
  std::vector<Vec3> gradient(points.size(), Vec3::Zero()), normal = gradient;
  std::vector<double> area(points.size(), 0.0);
  for (const Vec3i& t : triangles) {
    const Vec3 a = 0.5 * (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
    const Vec3 n = a.stableNormalized();
    for (int v = 0; v < 3; ++v) {
      gradient[t[v]] += 0.5 * n.cross(points[t[(v + 2) % 3]] - points[t[(v + 1) % 3]]);
      normal[t[v]] += a;
      area[t[v]] += a.norm() / 3.0;
    }
  }
  std::vector<double> kappa(points.size(), 0.0);
  for (std::size_t v = 0; v < points.size(); ++v)
    if (area[v] > 0.0) kappa[v] = 0.5 * gradient[v].dot(normal[v].stableNormalized()) / area[v];
  return kappa;
}

std::vector<DualFace> sweep_surface(const Grid& g, const CellBox& box,
                                    std::vector<CellMoments>& moments, SolidFractions& fractions) {
  constexpr double kSnap = 1e-12;  // round-off of the sums; measured below 1e-13 on 24k triangles
  constexpr double kTouched = 1e-12;                   // surface in a dual cell, cells^2
  constexpr std::size_t kWorthThreads = 16 * 16 * 16;  // smaller boxes do not pay for threads
  const auto snap = [](double s) { return s < kSnap ? 0.0 : s > 1.0 - kSnap ? 1.0 : s; };
  std::vector<DualFace> faces;
  for (int axis = 0; axis < 3; ++axis) {
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    std::vector<std::vector<DualFace>> found(box.size[c]);  // in this order for any threads
#pragma omp parallel for schedule(dynamic) if (box.count() > kWorthThreads)
    for (int n = 0; n < box.size[c]; ++n)
      for (int m = 0; m < box.size[b]; ++m) {
        Vec3i cell = box.low;
        cell[b] += m, cell[c] += n;
        if (cell[b] < 0 || cell[b] >= g.size(b) || cell[c] < 0 || cell[c] >= g.size(c)) continue;
        const CellMoments* last = nullptr;
        double solid = 0.0, half_below = 0.0;  // fraction of the face below `cell`, half under it
        for (int l = 0; l < box.size[axis]; ++l, ++cell[axis]) {
          CellMoments& here = moments[box.index(cell)];
          const double above = solid - here.area[axis];
          const int face = cell[axis];
          if (axis == 0) {
            here.volume = 0.5 * (solid + above) + here.moment_x;
            if (face >= 0 && face < g.nx)
              fractions.cell(face, cell[1], cell[2]) += snap(here.volume);
          }
          const double lower = lower_half(snap(solid), snap(above), here.volume);
          if (face > 0 && face < g.size(axis) && last && last->size + here.size > kTouched)
            found[n].push_back(dual_face(axis, cell, *last, here, snap(solid), half_below + lower));
          if (face + 1 >= 0 && face < g.size(axis)) {
            Vec3i f = cell;
            f[axis] = face + 1;
            fractions.face[axis](f[0], f[1], f[2]) += snap(above);
          }
          half_below = std::clamp(here.volume, 0.0, 1.0) - lower;
          solid = above;
          last = &here;
        }
      }
    for (const auto& part : found) faces.insert(faces.end(), part.begin(), part.end());
  }
  return faces;
}

}  // namespace archetide
