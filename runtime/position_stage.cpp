#include "runtime/position_stage.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact_setup.h"
#include "runtime/driving_forces.h"
#include "runtime/joint_closing.h"
#include "runtime/numerics/parallel.h"
#include "runtime/solid/nonlinear_motion.h"
#include "runtime/statistics.h"
#include "runtime/step_size.h"

namespace archetide {
namespace {

GroupContacts reachable_contacts(const SimulationState& s, double dt) {
  return s.body_contacts->reachable_contacts(s.bodies, largest_surface_speeds(s.bodies), dt);
}

// Whether the body, alone at its walls, may come to one within the step.
bool may_reach_wall(const SimulationState& s, std::size_t b, double dt) {
  if (s.body_contacts || !s.has_tank() || !s.options.wall_contact || s.bodies[b].prescribed)
    return false;
  const double speed = largest_surface_speed(s.bodies[b]) + s.options.gravity.norm() * dt;
  return !away_from_walls(s.bodies[b], s.reach[b], wall_options(s.options, dt), 2.0 * speed * dt);
}

// The way that a body goes on its first step, 6 + r: with the velocity that it has, and modes by
// their implicit rule but from balance: stiff ones hardly move, and nothing that rests.
VecX first_way(const SimulationState& s, const ReducedBody& body, const ConfigurationTerms& terms,
               double dt) {
  const ModalOptions& modal = s.options.modal;
  VecX y = generalised_velocity(body, terms);
  if (body.prescribed) y << body.prescribed->way, body.prescribed->turn;
  if (body.r > 0)
    y.tail(body.r) = generalised_mass(body, terms, dt, Stage::kPositionHalf, modal.step)
                         .modal_solve(modal_momentum(body, terms, body.q_dot));
  return y;
}

// Where bodies will be half way through the step if they go on as in the last one: the water's
// velocity in the middle of the step belongs to the walls as they stand then [D47]. Their momenta
// are no guide: an error in them would be met by water that it has moved, and kept up by it. Eq.
// S8b.
void guess_half_way(SimulationState& s, double dt) {
  s.half_way = s.bodies;
  const bool go_on = s.water.last_dt() >= 0.5 * dt;  // what closes gaps in a short step is fast
  for_each_large(s.half_way.size(), [&](std::size_t b) {
    ReducedBody& body = s.half_way[b];
    FreeMotion motion;
    motion.terms = configuration_terms(body, current_configuration(body), s.options.modal.mass);
    VecX y = go_on && body.last_way.size() > 0 && !body.prescribed
                 ? body.last_way
                 : first_way(s, body, motion.terms, dt);
    s.guard.shorten(body, 0.5 * dt, y);
    advance_pose(body, motion, y, 0.5 * dt);
  });
}

// The bodies as they enter the solve, with what drives them in the middle of the step.
// With cut cells the water meets them half way.
std::vector<StageBody> bodies_of_stage(SimulationState& s, double dt) {
  std::vector<Configuration> now;
  for (const ReducedBody& body : s.bodies) now.push_back(current_configuration(body));
  const std::vector<VecX> drive = driving_forces(s, dt, now, s.bodies);
  std::vector<StageBody> stage;
  for (std::size_t b = 0; b < s.bodies.size(); ++b)
    stage.push_back({&s.bodies[b], now[b], {}, may_reach_wall(s, b, dt), {}, {}, drive[b]});
  if (!s.water.present() || s.options.geometry != Geometry::kCutCell) return stage;
  guess_half_way(s, dt);
  for (std::size_t b = 0; b < s.bodies.size(); ++b) stage[b].met = &s.half_way[b];
  return stage;
}

// Modes that would close elements which stand at their limit are held there; true if there are any.
bool lock_modes(SimulationState& s, const std::vector<StageResult>& results,
                const ContactForces& pushes, double dt, std::vector<StageBody>& stage) {
  std::vector<char> pressed(s.bodies.size(), 0);
  for (const ContactForce& push : pushes)
    for (const int b : {push.a, push.b})
      if (b >= 0) pressed[b] = 1;
  for_each_large(s.bodies.size(), [&](std::size_t b) {
    stage[b].at.locked =
        s.guard.closing(s.bodies[b], results[b].motion, results[b].y, dt, pressed[b] != 0);
  });
  return std::any_of(stage.begin(), stage.end(),
                     [](const StageBody& body) { return body.at.locked.size() > 0; });
}

// What elastic forces that are linear about other rates than nonlinear bodies got leave out (S13b),
// of these rates: the largest. Where it is more than little the next solve's forces are linear about
// the rates of this one.
constexpr double kLittleRest = 0.05, kMostRest = 0.5;

double rates_to_linearise_about(const std::vector<StageResult>& results, double dt,
                                std::vector<StageBody>& stage) {
  std::vector<double> share(stage.size(), 0.0);
  for_each_large(stage.size(), [&](std::size_t b) {
    const ReducedBody& body = *stage[b].body;
    if (!body.is_nonlinear()) return;
    const FreeMotion& motion = results[b].motion;
    const VecX q_dot = results[b].y.tail(body.r),
               rest = rest_of_linear_force(body, motion, q_dot, dt);
    const auto energy = [&](const VecX& v) { return v.dot(motion.H.modal_product(v)); };
    const double all = energy(q_dot);
    if (all > 0.0) share[b] = std::sqrt(energy(rest) / all);
    if (share[b] > kLittleRest) stage[b].at.linear_about = q_dot;
  });
  return share.empty() ? 0.0 : *std::max_element(share.begin(), share.end());
}

// Eqs. 45 and 49 with h = dt/2; again while that helps to make forces of nonlinear bodies linear
// about the rates that come out [D74], and once more if modes are to be locked, so that the water
// meets modes that do not move. False if it does not converge, or leaves too much of these forces
// out.
bool solve_half_step(SimulationState& s, double dt, std::vector<StageBody>& stage,
                     GroupContacts& reachable, std::vector<StageResult>& results,
                     StepAttempt& attempt) {
  StepReport& report = attempt.report;
  constexpr int kMostSolves = 4;
  constexpr double kLess = 0.7;  // of the rest before
  const auto couple = [&] {
    report.position.add(s.coupling.couple(Stage::kPositionHalf, dt, s.water.surface_as_it_stands(),
                                          stage, s.water.half_velocity(), results,
                                          if_together(s, reachable), s.water.narrow_flow()));
    return report.position.converged || attempt.refuse(Refusal::kNotConverged);
  };
  const auto couple_again = [&] {
    s.water.restore_half();
    s.coupling.keep_loads();
    reachable.start = reachable.forces;
    return couple();
  };
  if (!couple()) return false;
  double rest = rates_to_linearise_about(results, dt, stage), before = INFINITY;
  int solves = 1;
  for (; rest > kLittleRest && rest < kLess * before && solves < kMostSolves; ++solves) {
    before = rest;
    if (!couple_again()) return false;
    rest = rates_to_linearise_about(results, dt, stage);
  }
  if (!(rest <= kMostRest)) {
    if (may_halve(s.options, report, kMostForEnergy)) return attempt.refuse(Refusal::kNotLinear);
    for (StageBody& body : stage) body.at.linear_about.resize(0);
    if (solves > 1 && !couple_again()) return false;
  }
  if (!lock_modes(s, results, reachable.forces, dt, stage)) return true;
  return couple_again();
}

// Jointed bodies that were stopped keep the shape that they have: a joint of several points cannot
// follow two shapes that change each for itself. False if they do so already.
bool halt_stopped(SimulationState& s, const std::vector<FreeMotion>& motions,
                  const std::vector<char>& stopped, const std::vector<VecX>& reaction, double dt,
                  std::vector<VecX>& y) {
  bool any = false;
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    const int r = s.bodies[b].r;
    if (!stopped[b] || reaction[b].size() == 0 || y[b].tail(r).isZero(0.0)) continue;
    s.guard.halt(static_cast<int>(b), s.bodies[b], motions[b], dt, y[b]);
    any = true;
  }
  return any;
}

// Velocities of the position update that leave no joint open and no element inside out. Bodies that
// are stopped keep their shape while the joints are closed again without it.
bool keep_bodies_whole(SimulationState& s, const std::vector<FreeMotion>& motions, double dt,
                       std::vector<VecX>& y, std::vector<VecX>& reaction, StepAttempt& attempt) {
  std::vector<char> stopped(s.bodies.size(), 0);
  for (bool again = true; again;) {
    if (!close_joints(s, motions, stopped, dt, y, reaction, attempt)) {
      if (!halt_stopped(s, motions, stopped, reaction, dt, y)) return false;
      continue;
    }
    again = false;
    std::vector<char> beyond(s.bodies.size(), 0);
    for_each_large(s.bodies.size(), [&](std::size_t b) {
      beyond[b] = !stopped[b] && s.guard.beyond(s.bodies[b], dt, y[b]);
    });
    for (std::size_t b = 0; b < s.bodies.size(); ++b)
      if (beyond[b] && s.guard.stop(static_cast<int>(b), s.bodies[b], motions[b], dt, y[b]))
        stopped[b] = 1, again = again || reaction[b].size() > 0;
  }
  return true;
}

// What the water meets of a body, at x^{n+1} - kReadBack (x^{n+1} - x^n), where the velocities
// stage reads its hydrostatic load [D38].
std::vector<Vec3> read_back(const std::vector<Vec3>& before, const ReducedBody& body) {
  std::vector<Vec3> points;
  wet_points(body, points);
  for (std::size_t v = 0; v < points.size(); ++v) points[v] += kReadBack * (before[v] - points[v]);
  return points;
}

// Modal force of what pushed a nonlinear body in the stage, beyond its free motion, r, N m.
VecX push_of_stage(const StageResult& result, double dt) {
  const auto r = result.y.size() - 6;
  return 2.0 / dt * result.motion.H.modal_product((result.y - result.motion.y_star).tail(r));
}

// x^{n+1} = x^n + dt v^{n+1/2} (S9). False if a joint stays open.
bool move_bodies(SimulationState& s, double dt, const std::vector<StageBody>& stage,
                 const std::vector<StageResult>& results, HalfStep& half, StepAttempt& attempt) {
  std::vector<VecX> y;
  std::vector<FreeMotion> motions;
  for (const StageResult& result : results) {
    y.push_back(result.y);
    motions.push_back(result.motion);
    half.held.push_back(result.contacts);
    half.reaction.push_back(result.joint_reaction);
  }
  if (!keep_bodies_whole(s, motions, dt, y, half.reaction, attempt)) return false;
  const std::size_t bodies = s.bodies.size();
  std::vector<std::vector<Vec3>> before(bodies);
  for_each_large(bodies, [&](std::size_t b) { wet_points(s.bodies[b], before[b]); });
  for (std::size_t b = 0; b < bodies; ++b) {
    s.bodies[b].last_way = y[b];
    if (results[b].motion.is_nonlinear()) s.bodies[b].last_push = push_of_stage(results[b], dt);
    half.middle.push_back(s.guard.advance(static_cast<int>(b), s.bodies[b], motions[b], y[b], dt,
                                          stage[b].at.locked));
  }
  half.read_points.resize(bodies);
  for_each_large(bodies,
                 [&](std::size_t b) { half.read_points[b] = read_back(before[b], s.bodies[b]); });
  return true;
}

}  // namespace

std::optional<HalfStep> advance_positions(SimulationState& s, double dt, StepAttempt& attempt) {
  HalfStep half;
  half.start = jointed_starts(s);
  if (s.body_contacts) {
    ScopedTimer search(s.profile, "contact");
    half.reachable = reachable_contacts(s, dt);
  }
  ScopedTimer timer(s.profile, "positions");
  s.water.advect_to_half(dt);  // Eq. 22
  std::vector<StageBody> stage = bodies_of_stage(s, dt);
  std::vector<StageResult> results;
  if (!solve_half_step(s, dt, stage, half.reachable, results, attempt)) return std::nullopt;
  if (s.body_contacts) {
    timer.hand_over("contact", s.coupling.contact_seconds());
    s.body_contacts->memory.position = half.reachable.forces;
    attempt.report.contact_sweeps += half.reachable.sweeps;
  }
  s.water.after_position_solve(dt, s.coupling);
  if (!move_bodies(s, dt, stage, results, half, attempt)) return std::nullopt;
  return half;
}

}  // namespace archetide
