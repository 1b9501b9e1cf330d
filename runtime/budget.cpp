#include "runtime/budget.h"

namespace archetide {
namespace {

void motion_fields(StateArchive& a, const std::string& name, Motion& m) {
  a.field(name + "/P", m.P);
  a.field(name + "/L", m.L);
  a.field(name + "/kinetic", m.kinetic);
}

void impulse_fields(StateArchive& a, const std::string& name, Impulse& i) {
  a.field(name + "/P", i.P);
  a.field(name + "/L", i.L);
}

}  // namespace

Budget& Budget::operator+=(const Budget& step) {
  transported += step.transported;
  solids += step.solids;
  weight += step.weight;
  contact += step.contact;
  external += step.external;
  unmatched += step.unmatched;
  contact_energy += step.contact_energy;
  drag_energy += step.drag_energy;
  slowed_energy += step.slowed_energy;
  held_energy += step.held_energy;
  solved_energy += step.solved_energy;
  return *this;
}

void Budget::visit_state(StateArchive& a) {
  motion_fields(a, "budget/transported", transported);
  impulse_fields(a, "budget/solids", solids);
  impulse_fields(a, "budget/weight", weight);
  impulse_fields(a, "budget/contact", contact);
  impulse_fields(a, "budget/external", external);
  impulse_fields(a, "budget/unmatched", unmatched);
  a.field("budget/contact_energy", contact_energy);
  a.field("budget/drag_energy", drag_energy);
  a.field("budget/slowed_energy", slowed_energy);
  a.field("budget/held_energy", held_energy);
  a.field("budget/solved_energy", solved_energy);
}

void BudgetKeeper::add_poured(const Motion& water) {
  last_ += water;
  if (started_) total_.external += {water.P, water.L};
}

void BudgetKeeper::start_attempt(const std::vector<ReducedBody>& bodies) {
  step_ = {};
  from_water_ = {}, on_solids_ = {};
  bodies_before_.clear(), places_before_.clear();
  for (const ReducedBody& body : bodies) {
    bodies_before_.push_back({body.P, body.L});
    places_before_.push_back(body.position);
  }
}

// What bodies have gained beyond their weight, external loads and what the water gave is contact's. Their momentum
// moves with them: from x to x' at a speed that is not P / m exactly.
void BudgetKeeper::end_bodies(double dt, const Vec3& gravity,
                              const std::vector<ReducedBody>& bodies) {
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const ReducedBody& body = bodies[b];
    if (body.prescribed) continue;
    const Impulse weight = impulse_at(body.position, dt * body_mass(body) * gravity),
                  &before = bodies_before_[b];
    step_.weight += weight;
    step_.contact += impulse_at(body.position, body.P - before.P, body.L - before.L) - weight;
    step_.transported.L += (body.position - places_before_[b]).cross(before.P);
  }
  step_.contact = step_.contact - from_water_ - step_.external;
}

// Eqs. B3 and B4.
void BudgetKeeper::end_step(double dt, const Vec3& gravity, const std::vector<ReducedBody>& bodies,
                            const End& end) {
  const Impulse water{dt * end.water_mass * gravity, dt * end.water_moment.cross(gravity)},
      drops{dt * last_drops_ * gravity, dt * last_moment_.cross(gravity)};
  // p' on the surface and on the bodies is all of gravity but what the solids bear.
  step_.solids = end.solids;
  step_.solids += end.hydrostatic - water;
  step_.solids = step_.solids - on_solids_;
  step_.unmatched = end.unmatched;
  step_.weight = water;
  step_.weight += drops;
  step_.drag_energy = end.drag_energy, step_.slowed_energy = end.slowed_energy;
  Motion before = end.before;
  before += end.drops;
  step_.transported = before - last_;
  step_.transported.P -= drops.P, step_.transported.L -= drops.L;
  step_.transported.kinetic -= step_.drag_energy;
  end_bodies(dt, gravity, bodies);
  step_.solved_energy = end.energy - last_energy_ - (end.work - last_work_) -
                        step_.transported.kinetic - step_.contact_energy - step_.drag_energy -
                        step_.slowed_energy - step_.held_energy;
  if (started_) total_ += step_;  // before the first step there is nothing to compare with
  started_ = true;
  last_ = end.after;
  last_.kinetic += end.slowed_energy;
  last_ += end.drops;
  last_drops_ = end.drop_mass, last_moment_ = end.drop_moment;
  last_energy_ = end.energy, last_work_ = end.work;
}

void BudgetKeeper::visit_state(StateArchive& a) {
  total_.visit_state(a);
  motion_fields(a, "budget/last", last_);
  a.field("budget/last_drops", last_drops_);
  a.field("budget/last_moment", last_moment_);
  a.field("budget/last_energy", last_energy_);
  a.field("budget/last_work", last_work_);
  int started = started_;
  a.field("budget/started", started);
  started_ = started != 0;
}

}  // namespace archetide
