#include "runtime/fluid/spray.h"

#include <algorithm>
#include <numeric>

#include "runtime/fluid/cell_list.h"

namespace archetide {
namespace {

constexpr double kAway = 1.0;  // from the surface, dx

// Moves entry `from` to `to` of every list.
void move_drop(Spray& s, std::size_t from, std::size_t to) {
  s.position[to] = s.position[from], s.velocity[to] = s.velocity[from];
  s.volume[to] = s.volume[from];
}

void shorten(Spray& s, std::size_t n) {
  s.position.resize(n), s.velocity.resize(n), s.volume.resize(n);
}

}  // namespace

double release_spray(const Grid& g, const Array3<double>& phi, const MacField& u,
                     const Array3<unsigned char>& solid, int per_cell, Particles& particles,
                     Spray& spray) {
  const double drop = g.dx * g.dx * g.dx / per_cell;
  std::vector<char> away(particles.size());
  bool any = false;
#pragma omp parallel for reduction(|| : any)
  for (std::size_t t = 0; t < particles.size(); ++t) {
    const Vec3& x = particles.position[t];
    away[t] = particles.sign[t] < 0 && interpolate(g, phi, x) >= kAway * g.dx &&
              (solid.size() == 0 || !solid[cell_of(g, x)]);
    any = any || away[t];
  }
  if (!any) return 0.0;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < particles.size(); ++t) {
    const Vec3& x = particles.position[t];
    if (away[t]) {
      spray.position.push_back(x);
      spray.velocity.push_back(interpolate(g, u, x));
      spray.volume.push_back(drop);
      continue;
    }
    particles.position[kept] = x;
    particles.radius[kept] = particles.radius[t], particles.sign[kept] = particles.sign[t];
    ++kept;
  }
  const double volume = drop * static_cast<double>(particles.size() - kept);
  particles.position.resize(kept), particles.radius.resize(kept), particles.sign.resize(kept);
  return volume;
}

SprayEnds fly_spray(const Grid& tank, const Sides& open_side, const Vec3& gravity, double dt,
                    const Array3<double>& phi, const Array3<unsigned char>& solid, Spray& spray) {
  Grid fields = tank;
  fields.nz = phi.nz();
  SprayEnds ends;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < spray.size(); ++t) {
    Vec3 &x = spray.position[t], &v = spray.velocity[t];
    x += dt * (v + 0.5 * dt * gravity);
    v += dt * gravity;
    bool gone = false;
    for (int side = 0; side < 6 && !gone; ++side) {
      const int a = side / 2;
      const double sign = side % 2 ? 1.0 : -1.0, end = side % 2 ? tank.high()[a] : tank.low()[a];
      if (sign * (x[a] - end) <= 0.0) continue;
      gone = open_side[side];
      x[a] = end;
      if (sign * v[a] > 0.0) v[a] = 0.0;
    }
    if (gone) {
      ends.left += spray.volume[t];
      continue;
    }
    if (x[2] < fields.high()[2] &&
        (interpolate(fields, phi, x) < 0.0 || (solid.size() != 0 && solid[cell_of(fields, x)]))) {
      ends.landed += spray.volume[t];
      continue;
    }
    move_drop(spray, t, kept++);
  }
  shorten(spray, kept);
  return ends;
}

double spray_volume(const Spray& spray) {
  return std::accumulate(spray.volume.begin(), spray.volume.end(), 0.0);
}

}  // namespace archetide
