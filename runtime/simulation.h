#pragma once

#include <memory>
#include <vector>

#include "common/base/profile.h"
#include "common/files/state_file.h"
#include "common/mesh/tri_mesh.h"
#include "runtime/articulation/actuation.h"
#include "runtime/articulation/external_load.h"
#include "runtime/articulation/motion_path.h"
#include "runtime/articulation/motor.h"
#include "runtime/articulation/spring.h"
#include "runtime/fluid/fluid_state.h"
#include "runtime/options.h"
#include "runtime/step_report.h"

namespace archetide {

struct SimulationState;

/// Bodies and water, coupled, step by step (Section 6).
class Simulation {
 public:
  /// `initial` gives phi and u (u may be empty: at rest). Static obstacles are closed outward
  /// surfaces. `release`: when each body appears, s, ascending; empty: all at the start. `joints`
  /// of bodies that are there from the start; jointed bodies do not collide with each other, and
  /// the scheme must be kNewmark. `skins` of bodies that are there from the start; members of one
  /// skin do not collide with each other; the rest meets the skin, walls as well.
  Simulation(SimulationOptions options, FluidState initial, std::vector<ReducedBody> bodies,
             std::vector<TriMesh> obstacles, std::vector<double> release = {},
             std::vector<Joint> joints = {}, std::vector<SkinnedBodies> skins = {});
  ~Simulation();
  Simulation(Simulation&&) noexcept;

  /// Forces that drive modes; `body` counts all_bodies().
  void set_actuators(std::vector<Actuator> actuators);
  void set_external_loads(std::vector<ExternalLoad> loads);
  void set_springs(std::vector<Spring> springs);
  void set_motors(std::vector<Motor> motors);
  /// Bodies that go as they are told, of those of time 0, rigid; two solves a step.
  void set_prescribed(std::vector<PrescribedBody> bodies);

  /// The step that the CFL number and max_dt allow now, s.
  double stable_dt() const;

  /// Advances by dt (or less, see StepReport::dt, when on_fail halves). Throws NumericsError when
  /// it cannot.
  StepReport step(double dt);

  double time() const;
  const SimulationOptions& options() const;
  /// The tank up to a ceiling above all water: what the fields of fluid() and coupling() cover. It
  /// follows the water from step to step; above it there is air.
  const Grid& grid() const;
  const FluidState& fluid() const;
  /// Those that have appeared.
  const std::vector<ReducedBody>& bodies() const;
  std::vector<ReducedBody>& bodies();
  /// And those that will, as they will appear.
  std::vector<ReducedBody> all_bodies() const;
  /// How many of them were due at the last step and wait: another body stands in the place.
  int late_bodies() const;
  const std::vector<SkinnedBodies>& skins() const;
  /// Geometry and pressure system of the last solve.
  const Coupling& coupling() const;
  const std::vector<TriMesh>& obstacles() const;
  /// Impulse (force, torque about the centre of mass) of the water on body b since the last reset,
  /// N s and N m s.
  const Vec3& water_impulse(int b) const;
  const Vec3& water_angular_impulse(int b) const;
  void reset_water_impulses();
  /// Everything that the next step depends on, and impulses since the last reset; the scene gives
  /// the rest. Reading needs a simulation that has made no step. Resumed equals uninterrupted bit
  /// for bit.
  void visit_state(StateArchive& a);
  /// Wall seconds by phase since construction.
  const Profile& profile() const;

 private:
  /// What a rejected attempt gives back.
  struct StepStart;
  void remember_start();
  void return_to_start();

  std::unique_ptr<SimulationState> state_;
  std::unique_ptr<StepStart> start_;  // kept between steps for its memory
};

}  // namespace archetide
