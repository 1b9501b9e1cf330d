#include "runtime/fluid/water_source.h"

#include <algorithm>
#include <cmath>

#include "runtime/fluid/surface_refit.h"

namespace archetide {
namespace {

constexpr int kAround = 2;  // cells in which a source changes what they hold

// Points of a lattice (cell centres, or the faces of an axis) in and around a source.
struct Range {
  Vec3i low, high;  // [low, high)
};

Range around(const Grid& g, const WaterSource& source, int margin, const Vec3i& size) {
  const Vec3 first = (source.low - g.origin) / g.dx, last = (source.high - g.origin) / g.dx;
  Range r;
  for (int a = 0; a < 3; ++a) {
    r.low[a] = static_cast<int>(std::clamp(std::floor(first[a]) - margin, 0.0, double(size[a])));
    r.high[a] =
        static_cast<int>(std::clamp(std::ceil(last[a]) + margin + 1.0, 0.0, double(size[a])));
  }
  return r;
}

template <class F>
void for_each_in(const Range& r, F&& f) {
  for (int k = r.low[2]; k < r.high[2]; ++k)
    for (int j = r.low[1]; j < r.high[1]; ++j)
      for (int i = r.low[0]; i < r.high[0]; ++i) f(i, j, k);
}

void set_velocity_in(const Grid& g, const WaterSource& source, const std::vector<MacField*>& fields,
                     FaceField<unsigned char>& valid) {
  for (int a = 0; a < 3; ++a) {
    const Vec3i size(valid[a].nx(), valid[a].ny(), valid[a].nz());
    for_each_in(around(g, source, 1, size), [&](int i, int j, int k) {
      if (source.distance(g.face_centre(a, i, j, k)) > 0.0) return;
      for (MacField* u : fields) (*u)[a](i, j, k) = source.velocity[a];
      valid[a](i, j, k) = 1;
    });
  }
}

}  // namespace

double WaterSource::distance(const Vec3& x) const {
  if (ball) return (x - 0.5 * (low + high)).norm() - 0.5 * (high - low)[0];
  const Vec3 outside = (low - x).cwiseMax(x - high);
  return outside.cwiseMax(0.0).norm() + std::min(outside.maxCoeff(), 0.0);
}

FilledSource fill_source(const Grid& g, const WaterSource& source, const Array3<double>& solid,
                         Array3<double>& phi, Array3<double>& held,
                         const std::vector<MacField*>& fields, FaceField<unsigned char>& valid) {
  constexpr int kBand = 10;  // cells, as far as a level set is one of distances
  const double cell = g.dx * g.dx * g.dx;
  const Vec3i size(g.nx, g.ny, g.nz);
  for_each_in(around(g, source, kBand, size), [&](int i, int j, int k) {
    double& here = phi(i, j, k);
    here = std::min(here, source.distance(g.cell_centre(i, j, k)));
  });
  FilledSource came;
  for_each_in(around(g, source, kAround, size), [&](int i, int j, int k) {
    const std::size_t n = held.index(i, j, k);
    const double now = held_by_surface(g, phi, solid, i, j, k, n), more = cell * (now - held[n]);
    came.volume += more, came.moment += more * g.cell_centre(i, j, k);
    held[n] = now;
  });
  set_velocity_in(g, source, fields, valid);
  return came;
}

void forget_around(const Grid& g, const WaterSource& source, int cells,
                   FaceField<unsigned char>& marks) {
  for (int a = 0; a < 3; ++a) {
    const Vec3i size(marks[a].nx(), marks[a].ny(), marks[a].nz());
    for_each_in(around(g, source, cells, size),
                [&](int i, int j, int k) { marks[a](i, j, k) = 0; });
  }
}

HeldMotion held_motion(const Grid& g, const Array3<double>& held, const MacField& u) {
  std::vector<HeldMotion> planes(g.nz + 1);
  const double cell = g.dx * g.dx * g.dx;
#pragma omp parallel for schedule(static)
  for (int k = 0; k <= g.nz; ++k)
    for (int a = 0; a < 3; ++a) {
      if (k >= u[a].nz()) continue;
      HeldMotion& sum = planes[k];
      for (int j = 0; j < u[a].ny(); ++j)
        for (int i = 0; i < u[a].nx(); ++i) {
          const double speed = u[a](i, j, k);
          if (speed == 0.0) continue;
          const Vec3i low = Vec3i(i, j, k) - Vec3i::Unit(a);
          double mass = held.contains(i, j, k) ? held(i, j, k) : 0.0;
          if (held.contains(low[0], low[1], low[2])) mass += held(low[0], low[1], low[2]);
          const double carried = 0.5 * cell * mass * speed;
          sum.P[a] += carried;
          sum.L += carried * g.face_centre(a, i, j, k).cross(Vec3(Vec3::Unit(a)));
          sum.kinetic += 0.5 * carried * speed;
        }
    }
  HeldMotion total;
  for (const HeldMotion& plane : planes)
    total.P += plane.P, total.L += plane.L, total.kinetic += plane.kinetic;
  return total;
}

}  // namespace archetide
