#include "runtime/step_size.h"

#include <algorithm>
#include <cmath>

#include "runtime/driving_forces.h"
#include "runtime/fluid/advection.h"
#include "runtime/prescribed.h"
#include "runtime/statistics.h"

namespace archetide {
namespace {

// The largest dt with speed dt + g dt^2 <= way, s: what falls freely during the step counts as
// well.
double time_for(double way, double speed, double g) {
  return 2.0 * way / (speed + std::sqrt(speed * speed + 4.0 * g * way) + 1e-300);
}

// Whether only gravity acts on the body while it meets nothing.
bool only_gravity_acts(const SimulationState& s, std::size_t b) {
  const int n = static_cast<int>(b);
  const auto ties = [&](const Joint& j) { return j.a == n || j.b == n; };
  return s.obstacles.empty() && s.skins.empty() &&
         std::none_of(s.joints.begin(), s.joints.end(), ties) && !is_driven(s, b);
}

// Way down to the water, m.
double way_to_water(const ReducedBody& body, double water_top) {
  std::vector<Vec3> points;
  surface_points(body, points);
  double way = INFINITY;
  for (const Vec3& p : points) way = std::min(way, p[2] - water_top);
  return way;
}

// Way to the closest wall of a ball around x, m.
double way_to_walls(const SimulationOptions& o, const Vec3& x, double radius) {
  double way = INFINITY;
  for (int side = 0; side < 6; ++side) {
    if (o.open_side[side]) continue;
    const int axis = side / 2;
    const double gap = side % 2 == 0 ? x[axis] - o.grid.low()[axis] : o.grid.high()[axis] - x[axis];
    way = std::min(way, gap - radius);
  }
  return way;
}

// Half the way to the closest body that this one may touch, m: the other moves as well.
double way_to_bodies(const SimulationState& s, std::size_t b, double radius) {
  double way = INFINITY;
  for (std::size_t c = 0; s.body_contacts && c < s.bodies.size(); ++c) {
    if (c == b) continue;
    const double apart = (s.bodies[c].position - s.bodies[b].position).norm() - radius;
    way = std::min(way, 0.5 * (apart - farthest_point(s.bodies[c], s.reach[c])));
  }
  return way;
}

// How far body b may move in a step, m: so many cells as the CFL number says, and through air as
// far as it meets nothing: steps are for the water, which does not yet feel it [D19].
double largest_travel(const SimulationState& s, std::size_t b, double water_top) {
  constexpr double kClearance = 2.0;  // cells that are left
  const double dx = s.options.grid.dx, least = s.options.cfl * dx;
  const ReducedBody& body = s.bodies[b];
  if (body.prescribed) return least;
  const double radius = farthest_point(body, s.reach[b]);
  if (!only_gravity_acts(s, b) || body.position[2] + radius <= water_top) return least;
  const double way =
      std::min({way_to_water(body, water_top), way_to_walls(s.options, body.position, radius),
                way_to_bodies(s, b, radius)});
  return std::max(least, way - kClearance * dx);
}

// Nonlinear bodies keep their energy while they turn by no more than this in a step, rad [D54].
double time_to_turn(const SimulationState& s) {
  constexpr double kMostTurn = 0.35;
  double dt = INFINITY;
  for (const ReducedBody& body : s.bodies) {
    if (!body.is_nonlinear()) continue;
    const ConfigurationTerms terms =
        configuration_terms(body, current_configuration(body), s.options.modal.mass);
    dt = std::min(dt, kMostTurn / frame_spin(terms, body.L, body.q_dot).norm());
  }
  return dt;
}

// Acceleration by the external loads on body b, m/s^2.
double pushed(const SimulationState& s, std::size_t b) {
  Vec3 force = Vec3::Zero();
  for (const ExternalLoad& load : s.loads)
    if (load.body == static_cast<int>(b)) force += load.at(s.time()).force;
  return force.norm() / body_mass(s.bodies[b]);
}

// The longest step that brings body b no farther than `way` (m), at most `most` (s) looked at.
double body_step(const SimulationState& s, std::size_t b, double way, double most) {
  if (s.bodies[b].prescribed) return time_for(way, prescribed_speed(s, b, most), 0.0);
  return time_for(way, largest_surface_speed(s.bodies[b]), s.options.gravity.norm() + pushed(s, b));
}

}  // namespace

double stable_dt(const SimulationState& s) {
  const SimulationOptions& o = s.options;
  double dt = stable_with_springs(s, std::min(o.max_dt, time_to_turn(s)));
  if (!s.has_tank()) return dt;
  const double g = o.gravity.norm(), cells = o.cfl * o.grid.dx;
  const bool water = s.water.present();
  const double top = water ? s.water.top() : 0.0;
  for (std::size_t b = 0; b < s.bodies.size(); ++b)
    dt = std::min(dt, body_step(s, b, water ? largest_travel(s, b, top) : cells, o.max_dt));
  if (!water) return dt;
  for (const WaterSource& source : o.sources)
    if (source.pours(s.time())) dt = std::min(dt, time_for(cells, source.velocity.norm(), g));
  constexpr double kRange = 8.0;  // more than water that was slowed down in a like step can want
  dt = std::min(
      dt, time_for(cells, speed_of_most(s.water.fluid().u, s.water.valid(), o.outrun, kRange), g));
  // Waves of one cell, k = pi / dx: omega dt = sqrt(pi) < 2, the limit of the explicit surface.
  return g > 0.0 ? std::min(dt, std::sqrt(o.grid.dx / g)) : dt;
}

bool may_halve(const SimulationOptions& options, const StepReport& report, int most) {
  return options.on_fail != OnFail::kStop && report.halvings < most;
}

}  // namespace archetide
