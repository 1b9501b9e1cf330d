#include "runtime/single_solve.h"

#include "runtime/contact_stage.h"
#include "runtime/driving_forces.h"
#include "runtime/velocity_stage.h"

namespace archetide {
namespace {

// Before the solve: bodies move on with the velocity that they have, modes by their own implicit
// half step, so that stiff ones stay bounded. The water's surface moves with u^n.
HalfStep predict_positions(SimulationState& s, double dt) {
  s.water.start_single();
  HalfStep half;
  half.read_points.resize(s.bodies.size());
  half.held.resize(s.bodies.size());
  half.reaction.resize(s.bodies.size());
  std::vector<Configuration> now;
  for (const ReducedBody& body : s.bodies) now.push_back(current_configuration(body));
  const std::vector<VecX> drive = driving_forces(s, dt, now, s.bodies);
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    ReducedBody& body = s.bodies[b];
    const VecX force = drive[b].size() > 0 ? drive[b] : VecX(VecX::Zero(body.dofs()));
    const FreeMotion motion =
        free_motion(body, now[b], force, dt, Stage::kPositionHalf, s.options.modal);
    VecX y = motion.y_star;
    s.guard.stop(static_cast<int>(b), body, motion, dt, y);
    half.middle.push_back(s.guard.advance(static_cast<int>(b), body, motion, y, dt));
  }
  return half;
}

// After the solve: `moved` takes the step again from x^n with the mean of old and new velocity
// (trapezoid), or the new one (backward Euler), the rule that the velocities were solved with.
void move_again(SimulationState& s, std::size_t b, double dt, ReducedBody& moved) {
  const ModalOptions& modal = s.options.modal;
  const ReducedBody& body = s.bodies[b];
  const ConfigurationTerms terms_n =
      configuration_terms(moved, current_configuration(moved), modal.mass);
  const ConfigurationTerms terms =
      configuration_terms(body, current_configuration(body), modal.mass);
  VecX y = generalised_velocity(body, terms);
  if (modal.step == ModalStep::kTrapezoid) y = 0.5 * (y + generalised_velocity(moved, terms_n));
  FreeMotion motion;
  motion.terms = terms_n;
  motion.H = generalised_mass(moved, terms_n, dt, Stage::kVelocityFull, modal.step);
  s.guard.stop(static_cast<int>(b), moved, motion, dt, y);
  s.guard.advance(static_cast<int>(b), moved, motion, y, dt);
}

// Of the centre of mass, the rotation vector and the modes, 6 + r.
VecX way_between(const ReducedBody& from, const ReducedBody& to) {
  VecX way(from.dofs());
  const Eigen::AngleAxisd turn(to.rotation * from.rotation.conjugate());
  way << to.position - from.position, turn.angle() * turn.axis(), to.q - from.q;
  return way;
}

void correct_positions(SimulationState& s, double dt, const std::vector<ReducedBody>& start,
                       const std::vector<VecX>& drive) {
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    ReducedBody moved = start[b];
    move_again(s, b, dt, moved);
    s.bodies[b].position = moved.position;
    s.bodies[b].rotation = moved.rotation;
    if (drive[b].size() > 0) s.actuation_work += drive[b].dot(way_between(start[b], moved));
    s.bodies[b].q = moved.q;
  }
}

}  // namespace

bool step_with_one_solve(SimulationState& s, double dt, StepAttempt& attempt) {
  const std::vector<ReducedBody> start = s.bodies;
  HalfStep half = predict_positions(s, dt);
  resolve_contact(s, dt, half, attempt.report);
  const std::vector<VecX> drive = driving_forces(s, dt, half.middle, start);
  if (!advance_velocities(s, start, dt, half, drive, attempt)) return false;
  s.last_solved = s.bodies;
  correct_positions(s, dt, start, drive);
  return true;
}

}  // namespace archetide
