// A step of Section 6: positions, contact, velocities.

#include "runtime/simulation.h"

#include "common/base/check.h"
#include "runtime/checkpoint_state.h"
#include "runtime/contact_stage.h"
#include "runtime/driving_forces.h"
#include "runtime/failure_diagnosis.h"
#include "runtime/position_stage.h"
#include "runtime/prescribed.h"
#include "runtime/single_solve.h"
#include "runtime/state.h"
#include "runtime/statistics.h"
#include "runtime/step_size.h"
#include "runtime/velocity_stage.h"

namespace archetide {
namespace {

// Section 6, two coupled solves: x^n, v^n -> x^{n+1}, v^{n+1}. False if the step has to be shorter.
bool step_with_two_solves(SimulationState& s, const std::vector<ReducedBody>& before, double dt,
                          StepAttempt& attempt) {
  // Positions: u* = A(u^n) (Eq. 22), v^{n+1/2} from Eq. 45 with joints (Eq. 49) over dt/2, and
  // x^{n+1} = x^n + dt v^{n+1/2}, joints closed (Section 7).
  std::optional<HalfStep> half = advance_positions(s, dt, attempt);
  if (!half) return false;
  if (broken_body(s.bodies) >= 0) return attempt.refuse(Refusal::kNotFinite);

  // Contact: x^{n+1} and v^n -> v^n without collisions [GBF03].
  if (!resolve_contact(s, dt, *half, attempt.report)) return attempt.refuse(Refusal::kSank);

  // Velocities: the surface moves with u^{n+1/2}, u* = A(u^n) (Eq. 22), v^{n+1} from Eq. 45 with
  // joints (Eq. 49) over dt; the actuators' f (Section 7) is that of the middle of the step.
  const std::vector<VecX> drive = driving_forces(s, dt, half->middle, before);
  return advance_velocities(s, before, dt, *half, drive, attempt);
}

// At the end of a step: modes that were held before an element turned inside out stop [D33].
void stop_held_modes(SimulationState& s) {
  if (s.guard.held().empty()) return;
  const double before = energy_of_bodies(s.bodies);
  s.guard.stop_held(s.bodies, s.options.modal.mass);
  s.budget.add_held_energy(energy_of_bodies(s.bodies) - before);
}

// One attempt at a step of dt from bodies as `before`; false leaves the state in the middle of it.
bool attempt_step(SimulationState& s, const std::vector<ReducedBody>& before, double dt,
                  StepAttempt& attempt) {
  aim_prescribed(s, dt);
  s.guard.start_step(s.bodies);
  s.budget.start_attempt(s.bodies);
  const bool done = s.options.scheme == Scheme::kNewmark
                        ? step_with_two_solves(s, before, dt, attempt)
                        : step_with_one_solve(s, dt, attempt);
  if (!done) return false;
  stop_held_modes(s);
  return true;
}

void carry_markers(SimulationState& s, double dt) {
  if (s.water.fluid().markers.empty()) return;
  ScopedTimer timer(s.profile, "markers");
  s.water.carry_markers(dt, s.bodies);
}

// Sources bring water, its momentum and its energy.
void pour(SimulationState& s) {
  if (!s.water.pours()) return;
  update_geometry(s);
  const WaterStep::Poured poured = s.water.pour(s.coupling);
  if (s.step_count == 0) return;  // as the scene begins
  s.budget.add_poured(poured.motion);
  s.actuation_work += poured.energy;
}

// A step of dt has been taken.
void finish_step(SimulationState& s, double dt, StepReport& report) {
  carry_markers(s, dt);
  s.water.end_step(dt);
  ++s.step_count;
  fill_report(s, dt, report);
  demand_finite(s.bodies, s.water.fluid(), report);
}

}  // namespace

// u^n is only replaced by a step that succeeds.
struct Simulation::StepStart {
  std::vector<ReducedBody> bodies;
  WaterStep::Memory water;
  BodyContacts::Memory contacts;
};

void Simulation::remember_start() {
  start_->bodies = state_->bodies;
  state_->water.remember(start_->water);
  if (state_->body_contacts) start_->contacts = state_->body_contacts->memory;
}

void Simulation::return_to_start() {
  state_->bodies = start_->bodies;
  state_->water.restore(start_->water);
  if (state_->body_contacts) state_->body_contacts->memory = start_->contacts;
}

StepReport Simulation::step(double dt) {
  constexpr int kMaxHalvings = 8;
  SimulationState& s = *state_;
  admit_bodies(s);
  fit_tank(s);
  pour(s);
  StepReport before;
  before.t = s.time();
  demand_finite(s.bodies, s.water.fluid(), before);
  if (s.step_count == 0) meet_at_start(s, dt);
  remember_start();
  std::vector<Refusal> refused;
  for (int halvings = 0;; ++halvings, dt *= 0.5) {
    StepAttempt attempt;
    attempt.report.halvings = halvings;
    if (attempt_step(s, start_->bodies, dt, attempt)) {
      attempt.report.refused = std::move(refused);
      finish_step(s, dt, attempt.report);
      return attempt.report;
    }
    if (s.options.on_fail == OnFail::kStop || halvings == kMaxHalvings)
      throw step_failure(s, dt, attempt);
    refused.push_back(attempt.refusal);
    return_to_start();
  }
}

double Simulation::stable_dt() const { return archetide::stable_dt(*state_); }

Simulation::Simulation(SimulationOptions options, FluidState initial,
                       std::vector<ReducedBody> bodies, std::vector<TriMesh> obstacles,
                       std::vector<double> release, std::vector<Joint> joints,
                       std::vector<SkinnedBodies> skins)
    : state_(std::make_unique<SimulationState>(
          std::move(options), std::move(initial), std::move(bodies), std::move(obstacles),
          std::move(release), std::move(joints), std::move(skins))),
      start_(std::make_unique<StepStart>()) {
  // one solve a step lacks the half step that keeps joints closed: their energy grew (measured)
  ARCHETIDE_CHECK(state_->joints.empty() || state_->options.scheme == Scheme::kNewmark);
  prepare(*state_);
}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;

void Simulation::visit_state(StateArchive& a) {
  ARCHETIDE_CHECK(!a.reading() || state_->step_count == 0);
  archetide::visit_state(*state_, a);
}

void Simulation::set_actuators(std::vector<Actuator> actuators) {
  state_->actuators = std::move(actuators);
}

void Simulation::set_external_loads(std::vector<ExternalLoad> loads) {
  state_->loads = std::move(loads);
}

void Simulation::set_springs(std::vector<Spring> springs) { state_->springs = std::move(springs); }

void Simulation::set_motors(std::vector<Motor> motors) { state_->motors = std::move(motors); }

void Simulation::set_prescribed(std::vector<PrescribedBody> bodies) {
  ARCHETIDE_CHECK(bodies.empty() || state_->options.scheme == Scheme::kNewmark);
  for (const PrescribedBody& told : bodies) {
    const auto b = static_cast<std::size_t>(told.body);
    ARCHETIDE_CHECK(told.body >= 0 && b < state_->bodies.size() && state_->bodies[b].r == 0);
  }
  state_->prescribed = std::move(bodies);
  place_prescribed(*state_);
}

double Simulation::time() const { return state_->time(); }
const SimulationOptions& Simulation::options() const { return state_->options; }
const Grid& Simulation::grid() const { return state_->water.grid(); }
const FluidState& Simulation::fluid() const { return state_->water.fluid(); }
const std::vector<ReducedBody>& Simulation::bodies() const { return state_->bodies; }
std::vector<ReducedBody>& Simulation::bodies() { return state_->bodies; }
std::vector<ReducedBody> Simulation::all_bodies() const {
  std::vector<ReducedBody> all = state_->bodies;
  all.insert(all.end(), state_->waiting.begin(), state_->waiting.end());
  return all;
}
int Simulation::late_bodies() const { return state_->late; }
const std::vector<SkinnedBodies>& Simulation::skins() const { return state_->skins; }
const Coupling& Simulation::coupling() const { return state_->coupling; }
const std::vector<TriMesh>& Simulation::obstacles() const { return state_->obstacles; }
const Vec3& Simulation::water_impulse(int b) const { return state_->water_impulse[b]; }
const Vec3& Simulation::water_angular_impulse(int b) const {
  return state_->water_angular_impulse[b];
}
void Simulation::reset_water_impulses() {
  for (Vec3& v : state_->water_impulse) v.setZero();
  for (Vec3& v : state_->water_angular_impulse) v.setZero();
}
const Profile& Simulation::profile() const { return state_->profile; }

}  // namespace archetide
