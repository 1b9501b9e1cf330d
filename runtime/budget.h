#pragma once

#include <vector>

#include "common/files/state_file.h"
#include "runtime/coupling/impulses.h"
#include "runtime/coupling/water_motion.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// Where momentum and energy of water, drops and bodies come from and go to [D49], since the start
/// (of the first step's end on):
///   P, L   = those of the start + solids + weight + external + contact + transported + unmatched
///   energy = that of the start + transported + contact + drag + slowed + held + solved + the work
///            of actuators, external loads, springs, motors and bodies that go as they are told
struct Budget {
  // what moving the water through the grid has changed (P and L: with fluid.drag and step.outrun),
  // and moving the bodies (L = x times P)
  Motion transported;
  // of the pressure on the tank's sides, the obstacles and bodies that go as they are told, hydrostatic
  // as well
  Impulse solids;
  Impulse weight;     // of gravity on water, drops and bodies
  Impulse contact;    // of contacts and joints with what stands still or goes as it is told
  Impulse external;   // of external loads, springs and motors, and with the water of sources
  Impulse unmatched;  // Coupling::unmatched_impulse()
  double contact_energy = 0.0;  // that contacts between the stages have changed, J
  double drag_energy = 0.0;     // that fluid.drag and beaches have taken (<= 0), J
  double slowed_energy = 0.0;   // that step.outrun has taken (<= 0), J
  double held_energy = 0.0;     // taken from modes of bodies that were held (<= 0), J
  // the coupled solves, with the potential energy that the surface's way has changed: 0 if exact, J
  double solved_energy = 0.0;

  Budget& operator+=(const Budget& step);
  void visit_state(StateArchive& a);
};

/// Collects a Budget, step by step; an attempt that is given up leaves nothing.
class BudgetKeeper {
 public:
  /// Before the first step: how the water moves.
  void start_from(const Motion& water) { last_ = water; }
  void start_attempt(const std::vector<ReducedBody>& bodies);
  void add_contact_energy(double joules) { step_.contact_energy += joules; }
  /// Of a body that appears.
  void add_appearing_energy(double joules) { last_energy_ += joules; }
  /// Of water that a source brings, before a step.
  void add_poured(const Motion& water);
  void add_held_energy(double joules) { step_.held_energy += joules; }
  /// Of the water on a body in the velocity stage.
  void add_water_impulse(const Impulse& given) { from_water_ += given; }
  /// The same on one that goes as it is told: a solid to the rest.
  void add_solid_impulse(const Impulse& given) { on_solids_ += given; }
  void add_external(const Impulse& given) { step_.external += given; }

  /// What a step of dt leaves: motion of the water before and after its velocity stage and of the
  /// drops, impulses of that stage (Coupling), mass of the water (kg) and its first moment (kg m),
  /// and mass of the drops; energy of everything, work of the actuators since the start and what
  /// drag and step.outrun took in this step, J.
  struct End {
    Motion before, after, drops;
    Impulse solids, hydrostatic, unmatched;
    double water_mass = 0.0, drop_mass = 0.0;
    Vec3 water_moment = Vec3::Zero(), drop_moment = Vec3::Zero();
    double energy = 0.0, work = 0.0, drag_energy = 0.0, slowed_energy = 0.0;
  };
  void end_step(double dt, const Vec3& gravity, const std::vector<ReducedBody>& bodies,
                const End& end);

  const Budget& total() const { return total_; }
  /// Of water and drops at the end of the last step, or before the first.
  const Motion& last_motion() const { return last_; }
  void visit_state(StateArchive& a);

 private:
  void end_bodies(double dt, const Vec3& gravity, const std::vector<ReducedBody>& bodies);

  Budget total_, step_;
  Motion last_;                                 // water and drops after the last step
  double last_drops_ = 0.0;                     // kg
  Vec3 last_moment_ = Vec3::Zero();             // kg m, of the drops
  double last_energy_ = 0.0, last_work_ = 0.0;  // J
  std::vector<Impulse> bodies_before_;          // P and L of each, about its own centre ..
  std::vector<Vec3> places_before_;             // .. which is here, m
  Impulse from_water_, on_solids_;
  bool started_ = false;
};

}  // namespace archetide
