#include "runtime/fluid/volume_flux.h"

#include <algorithm>
#include <cmath>

#include "runtime/fluid/advection.h"
#include "runtime/fluid/cell_list.h"
#include "runtime/fluid/level_set.h"
#include "runtime/fluid/sampling.h"

namespace archetide {
namespace {

// Water that comes from farther above or below the surface than its way and this, cells, is all
// water or all air.
constexpr double kCut = 1.0;
constexpr double kTimesPerCell = 4.0;  // that the wet share is asked, and at least twice
constexpr int kMostTimes = 64;

// Flow through faces in cell volumes.
class Flow {
 public:
  Flow(const Grid& grid, const MacField& velocity, double dt, const Array3<double>& level,
       const FaceField<double>& w, const Sides& sides)
      : g(grid),
        u(velocity),
        phi(level),
        open(w),
        open_side(sides),
        h(dt / grid.dx),
        sampler(grid, velocity),
        levels(level) {
    for (int a = 0; a < 3; ++a) centres.set(a, g.size(a));
    farthest = kCut + h * cfl_speed(u);
  }

  /// Through face (i, j, k) of `axis` upwards, `beyond` as well.
  double through(int axis, int i, int j, int k, double beyond = 0.0) const {
    const std::size_t f = u[axis].index(i, j, k);
    const double flow = h * (open[axis][f] * u[axis][f] + beyond);
    if (flow == 0.0) return 0.0;
    const double level = at_face(axis, i, j, k);
    if (std::abs(level) > farthest || std::abs(level) > kCut + h * fastest(axis, i, j, k))
      return level < 0.0 ? flow : 0.0;
    return flow * wet_share(axis, i, j, k);
  }

 private:
  // Mean of phi / dx over the cells beside a face.
  double at_face(int axis, int i, int j, int k) const {
    const int c = axis == 0 ? i : axis == 1 ? j : k;
    const bool has_low = c > 0, has_high = c < g.size(axis);
    const double low = has_low ? phi(i - (axis == 0), j - (axis == 1), k - (axis == 2)) : 0.0,
                 high = has_high ? phi(i, j, k) : 0.0;
    return (low + high) / ((has_low + has_high) * g.dx);
  }

  // Largest component of the velocity on the faces of the cells beside a face, of every axis.
  double fastest(int axis, int i, int j, int k) const {
    double most = 0.0;
    for (int c = 0; c < 3; ++c)
      for (int side = 0; side < 4; ++side) {
        int at[3] = {i, j, k};
        at[axis] -= side & 1, at[c] += side >> 1;
        if (u[c].contains(at[0], at[1], at[2]))
          most = std::max(most, std::abs(u[c](at[0], at[1], at[2])));
      }
    return most;
  }

  double wet_share(int axis, int i, int j, int k) const {
    Axes x = {i + (axis == 0 ? 0.0 : 0.5), j + (axis == 1 ? 0.0 : 0.5), k + (axis == 2 ? 0.0 : 0.5),
              0.0};
    const double cells = h * std::abs(u[axis](i, j, k));
    const int times = std::clamp(static_cast<int>(std::ceil(kTimesPerCell * cells)), 2, kMostTimes);
    double sum = 0.0;
    for (int t = 0; t < times; ++t) {
      Axes v, back;
      sampler.at(x, v);
      sampler.trace(x, v, -(t == 0 ? 0.5 : 1.0) * h / times, back);
      x = back;
      sum += share_at(axis, x);
    }
    return sum / times;
  }

  // Wet share of the unit square across `axis` about x.
  double share_at(int axis, const Axes& x) const {
    double beyond = -INFINITY;  // outside an open side is air
    for (int side = 0; side < 6; ++side)
      if (open_side[side]) {
        const int a = side / 2;
        beyond = std::max(beyond, side % 2 ? x[a] - g.size(a) : -x[a]);
      }
    if (beyond > 0.0) return 0.0;
    Slot s[3];
    centres.clamp(x - 0.5, s);
    double c[8];
    levels.corners(levels.base(s[0], s[1], s[2]), c);
    const double value = trilinear(c, s) / g.dx;
    double slope[2];
    for (int n = 0; n < 2; ++n) slope[n] = std::abs(slope_along((axis + 1 + n) % 3, c, s)) / g.dx;
    return square_share(value, slope[0], slope[1]);
  }

  static double trilinear(const double c[8], const Slot s[3]) {
    double line[4];
    for (int n = 0; n < 4; ++n) line[n] = c[2 * n] + s[0].f * (c[2 * n + 1] - c[2 * n]);
    const double low = line[0] + s[1].f * (line[1] - line[0]),
                 high = line[2] + s[1].f * (line[3] - line[2]);
    return low + s[2].f * (high - low);
  }

  // Mean over the cell of the interpolation lattice of the difference along one axis: smooth where
  // the gradient of the interpolation jumps is not needed.
  static double slope_along(int axis, const double c[8], const Slot s[3]) {
    const int step = 1 << axis, p = axis == 0 ? 1 : 0, q = axis == 2 ? 1 : 2;
    double sum = 0.0;
    for (int n = 0; n < 4; ++n) {
      const int corner = (n & 1) * (1 << p) + (n >> 1) * (1 << q);
      const double weight = ((n & 1) ? s[p].f : 1.0 - s[p].f) * ((n >> 1) ? s[q].f : 1.0 - s[q].f);
      sum += weight * (c[corner + step] - c[corner]);
    }
    return sum;
  }

  const Grid& g;
  const MacField& u;
  const Array3<double>& phi;
  const FaceField<double>& open;
  const Sides& open_side;
  const double h;  // dt / dx, s/m
  MacSampler sampler;
  Lattice levels;
  LatticeEnds centres;
  double farthest = 0.0;  // from the surface that a face may be cut, cells
};

}  // namespace

double take_outflow(const Grid& g, const MacField& u, double dt, const Array3<double>& phi,
                    const FaceField<double>& open, const std::vector<FaceFlow>& beyond,
                    const Sides& open_side, Array3<double>& residual) {
  const Flow flow(g, u, dt, phi, open, open_side);
  std::vector<double> out(g.nz + 1, 0.0);  // through open sides, by plane of faces
  // What goes from the cell below face (i, j, k) to the one above.
  const auto move = [&](int axis, int i, int j, int k, double volume) {
    if (volume == 0.0) return;
    const int at[3] = {i, j, k};
    const bool has_low = at[axis] > 0, has_high = at[axis] < g.size(axis);
    if (has_low) residual(i - (axis == 0), j - (axis == 1), k - (axis == 2)) -= volume;
    if (has_high) residual(i, j, k) += volume;
    if (!has_low || !has_high) out[k] += has_high ? -volume : volume;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const Array3<double>& faces = u[axis];
    // Planes of faces across z share cells with the next: every other one at a time.
    const int stride = axis == 2 ? 2 : 1;
    for (int first = 0; first < stride; ++first)
#pragma omp parallel for schedule(dynamic)
      for (int k = first; k < faces.nz(); k += stride)
        for (int j = 0; j < faces.ny(); ++j)
          for (int i = 0; i < faces.nx(); ++i) move(axis, i, j, k, flow.through(axis, i, j, k));
  }
  for (const FaceFlow& f : beyond) {
    const Ijk c = unravel(u[f.axis], static_cast<int>(f.face));
    move(f.axis, c.i, c.j, c.k,
         flow.through(f.axis, c.i, c.j, c.k, f.beyond) - flow.through(f.axis, c.i, c.j, c.k));
  }
  double left = 0.0;
  for (const double plane : out) left += plane;
  return left * g.dx * g.dx * g.dx;
}

}  // namespace archetide
