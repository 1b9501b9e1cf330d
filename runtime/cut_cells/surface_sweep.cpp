#include "runtime/cut_cells/surface_sweep.h"

#include <algorithm>
#include <cmath>

#include "common/base/exception_carrier.h"
#include "runtime/cut_cells/clip.h"

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
  DualFace f{axis, face, -1, -1, 1.0 - solid < kSliver, solid - volume, curvature, 0.0};
  // Two sides of a thin plate: no one normal velocity.
  if (n.norm() > 0.5 * area) f.n_over_A = n[axis] / n.squaredNorm();
  return f;
}

}  // namespace

void CellMoments::add(const Vec3& a, double x, const Vec3& squares, double kappa) {
  area += a;
  size += a.norm();
  moment_x += a[0] * x;
  // Divergence theorem for x_a^2 / 2, of which the cell's own faces have 1/8.
  moment += 0.5 * a.cwiseProduct(squares - Vec3::Constant(0.25));
  curvature += a.norm() * kappa;
}

SurfaceCells cell_moments(const Grid& g, const std::vector<Vec3>& points,
                          const std::vector<Vec3i>& triangles,
                          const std::vector<double>& curvature) {
  SurfaceCells cells(cell_box(g, points));
  for (const Vec3i& t : triangles) {
    Vec3 x[3], bend;
    for (int v = 0; v < 3; ++v) {
      x[v] = (points[t[v]] - g.origin) / g.dx;
      bend[v] = g.dx * curvature[t[v]];
    }
    for_each_piece(g, x, [&](const Vec3i& cell, const ClipPolygon& piece) {
      const Vec3 w = centroid_weights(piece);
      const double at = w[0] * x[0][0] + w[1] * x[1][0] + w[2] * x[2][0];
      const Vec3 centre = cell.cast<double>() + Vec3::Constant(0.5);
      cells.at(cell).add(vector_area(piece), at - centre[0], mean_squares(piece, centre),
                         w.dot(bend));
    });
  }
  return cells;
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

namespace {

// Sweeps lines of cells along an axis.
class LineSweep {
 public:
  LineSweep(const Grid& g, int axis, SurfaceCells& surface, SolidFractions& fractions)
      : g_(g), axis_(axis), surface_(surface), fractions_(fractions) {}

  // One line: what lies below the next cell.
  struct Line {
    double solid = 0.0;                 // fraction of the face
    double half_below = 0.0;            // solid volume of the half of the last cell next to it
    const CellMoments* last = nullptr;  // none: the line begins
  };

  // The next cell of a line; adds to the faces whose dual cell the surface crosses.
  void step(const Vec3i& cell, Line& line, std::vector<DualFace>& faces) {
    CellMoments* const touched = surface_.find(cell);
    const double crossed_below = line.last ? line.last->size : 0.0;
    if (!touched && crossed_below == 0.0 && snap(line.solid) == 0.0) {
      line = {line.solid, 0.0, &kNothing};
      return;  // nothing here, and nothing below
    }
    const int at = cell[axis_], end = g_.size(axis_);
    const double above = line.solid - (touched ? touched->area[axis_] : 0.0);
    if (axis_ == 0 && touched) touched->volume = 0.5 * (line.solid + above) + touched->moment_x;
    const double volume = touched ? touched->volume : line.solid;
    if (axis_ == 0 && at >= 0 && at < end)
      fractions_.cell(cell[0], cell[1], cell[2]) += snap(volume);
    const double lower = lower_half(snap(line.solid), snap(above), volume);
    const CellMoments& here = touched ? *touched : kNothing;
    if (at > 0 && at < end && line.last && crossed_below + here.size > kTouched)
      faces.push_back(
          dual_face(axis_, cell, *line.last, here, snap(line.solid), line.half_below + lower));
    if (at + 1 >= 0 && at < end) {
      const Vec3i f = cell + Vec3i::Unit(axis_);
      fractions_.face[axis_](f[0], f[1], f[2]) += snap(above);
    }
    line = {above, std::clamp(volume, 0.0, 1.0) - lower, &here};
  }

 private:
  static constexpr double kSnap = 1e-12;     // round-off of the sums; below 1e-13 on 24k triangles
  static constexpr double kTouched = 1e-12;  // surface in a dual cell, cells^2
  static const CellMoments kNothing;

  static double snap(double s) { return s < kSnap ? 0.0 : s > 1.0 - kSnap ? 1.0 : s; }

  const Grid& g_;
  const int axis_;
  SurfaceCells& surface_;
  SolidFractions& fractions_;
};
const CellMoments LineSweep::kNothing;

}  // namespace

// Eq. C3.
std::vector<DualFace> sweep_surface(const Grid& g, SurfaceCells& surface,
                                    SolidFractions& fractions) {
  constexpr std::size_t kWorthThreads = 16 * 16 * 16;  // smaller boxes do not pay for threads
  const CellBox& box = surface.box();
  const Vec3i low = box.low.cwiseMax(0),
              end = (box.low + box.size).cwiseMin(Vec3i(g.nx, g.ny, g.nz));
  std::vector<DualFace> faces;
  for (int axis = 0; axis < 3; ++axis) {
    // Slices that hold the axis and x. Rows along x are next to each other in memory: lines along y
    // and z go on side by side.
    const int across = axis == 2 ? 1 : 2, count = std::max(end[across] - low[across], 0);
    LineSweep sweep(g, axis, surface, fractions);
    std::vector<std::vector<DualFace>> found(count);  // in this order for any threads
    ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic) if (box.count() > kWorthThreads)
    for (int n = 0; n < count; ++n)
      carrier.run([&] {
        Vec3i cell = box.low;
        cell[across] = low[across] + n;
        const int other = 3 - across;  // of y and z
        if (axis == 0) {
          for (cell[other] = low[other]; cell[other] < end[other]; ++cell[other]) {
            LineSweep::Line line;
            cell[0] = box.low[0];
            for (int l = 0; l < box.size[0]; ++l, ++cell[0]) sweep.step(cell, line, found[n]);
          }
          return;
        }
        std::vector<LineSweep::Line> lines(std::max(end[0] - low[0], 0));
        for (int l = 0; l < box.size[other]; ++l, ++cell[other]) {
          cell[0] = low[0];
          for (LineSweep::Line& line : lines) sweep.step(cell, line, found[n]), ++cell[0];
        }
      });
    carrier.rethrow();
    for (const auto& part : found) faces.insert(faces.end(), part.begin(), part.end());
  }
  for (std::size_t n = 0; n < surface.cells().size(); ++n) {
    const Vec3i& c = surface.cells()[n];
    if (fractions.cell.contains(c[0], c[1], c[2]))
      fractions.moments.push_back(
          {fractions.cell.index(c[0], c[1], c[2]), surface.moments()[n].moment});
  }
  return faces;
}

}  // namespace archetide
