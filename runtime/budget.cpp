#include "runtime/budget.h"

namespace archetide {
namespace {

Vec3 momentum_of(const std::vector<ReducedBody>& bodies) {
  Vec3 P = Vec3::Zero();
  for (const ReducedBody& body : bodies) P += body.P;
  return P;
}

void motion_fields(StateArchive& a, const std::string& name, Motion& m) {
  a.field(name + "/P", m.P);
  a.field(name + "/L", m.L);
  a.field(name + "/kinetic", m.kinetic);
}

}  // namespace

Budget& Budget::operator+=(const Budget& step) {
  transported += step.transported;
  solids += step.solids;
  weight += step.weight;
  contact += step.contact;
  contact_energy += step.contact_energy;
  return *this;
}

void Budget::visit_state(StateArchive& a) {
  motion_fields(a, "budget/transported", transported);
  a.field("budget/solids/P", solids.P);
  a.field("budget/solids/L", solids.L);
  a.field("budget/weight/P", weight.P);
  a.field("budget/weight/L", weight.L);
  a.field("budget/contact", contact);
  a.field("budget/contact_energy", contact_energy);
}

void BudgetKeeper::start_attempt(const std::vector<ReducedBody>& bodies) {
  step_ = {};
  from_water_.setZero();
  bodies_before_ = momentum_of(bodies);
}

void BudgetKeeper::end_step(double dt, const Vec3& gravity, const std::vector<ReducedBody>& bodies,
                            const End& end) {
  const Impulse water{dt * end.water_mass * gravity, dt * end.water_moment.cross(gravity)},
      drops{dt * last_drops_ * gravity, dt * last_moment_.cross(gravity)};
  // p' on the surface and on the bodies is all of gravity but what the solids bear.
  step_.solids = end.solids;
  step_.solids += end.hydrostatic - water;
  step_.weight = water;
  step_.weight += drops;
  Vec3 weight = Vec3::Zero();
  for (const ReducedBody& body : bodies) {
    const Vec3 own = dt * body_mass(body) * gravity;
    weight += own;
    step_.weight += impulse_at(body.position, own);
  }
  step_.contact = momentum_of(bodies) - bodies_before_ - weight - from_water_;
  Motion before = end.before;
  before += end.drops;
  step_.transported = before - last_;
  step_.transported.P -= drops.P, step_.transported.L -= drops.L;
  if (started_) total_ += step_;  // before the first step there is nothing to compare with
  started_ = true;
  last_ = end.after;
  last_ += end.drops;
  last_drops_ = end.drop_mass, last_moment_ = end.drop_moment;
}

void BudgetKeeper::visit_state(StateArchive& a) {
  total_.visit_state(a);
  motion_fields(a, "budget/last", last_);
  a.field("budget/last_drops", last_drops_);
  a.field("budget/last_moment", last_moment_);
  int started = started_;
  a.field("budget/started", started);
  started_ = started != 0;
}

}  // namespace archetide
