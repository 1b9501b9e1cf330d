#include "tests/support/coasting_cases.h"

#include <algorithm>
#include <cmath>

#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"
#include "tests/support/water_scene.h"

namespace archetide {

CoastResult coast(const CoastOptions& c) {
  constexpr double kRadius = 0.2;  // m
  const int cells = 5 * c.cells_per_radius;
  SimulationOptions o;
  o.grid = {cells, cells, cells, kRadius / c.cells_per_radius, Vec3::Zero()};
  o.has_water = true;
  o.gravity = Vec3::Zero();
  o.tolerance = 1e-10;
  o.scheme = c.scheme;
  o.body_contact = c.contact;
  TriMesh surface = volume_true_sphere(4, kRadius);
  for (Vec3& x : surface.vertices) x = x.cwiseProduct(c.axes);
  ReducedBody body = make_body(rigid_surface_archetype(surface, 500.0), 0);
  const Vec3 middle = 0.5 * (o.grid.low() + o.grid.high());
  body.position = middle + o.grid.dx * c.offset;
  const Vec3 v = c.speed * kRadius * Vec3(1.0, 0.4, -0.6).normalized();
  body.P = body_mass(body) * v;
  std::vector<ReducedBody> bodies = {body};
  if (c.contact) {  // a second one at rest in a corner
    ReducedBody other =
        make_body(rigid_surface_archetype(volume_true_sphere(3, 0.1 * kRadius), 1000.0), 0);
    other.position = o.grid.low() + Vec3::Constant(0.4 * kRadius);
    bodies.push_back(other);
  }
  Simulation s(o, water_to(o.grid, INFINITY), bodies, {});
  CoastResult r;
  double first = 0.0, before = 0.0, speed = 0.0;
  for (int n = 0; n <= c.steps; ++n) {
    const StepReport report = s.step(c.dt);
    const double energy = report.water_kinetic + report.body_kinetic;
    if (n == 0) {
      first = energy, speed = s.bodies()[0].P.norm();
    } else {
      r.worst_step = std::max(r.worst_step, std::abs(energy - before) / before);
    }
    before = energy;
  }
  r.change = before / first - 1.0;
  r.slowed = s.bodies()[0].P.norm() / speed - 1.0;
  return r;
}

}  // namespace archetide
