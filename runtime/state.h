#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "common/base/profile.h"
#include "common/mesh/tri_mesh.h"
#include "runtime/articulation/actuation.h"
#include "runtime/articulation/external_load.h"
#include "runtime/articulation/motion_path.h"
#include "runtime/articulation/motor.h"
#include "runtime/articulation/spring.h"
#include "runtime/budget.h"
#include "runtime/contact/body_contacts.h"
#include "runtime/coupling/coupling.h"
#include "runtime/options.h"
#include "runtime/solid/inversion_guard.h"
#include "runtime/water_step.h"

namespace archetide {

/// What the scene gave, and what has become of it: all that a step reads and changes. The stages of
/// a step are functions of it. What a scene lacks is an empty set.
struct SimulationState {
  /// Arguments as in Simulation. Bodies of time 0 are present.
  SimulationState(SimulationOptions options, FluidState initial, std::vector<ReducedBody> bodies,
                  std::vector<TriMesh> obstacles, std::vector<double> release,
                  std::vector<Joint> joints, std::vector<SkinnedBodies> skins);
  SimulationState(const SimulationState&) = delete;  // `water` refers to `options`
  SimulationState& operator=(const SimulationState&) = delete;

  bool has_tank() const { return options.grid.cells() > 0; }
  double time() const { return water.fluid().time; }  // s

  const SimulationOptions options;
  std::vector<ReducedBody> bodies;   // that have appeared: poses, momenta, q and q_dot
  std::vector<ReducedBody> waiting;  // to appear, in order
  std::vector<double> release;       // s, of those that wait
  int late = 0;                      // of those, at the last step: another body is in the place
  const std::vector<TriMesh> obstacles;
  const std::vector<Joint> joints;
  const std::vector<SkinnedBodies> skins;
  std::vector<Actuator> actuators;
  std::vector<ExternalLoad> loads;
  std::vector<Spring> springs;
  std::vector<Motor> motors;
  std::vector<PrescribedBody> prescribed;
  WaterStep water;
  Coupling coupling;

  std::vector<BodyReach> reach;                 // per body, bounds its extent
  std::unique_ptr<BodyContacts> body_contacts;  // null: bodies meet nothing but walls
  InversionGuard guard;                         // of soft bodies' elements
  // Of the water on each body since the last reset, N s and N m s about the centre of mass.
  std::vector<Vec3> water_impulse, water_angular_impulse;
  // As the water meets them in the positions stage; the coupling keeps pointing at them.
  std::vector<ReducedBody> half_way;
  std::vector<ReducedBody> last_solved;  // as the last solve saw them (Scheme::kSingle)
  std::int64_t step_count = 0;
  // Of actuators, external loads, springs, motors and bodies that go as they are told, since the start, J.
  double actuation_work = 0.0;
  BudgetKeeper budget;
  Profile profile;  // wall seconds by phase
};

/// First look at the scene: fractions, a clean level set, particles.
void prepare(SimulationState& s);

/// Bodies whose time has come, and whose place is free, join the others.
void admit_bodies(SimulationState& s);
/// The first n of those that wait join the others.
void admit(SimulationState& s, std::size_t n);

/// Before a step: the fields end above the water.
void fit_tank(SimulationState& s);

/// Fractions of the cells with the bodies as they are given.
void update_geometry(SimulationState& s, const std::vector<ReducedBody>& at);
/// Of the bodies as a step begins.
void update_geometry(SimulationState& s);

/// Contacts that hold in a solve of all bodies together; null: each alone at its walls.
inline GroupContacts* if_together(const SimulationState& s, GroupContacts& contacts) {
  return s.body_contacts ? &contacts : nullptr;
}

}  // namespace archetide
