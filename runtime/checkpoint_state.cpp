#include "runtime/checkpoint_state.h"

#include "runtime/body_state.h"

namespace archetide {
namespace {

// Bodies that have appeared by the time of the state.
void visit_bodies(SimulationState& s, StateArchive& a) {
  std::size_t present = s.bodies.size();
  a.field("present", present);
  if (present < s.bodies.size() || present > s.bodies.size() + s.waiting.size())
    a.fail("there are other bodies in this scene");
  if (present > s.bodies.size()) admit(s, present - s.bodies.size());
  body_fields(a, "bodies", s.bodies);
  a.field("bodies/water_impulse", s.water_impulse);
  a.field("bodies/water_angular_impulse", s.water_angular_impulse);
  if (s.water_impulse.size() != s.bodies.size() ||
      s.water_angular_impulse.size() != s.bodies.size())
    a.fail("the impulses of the water are of another number of bodies");
}

// With one solve a step the surface moves before there is a new geometry.
void visit_last_solved(SimulationState& s, StateArchive& a) {
  if (s.last_solved.empty()) s.last_solved = s.bodies;
  body_fields(a, "seen", s.last_solved);
  if (a.reading()) update_geometry(s, s.last_solved);
}

void visit_water(SimulationState& s, StateArchive& a) {
  if (!s.water.present()) return;
  s.water.visit_state(a);
  if (a.reading()) s.coupling.set_tank(s.water.grid(), s.water.open_side());
  if (s.options.scheme == Scheme::kSingle) visit_last_solved(s, a);
}

}  // namespace

void visit_state(SimulationState& s, StateArchive& a) {
  s.water.visit_clock(a);
  a.field("step_count", s.step_count);
  a.field("actuation_work", s.actuation_work);
  s.budget.visit_state(a);
  visit_bodies(s, a);
  if (s.body_contacts) {
    contact_fields(a, "contact/position", s.body_contacts->memory.position);
    contact_fields(a, "contact/velocity", s.body_contacts->memory.velocity);
  }
  visit_water(s, a);
  s.coupling.visit_state(a, s.bodies);
}

}  // namespace archetide
