#include "runtime/velocity_stage.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "runtime/contact/keep_apart.h"
#include "runtime/joint_closing.h"
#include "runtime/prescribed.h"
#include "runtime/solid/nonlinear_motion.h"
#include "runtime/step_size.h"
#include "runtime/thrown_bodies.h"

namespace archetide {
namespace {

// The flow u^{n+1/2} carries the surface to x^{n+1}; u* there.
void move_water(SimulationState& s, double dt, const std::vector<StageBody>& stage) {
  if (!s.water.present()) return;
  {
    ScopedTimer timer(s.profile, "surface");
    s.water.let_flow(dt, s.coupling);
    s.coupling.prepare_geometry(stage);
    s.water.move_surface(dt, s.coupling, s.step_count);
  }
  ScopedTimer timer(s.profile, "advection");
  s.water.advect_to_end(dt);
}

// f · (yⁿ + yⁿ⁺¹)/2 of what drives a body, W; modes of a held one by the way that they went.
double power_of_drive(const SimulationState& s, std::size_t b, const VecX& f,
                      const Configuration& middle, const StageResult& result) {
  const ReducedBody& body = s.bodies[b];
  VecX mean = 0.5 * (generalised_velocity(body, result.motion.terms) + result.y);
  if (s.guard.holds(static_cast<int>(b))) mean.tail(body.r) = middle.q_dot;
  return f.dot(mean);
}

// Impulse of water and contacts on a body.
VecX given_in_stage(const StageResult& result) {
  if (result.reaction.size() == 0) return result.water_impulse;
  return result.water_impulse + result.reaction;
}

// P, L and q̇ of n+1 (S12).
void accept(const StageResult& result, ReducedBody& body) {
  accept_velocity(body, result.y, result.delta_P, result.delta_L);
}

// What a body that ends the step with the shape q has less than its energy of n and the work done on
// it, J.
double energy_lost(const SimulationState& s, const ReducedBody& before, const ReducedBody& now,
                   const Configuration& middle, const StageResult& result, const VecX& drive,
                   const VecX& q, double dt) {
  const auto energy = [](const ReducedBody& b) { return kinetic_energy(b) + elastic_energy(b); };
  const VecX mean = 0.5 * (generalised_velocity(now, result.motion.terms) + result.y);
  ReducedBody after = now;
  accept(result, after);
  after.q = q;
  double work = mean.dot(result.water_impulse) +
                body_mass(now) * s.options.gravity.dot(now.position - before.position);
  if (drive.size() > 0) work += dt * drive.dot(mean);
  const VecX followed =
      impulse_of_following_load(now, middle, result.motion, result.y.tail(now.r), dt);
  if (followed.size() > 0) work += followed.dot(mean.tail(now.r));
  return energy(before) + work - energy(after);
}

// The shapes of nonlinear bodies at n+1 (S15), as far as contact lets them (S15a); `lost`: energy of
// these bodies in the step, J. False if energy forces them deeper into each other than a step may
// bring them.
bool bend(const HalfStep& half, double lost, std::vector<VecX>& q, SimulationState& s) {
  constexpr double kSlack = 0.1;    // cells: less is taken back by the position stage
  constexpr double kDeeper = 0.25;  // cells, as BodyContacts::sank_deeper has it
  double deeper = 0.0;
  if (s.body_contacts)
    deeper = keep_apart(s.bodies, half.touching, kSlack * s.options.grid.dx,
                        std::min(half.lost_in_contact, lost), q);
  for (std::size_t b = 0; b < s.bodies.size(); ++b)
    if (q[b].size() > 0) s.bodies[b].q = q[b];
  return deeper <= kDeeper * s.options.grid.dx;
}

// The same with all joints closed: those that hold such a body have to be closed again.
bool bend_and_close(const HalfStep& half, double lost, std::vector<VecX>& q,
                    std::vector<StageResult>& results, double dt, SimulationState& s) {
  bool opened = false;
  std::vector<FreeMotion> motions;
  std::vector<VecX> closed;  // shapes that closed them
  std::vector<char> stiff;
  for (std::size_t b = 0; b < s.bodies.size(); ++b)
    opened = opened || (q[b].size() > 0 && half.reaction[b].size() > 0);
  for (std::size_t b = 0; opened && b < s.bodies.size(); ++b) {
    closed.push_back(half.reaction[b].size() > 0 ? s.bodies[b].q : VecX());
    motions.push_back(std::move(results[b].motion));
    stiff.push_back(q[b].size() == 0);
  }
  const bool apart = bend(half, lost, q, s);
  if (!opened || seat_joints(s, motions, stiff, dt, s.bodies)) return apart;
  for (std::size_t b = 0; b < s.bodies.size(); ++b)
    if (closed[b].size() > 0) s.bodies[b].q = closed[b];
  return apart;
}

// What the water gave.
void book_water_impulse(SimulationState& s, std::size_t b, const StageResult& result) {
  const Vec3 force = result.water_impulse.head<3>(), torque = result.water_impulse.segment<3>(3);
  const Impulse given = impulse_at(s.bodies[b].position, force, torque);
  if (s.bodies[b].prescribed)
    s.budget.add_solid_impulse(given);
  else
    s.budget.add_water_impulse(given);
  s.water_impulse[b] += force;
  s.water_angular_impulse[b] += torque;
}

// q^{n+1} of a nonlinear body (S15); empty: of others, and where one solve a step moves the bodies
// itself.
VecX shape_after(const SimulationState& s, const StageBody& in, const StageResult& out, double dt) {
  if (!in.body->is_nonlinear() || s.options.scheme != Scheme::kNewmark) return {};
  return corrected_modes(*in.body, in.at, out.y.tail(in.body->r), dt);
}

// What the forces of nonlinear bodies, linear about other rates than these had in the end, have made
// or taken (S15b), of the energy that the body has then: the largest.
struct EnergyMade {
  double share = 0.0;
  bool hopeless = false;  // so much that other rates will not mend it
};
constexpr double kLittle = 5e-3, kMost = 0.2;  // of that energy

// Where it is more than little the next solve's forces are linear about the mean rates of this one.
EnergyMade linearise_again(const SimulationState& s, const std::vector<StageResult>& results,
                           double dt, std::vector<StageBody>& stage) {
  constexpr double kHopeless = 10.0;  // of the energy at the start of the stage
  EnergyMade most;
  for (std::size_t b = 0; b < stage.size(); ++b) {
    const ReducedBody& body = *stage[b].body;
    const StageResult& out = results[b];
    if (!body.is_nonlinear()) continue;
    const VecX q = shape_after(s, stage[b], out, dt), q_dot = out.y.tail(body.r);
    if (q.size() == 0) continue;
    const ConfigurationTerms& terms = out.motion.terms;
    const double made =
        std::abs(energy_of_linear_force(body, stage[b].at, out.motion, q_dot, q, dt));
    const double end = kinetic_energy(body, terms, out.y) + elastic_energy(body, q);
    if (made <= kLittle * end) continue;
    const double start = kinetic_energy(body, terms, generalised_velocity(body, terms)) +
                         elastic_energy(body, 2.0 * stage[b].at.q - body.q);
    if (!(made <= kMost * end) && !(made <= kHopeless * start)) most.hopeless = true;
    most.share = std::max(most.share, made / end);
    stage[b].at.linear_about = 0.5 * (body.q_dot + q_dot);
  }
  return most;
}

// Eqs. 45 and 49 with h = dt; again while that helps to make forces of nonlinear bodies linear about
// other rates [D70]. False if it does not converge, or these forces make too much in the end.
bool solve_full_step(SimulationState& s, double dt, std::vector<StageBody>& stage,
                     GroupContacts& touching, std::vector<StageResult>& results,
                     StepAttempt& attempt) {
  StepReport& report = attempt.report;
  constexpr int kMostSolves = 4;
  constexpr double kLess = 0.7;  // of the share before
  const auto couple = [&] {
    report.velocity.add(s.coupling.couple(
        Stage::kVelocityFull, dt, s.water.surface_now(dt), stage, s.water.full_velocity(), results,
        if_together(s, touching), s.water.narrow_flow(), &s.water.held()));
    return report.velocity.converged || attempt.refuse(Refusal::kNotConverged);
  };
  const auto couple_again = [&] {
    s.water.restore_full();
    s.coupling.keep_loads();
    touching.start = touching.forces;
    return couple();
  };
  const bool nonlinear = std::any_of(s.bodies.begin(), s.bodies.end(),
                                     [](const ReducedBody& body) { return body.is_nonlinear(); });
  if (!nonlinear) return couple();

  s.water.keep_full();
  if (!couple()) return false;
  EnergyMade made = linearise_again(s, results, dt, stage);
  int solves = 1;
  for (double before = INFINITY; made.share > kLittle && made.share < kLess * before &&
                                 !made.hopeless && solves < kMostSolves;
       ++solves) {
    before = made.share;
    if (!couple_again()) return false;
    made = linearise_again(s, results, dt, stage);
  }
  if (made.share <= kMost && !made.hopeless) return true;
  const bool halve = may_halve(s.options, report, kMostForEnergy);
  if (!halve && solves == 1) return true;
  s.coupling.forget_guess(Stage::kVelocityFull);
  if (halve) return attempt.refuse(Refusal::kNotLinear);
  for (StageBody& body : stage) body.at.linear_about.resize(0);
  return couple_again();
}

bool at_rest(const ReducedBody& body) {
  return body.P.isZero(0.0) && body.L.isZero(0.0) && body.q_dot.isZero(0.0);
}

bool anything_moves(const SimulationState& s) {
  const auto flows = [](const Array3<double>& u) {
    return std::any_of(u.data(), u.data() + u.size(), [](double v) { return v != 0.0; });
  };
  return !std::all_of(s.bodies.begin(), s.bodies.end(), at_rest) ||
         std::any_of(std::begin(s.water.fluid().u.axis), std::end(s.water.fluid().u.axis), flows);
}

}  // namespace

void meet_at_start(SimulationState& s, double dt) {
  if (!s.water.present() || !anything_moves(s)) return;
  ScopedTimer timer(s.profile, "velocities");
  constexpr double kInstant = 1e-6;  // of a step: gravity does nothing
  constexpr double kImpact = 0.1;    // of a step: modes that are slower than this are free
  const double h = kInstant * dt;
  std::vector<StageBody> stage;
  for (const ReducedBody& body : s.bodies) {
    stage.push_back({&body, current_configuration(body), {}, false, {}, {}, {}});
    stage.back().at.impact_step = kImpact * dt;
  }
  s.water.start_with_given_velocity();
  std::vector<StageResult> results;
  const SolveReport report =
      s.coupling.couple(Stage::kVelocityFull, h, s.water.surface_as_it_stands(), stage,
                        s.water.full_velocity(), results, nullptr, {}, &s.water.held());
  if (!report.converged) return;
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    accept(results[b], s.bodies[b]);
    book_water_impulse(s, b, results[b]);
  }
  s.coupling.accept_velocities();
  s.budget.start_from(s.coupling.motion_after());
  s.water.after_velocity_solve(dt, s.coupling);
}

bool advance_velocities(SimulationState& s, const std::vector<ReducedBody>& before, double dt,
                        HalfStep& half, const std::vector<VecX>& drive, StepAttempt& attempt) {
  StepReport& report = attempt.report;
  std::vector<StageBody> stage;
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    stage.push_back({&s.bodies[b], half.middle[b], half.read_points[b], false, half.held[b],
                     half.reaction[b], drive[b]});
    stage.back().returns_flux = s.bodies[b].r > 0 && s.options.scheme == Scheme::kNewmark;
  }
  move_water(s, dt, stage);
  ScopedTimer timer(s.profile, "velocities");
  std::vector<StageResult> results;
  if (!solve_full_step(s, dt, stage, half.touching, results, attempt)) return false;
  if (may_halve(s.options, report, kMostForEnergy) &&
      joints_drive(s, half.start, half.reaction, results))
    return attempt.refuse(Refusal::kJointWork);
  double work = half.work_in_contact, lost = 0.0;
  std::vector<VecX> bent(s.bodies.size());  // q^{n+1} of nonlinear bodies
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    ReducedBody& body = s.bodies[b];
    // one solve a step counts the work where it moves the bodies
    if (drive[b].size() > 0 && s.options.scheme == Scheme::kNewmark)
      work += dt * power_of_drive(s, b, drive[b], half.middle[b], results[b]);
    if (body.prescribed)
      work += work_of_prescribed(before[b], *body.prescribed, given_in_stage(results[b]));
    bent[b] = shape_after(s, stage[b], results[b], dt);
    if (s.body_contacts && bent[b].size() > 0)
      lost += energy_lost(s, before[b], body, stage[b].at, results[b], drive[b], bent[b], dt);
    accept(results[b], body);
  }
  if (!bend_and_close(half, lost, bent, results, dt, s) &&
      may_halve(s.options, report, kMostForOverlap))
    return attempt.refuse(Refusal::kSank);
  const bool dry = std::all_of(results.begin(), results.end(), [](const StageResult& body) {
    return body.water_impulse.isZero(0.0);
  });
  report.thrown = bodies_are_thrown(s, before, report, dry, dt);
  if (report.thrown && may_halve(s.options, report, kMostForEnergy))
    return attempt.refuse(Refusal::kThrown);

  // From here on the step is taken.
  if (s.body_contacts) {
    timer.hand_over("contact", s.coupling.contact_seconds());
    s.body_contacts->memory.velocity = half.touching.forces;
    report.contact_sweeps += half.touching.sweeps;
  }
  s.actuation_work += work;
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    book_water_impulse(s, b, results[b]);
    if (drive[b].size() > 0)
      s.budget.add_external(
          impulse_at(s.bodies[b].position, dt * drive[b].head<3>(), dt * drive[b].segment<3>(3)));
  }
  s.coupling.accept_velocities();
  s.water.after_velocity_solve(dt, s.coupling);
  report.divergence = s.coupling.last_divergence();
  return true;
}

}  // namespace archetide
