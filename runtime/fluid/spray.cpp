#include "runtime/fluid/spray.h"

#include <algorithm>
#include <numeric>

#include "runtime/fluid/cell_list.h"
#include "runtime/fluid/sampling.h"

namespace archetide {
namespace {

constexpr double kAway = 1.0;   // from the surface, dx
constexpr double kSolid = 0.5;  // a cell more solid than this holds no drop
constexpr double kFarFromWater = 3.0, kLeastDrop = 0.02;  // dx, dx^3

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
                     Array3<double>& residual, Spray& spray) {
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
      residual[cell_of(g, x)] -= 1.0 / per_cell;
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

void release_fragments(const Grid& g, const Array3<double>& phi, const MacField& u,
                       const Array3<double>& solid_fraction, Array3<double>& residual,
                       Spray& spray) {
  const std::vector<int> cells = collect_cells(residual, [&](int, int, int, int n) {
    return residual[n] > kLeastDrop && phi[n] > kFarFromWater * g.dx && solid_fraction[n] < kSolid;
  });
  for (const int n : cells) {
    const Ijk c = unravel(residual, n);
    const Vec3 x = g.cell_centre(c.i, c.j, c.k);
    spray.position.push_back(x);
    spray.velocity.push_back(interpolate(g, u, x));
    spray.volume.push_back(residual[n] * g.dx * g.dx * g.dx);
    residual[n] = 0.0;
  }
}

SprayEnds fly_spray(const Grid& tank, const Sides& open_side, const Vec3& gravity, double dt,
                    const Array3<double>& phi, const Array3<double>& solid_fraction,
                    Array3<double>& residual, Spray& spray) {
  Grid fields = tank;
  fields.nz = phi.nz();
  SprayEnds ends;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < spray.size(); ++t) {
    Vec3 &x = spray.position[t], &v = spray.velocity[t];
    const Vec3 start = x;
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
    if (x[2] < fields.high()[2]) {
      const int cell = cell_of(fields, x);
      if (interpolate(fields, phi, x) < 0.0 && solid_fraction[cell] < kSolid) {
        ends.landed += spray.volume[t];
        ends.landings.push_back({x, v, spray.volume[t]});
        residual[cell] += spray.volume[t] / (tank.dx * tank.dx * tank.dx);
        continue;
      }
      if (solid_fraction[cell] >= kSolid) {  // along the wall, from where it was
        const Vec3 n = interpolate_gradient(fields, solid_fraction, x).stableNormalized();
        x = start;
        v -= std::max(v.dot(n), 0.0) * n;
      }
    }
    move_drop(spray, t, kept++);
  }
  shorten(spray, kept);
  return ends;
}

void take_up_momentum(const Grid& g, const std::vector<Landing>& landings,
                      const Array3<double>& held, MacField& u) {
  constexpr double kLeast = 0.25;  // dx^3
  for (const Landing& drop : landings) {
    const double volume = drop.volume / (g.dx * g.dx * g.dx);
    for (int axis = 0; axis < 3; ++axis) {
      Array3<double>& faces = u[axis];
      const double gain =
          volume * (drop.velocity[axis] - interpolate_component(g, u, axis, drop.position));
      const int size[3] = {faces.nx(), faces.ny(), faces.nz()};
      Slot s[3];
      for (int a = 0; a < 3; ++a)
        s[a] = clamped_slot((drop.position[a] - g.origin[a]) / g.dx - (a == axis ? 0.0 : 0.5),
                            size[a]);
      for (int corner = 0; corner < 8; ++corner) {
        double weight = 1.0;
        Vec3i f;
        for (int a = 0; a < 3; ++a) {
          const int up = (corner >> a) & 1;
          f[a] = std::min(s[a].i + up, size[a] - 1);
          weight *= up ? s[a].f : 1.0 - s[a].f;
        }
        // Sides of the tank keep their velocity: what they get is the wall's.
        if (weight == 0.0 || f[axis] == 0 || f[axis] == g.size(axis)) continue;
        Vec3i below = f;
        --below[axis];
        const double mass = 0.5 * (held(f[0], f[1], f[2]) + held(below[0], below[1], below[2]));
        faces(f[0], f[1], f[2]) += weight * gain / std::max(mass, kLeast);
      }
    }
  }
}

SprayMotion spray_motion(const Spray& spray, const Vec3& gravity) {
  SprayMotion sum;
  for (std::size_t t = 0; t < spray.size(); ++t) {
    sum.momentum += spray.volume[t] * spray.velocity[t];
    sum.angular_momentum += spray.volume[t] * spray.position[t].cross(spray.velocity[t]);
    sum.moment += spray.volume[t] * spray.position[t];
    sum.kinetic += 0.5 * spray.volume[t] * spray.velocity[t].squaredNorm();
    sum.potential -= spray.volume[t] * gravity.dot(spray.position[t]);
  }
  return sum;
}

double spray_volume(const Spray& spray) {
  return std::accumulate(spray.volume.begin(), spray.volume.end(), 0.0);
}

}  // namespace archetide
