#include "runtime/fluid/volume_flux.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/base/exception_carrier.h"
#include "runtime/fluid/advection.h"
#include "runtime/fluid/cell_list.h"
#include "runtime/fluid/level_set.h"
#include "runtime/fluid/sampling.h"
#include "runtime/fluid/tricubic.h"
#include "runtime/numerics/parallel.h"

namespace archetide {
namespace {

// Water that comes from farther above or below the surface than its way and this, cells, is all
// water or all air.
constexpr double kCut = 1.0;
constexpr double kTimesPerCell = 2.0;  // at which the wet share is evaluated
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
        levels(grid, level) {
    farthest = kCut + h * cfl_speed(u);
  }

  /// What a row of faces needs, one of each for a face.
  struct Row {
    explicit Row(int faces) : out(faces), level(faces), fastest(faces), cut(faces) {}
    std::vector<double> out;  // result
    std::vector<double> level, fastest;
    std::vector<unsigned char> cut;
  };

  /// Through the faces (0, j, k), (1, j, k), .. of `axis` upwards.
  void through_row(int axis, int j, int k, Row& row) const {
    const int count = u[axis].nx();
    double *out = row.out.data(), *level = row.level.data();
    unsigned char* cut = row.cut.data();
    level_of_row(axis, j, k, level);
    const double *v = &u[axis](0, j, k), *w = &open[axis](0, j, k);
    int near = 0;
#pragma omp simd reduction(| : near)
    for (int i = 0; i < count; ++i) {
      const double flow = h * (w[i] * v[i]);
      cut[i] = (flow != 0.0) & (std::abs(level[i]) <= farthest);
      near |= cut[i];
      out[i] = level[i] < 0.0 ? flow : 0.0;
    }
    if (!near) return;
    fastest_of_row(axis, j, k, row.fastest.data());
    for (int i = 0; i < count; ++i)
      if (cut[i] && std::abs(level[i]) <= kCut + h * row.fastest[i])
        out[i] = h * (w[i] * v[i]) * wet_share(axis, i, j, k);
  }

  /// The water in what flows through face (i, j, k) of `axis` upwards at `speed`, the mean of the
  /// whole face, m/s.
  double through(int axis, int i, int j, int k, double speed) const {
    const double flow = h * speed;
    if (flow == 0.0) return 0.0;
    const double level = at_face(axis, i, j, k);
    if (std::abs(level) > farthest || std::abs(level) > kCut + h * fastest(axis, i, j, k))
      return level < 0.0 ? flow : 0.0;
    return flow * wet_share(axis, i, j, k);
  }

 private:
  // at_face of a row.
  void level_of_row(int axis, int j, int k, double* level) const {
    const double* high = &phi(0, std::min(j, g.ny - 1), std::min(k, g.nz - 1));
    const double* low = &phi(0, std::max(j - (axis == 1), 0), std::max(k - (axis == 2), 0));
    const double to_mean = 0.5 / g.dx;
    if (axis != 0) {
#pragma omp simd
      for (int i = 0; i < g.nx; ++i) level[i] = to_mean * (low[i] + high[i]);
      return;
    }
#pragma omp simd
    for (int i = 1; i < g.nx; ++i) level[i] = to_mean * (low[i - 1] + high[i]);
    level[0] = high[0] / g.dx, level[g.nx] = high[g.nx - 1] / g.dx;
  }

  // Mean of phi / dx over the cells beside a face.
  double at_face(int axis, int i, int j, int k) const {
    const int c = axis == 0 ? i : axis == 1 ? j : k;
    const bool has_low = c > 0, has_high = c < g.size(axis);
    const double low = has_low ? phi(i - (axis == 0), j - (axis == 1), k - (axis == 2)) : 0.0,
                 high = has_high ? phi(i, j, k) : 0.0;
    return (low + high) / ((has_low + has_high) * g.dx);
  }

  // most = max(most, largest component of the velocity on the faces of a cell), of row (j, k) of
  // cells.
  void raise_to_fastest(int j, int k, double* most) const {
    const double *x = &u[0](0, j, k), *s = &u[1](0, j, k), *n = &u[1](0, j + 1, k),
                 *d = &u[2](0, j, k), *t = &u[2](0, j, k + 1);
    const int nx = g.nx;
#pragma omp simd
    for (int i = 0; i < nx; ++i) {
      const double along = std::max(std::abs(x[i]), std::abs(x[i + 1])),
                   across = std::max(std::abs(s[i]), std::abs(n[i])),
                   up = std::max(std::abs(d[i]), std::abs(t[i]));
      most[i] = std::max(std::max(most[i], along), std::max(across, up));
    }
  }

  // `fastest` of a row of faces.
  void fastest_of_row(int axis, int j, int k, double* most) const {
    std::fill_n(most, u[axis].nx(), 0.0);
    if (axis != 0) {
      const int at = axis == 1 ? j : k;
      if (at > 0) raise_to_fastest(j - (axis == 1), k - (axis == 2), most);
      if (at < g.size(axis)) raise_to_fastest(j, k, most);
      return;
    }
    raise_to_fastest(j, k, most);  // of cell i; its faces are i and i + 1
    double before = 0.0;
    for (int i = 0; i <= g.nx; ++i) {
      const double here = most[i];
      most[i] = std::max(before, here);
      before = here;
    }
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
    const int times = std::clamp(static_cast<int>(std::ceil(kTimesPerCell * cells)), 1, kMostTimes);
    double sum = 0.0;
    for (int t = 0; t < times; ++t) {
      Axes v, back;
      sampler.at(x, v);
      sampler.trace(x, v, -(t == 0 ? 0.5 : 1.0) * h / times, back);
      x = back;
      sum += share_at(axis, x, cells / times);
    }
    return sum / times;
  }

  // Wet share of the box about x, one cell wide and `way` cells long along `axis`: what comes
  // through a face meanwhile.
  double share_at(int axis, const Axes& x, double way) const {
    double beyond = -INFINITY;  // outside an open side is air
    for (int side = 0; side < 6; ++side)
      if (open_side[side]) {
        const int a = side / 2;
        beyond = std::max(beyond, side % 2 ? x[a] - g.size(a) : -x[a]);
      }
    if (beyond > 0.0) return 0.0;
    const double foot[3] = {x[0] - 0.5, x[1] - 0.5, x[2] - 0.5};
    constexpr double kFarthest = 1.2;  // from a surface that cuts the box, dx
    const double about = levels.at(x) / g.dx;
    if (std::abs(about) > kFarthest) return about < 0.0 ? 1.0 : 0.0;
    Vec3 slope;
    const double value = tricubic(phi, foot, slope) / g.dx;
    slope /= g.dx;
    slope[axis] *= way;
    return half_space_fraction(value, slope);
  }

  const Grid& g;
  const MacField& u;
  const Array3<double>& phi;
  const FaceField<double>& open;
  const Sides& open_side;
  const double h;  // dt / dx, s/m
  MacSampler sampler;
  CellSampler levels;
  double farthest = 0.0;  // from the surface that a face may be cut, cells
};

// Takes `volume` from the cell below face (i, j, k) and gives it to the one above; returns what
// leaves the grid.
double book(int axis, int i, int j, int k, double volume, Array3<double>& residual) {
  if (volume == 0.0) return 0.0;
  const int at[3] = {i, j, k};
  const int size[3] = {residual.nx(), residual.ny(), residual.nz()};
  const bool has_low = at[axis] > 0, has_high = at[axis] < size[axis];
  if (has_low) residual(i - (axis == 0), j - (axis == 1), k - (axis == 2)) -= volume;
  if (has_high) residual(i, j, k) += volume;
  return has_low && has_high ? 0.0 : has_high ? -volume : volume;
}

// The same through the faces (0, j, k), (1, j, k), .. of an axis.
double book_row(int axis, int j, int k, const double* volume, Array3<double>& residual) {
  const int nx = residual.nx();
  if (axis == 0) {
    double* cells = &residual(0, j, k);
#pragma omp simd
    for (int i = 0; i < nx; ++i) cells[i] = (cells[i] + volume[i]) - volume[i + 1];
    return volume[nx] - volume[0];
  }
  const int at = axis == 1 ? j : k, size = axis == 1 ? residual.ny() : residual.nz();
  if (at > 0) {
    double* low = &residual(0, j - (axis == 1), k - (axis == 2));
#pragma omp simd
    for (int i = 0; i < nx; ++i) low[i] -= volume[i];
  }
  if (at < size) {
    double* high = &residual(0, j, k);
#pragma omp simd
    for (int i = 0; i < nx; ++i) high[i] += volume[i];
  }
  if (at > 0 && at < size) return 0.0;
  const double sum = std::accumulate(volume, volume + nx, 0.0);
  return at == 0 ? -sum : sum;
}

}  // namespace

double take_outflow(const Grid& g, const MacField& u, double dt, const Array3<double>& phi,
                    const FaceField<double>& open, const std::vector<FaceFlow>& beyond,
                    const Sides& open_side, Array3<double>& residual) {
  const Flow flow(g, u, dt, phi, open, open_side);
  std::vector<double> out(g.nz + 1, 0.0);  // through open sides, by plane of faces
  for (int axis = 0; axis < 3; ++axis) {
    const Array3<double>& faces = u[axis];
    // Planes of faces across z share cells with the next: every other one at a time.
    const int stride = axis == 2 ? 2 : 1;
    for (int first = 0; first < stride; ++first) {
      ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic)
      for (int k = first; k < faces.nz(); k += stride)
        carrier.run([&] {
          Flow::Row row(faces.nx());
          for (int j = 0; j < faces.ny(); ++j) {
            flow.through_row(axis, j, k, row);
            out[k] += book_row(axis, j, k, row.out.data(), residual);
          }
        });
      carrier.rethrow();
    }
  }
  std::vector<double> volume(beyond.size());
  for_each_index(static_cast<int>(beyond.size()), true, [&](int n) {
    const FaceFlow& f = beyond[n];
    const Ijk c = unravel(u[f.axis], static_cast<int>(f.face));
    volume[n] = flow.through(f.axis, c.i, c.j, c.k, f.beyond);
  });
  for (std::size_t n = 0; n < beyond.size(); ++n) {
    const Ijk c = unravel(u[beyond[n].axis], static_cast<int>(beyond[n].face));
    out[c.k] += book(beyond[n].axis, c.i, c.j, c.k, volume[n], residual);
  }
  double left = 0.0;
  for (const double plane : out) left += plane;
  return left * g.dx * g.dx * g.dx;
}

}  // namespace archetide
