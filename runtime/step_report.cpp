#include "runtime/step_report.h"

#include <algorithm>

#include "runtime/articulation/joint.h"
#include "runtime/fluid/spray.h"
#include "runtime/state.h"
#include "runtime/statistics.h"

namespace archetide {
namespace {

void add_spray_statistics(const SimulationOptions& o, const Spray& spray, const SprayMotion& drops,
                          StepReport& r) {
  r.spray_volume = spray_volume(spray);
  r.spray_kinetic = o.water_density * drops.kinetic;
  r.spray_momentum = o.water_density * drops.momentum;
  r.spray_angular_momentum = o.water_density * drops.angular_momentum;
  r.potential += o.water_density * drops.potential;
}

// What the columns of the budget need of the water [D49].
void add_water_budget(const SimulationState& s, const WaterMoment& inside, const SprayMotion& drops,
                      BudgetKeeper::End& end) {
  const double density = s.options.water_density;
  const WaterStep& water = s.water;
  const Coupling& coupling = s.coupling;
  end.before = coupling.motion_before(), end.after = coupling.motion_after();
  end.drops = {density * drops.momentum, density * drops.angular_momentum, density * drops.kinetic};
  end.solids = coupling.solid_impulse(), end.hydrostatic = coupling.hydrostatic_impulse();
  end.water_mass = density * inside.volume, end.water_moment = density * inside.moment;
  end.drop_mass = density * spray_volume(water.fluid().spray);
  end.drop_moment = density * drops.moment;
  end.unmatched = coupling.unmatched_impulse();
  end.drag_energy = water.drag_energy(), end.slowed_energy = water.slowed_energy();
}

void add_water(const SimulationState& s, StepReport& r, BudgetKeeper::End& end) {
  const WaterStep& water = s.water;
  if (!water.present()) return;
  const WaterMoment inside = water_moment(water.grid(), water.held());
  add_water_statistics(s.options, water, inside, s.coupling, r);
  r.outflow_volume = water.outflow();
  r.source_volume = water.poured();
  r.volume_refitted = water.refitted();
  r.volume_residual = water.residual_volume();
  const SprayMotion drops = spray_motion(water.fluid().spray, s.options.gravity);
  add_spray_statistics(s.options, water.fluid().spray, drops, r);
  r.water_kinetic += water.slowed_energy();
  add_water_budget(s, inside, drops, end);
}

}  // namespace

void fill_report(SimulationState& s, double dt, StepReport& r) {
  ScopedTimer timer(s.profile, "statistics");
  r.t = s.time();
  r.dt = dt;
  r.max_speed = 0.0;
  for (const ReducedBody& b : s.bodies) {
    add_body_statistics(b, s.options.gravity, r);
    r.max_speed = std::max(r.max_speed, largest_surface_speed(b));
  }
  BudgetKeeper::End end;
  add_water(s, r, end);
  end.energy = r.energy(), end.work = s.actuation_work;
  s.budget.end_step(dt, s.options.gravity, s.bodies, end);
  r.budget = s.budget.total();
  r.joint_drift = joint_drift(s.joints, s.bodies);
  r.held_bodies = s.guard.held();
  r.actuation_work = s.actuation_work;
  r.cfl = s.has_tank() ? r.max_speed * dt / s.options.grid.dx : 0.0;
}

}  // namespace archetide
