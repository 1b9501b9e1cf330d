#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/profile.h"
#include "common/state_file.h"
#include "common/tri_mesh.h"
#include "runtime/articulation/actuation.h"
#include "runtime/budget.h"
#include "runtime/coupling/coupling.h"
#include "runtime/fluid/damping.h"
#include "runtime/fluid/fluid_state.h"
#include "runtime/grid/grid.h"
#include "runtime/numerics/solve_report.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

enum class Scheme { kNewmark, kSingle };  // two coupled solves a step (Section 6), or one [D4]
enum class OnFail { kHalveStep, kStop };

struct SimulationOptions {
  Grid grid;  // zero cells: no tank, no water (bodies in vacuum)
  bool has_water = false;
  double water_density = 1000.0;        // kg/m^3
  Vec3 gravity = Vec3(0, 0, -9.81);     // m/s^2
  Vec3 reference_point = Vec3::Zero();  // where p' = p; the result must not depend on it
  Sides open_side{};                    // open sides of the tank; others closed and free-slip
  Damping damping;                      // of the water's motion
  int particles_per_cell = 0;           // 0: plain level set
  bool spray = false;                   // water particles that come away fly as drops

  Geometry geometry = Geometry::kCutCell;
  double tolerance = 1e-8;  // relative residual of the coupled solve, 1e-14 .. 1e-2
  int max_iterations = 200;
  ModalOptions modal;
  Scheme scheme = Scheme::kNewmark;
  // Cells that the fastest water or body may cross in a step, 0.1 .. 10; a body that falls through
  // air as far as there is nothing to meet.
  double cfl = 1.0;
  // Share of the water that may go farther, up to 3 times that and 10 cells, and is slowed down to
  // it: where water closes over something a few faces make small steps for all.
  double outrun = 0.0;
  double max_dt = 1.0 / 24.0;  // s
  OnFail on_fail = OnFail::kHalveStep;

  bool wall_contact = true;   // surface points against the tank's closed sides
  bool body_contact = false;  // bodies against each other and against obstacles
  double restitution = 0.0, friction = 0.0;
};

/// The tank up to the ceiling that the fields of a run begin with (Simulation::grid).
Grid field_grid(const SimulationOptions& options, const FluidState& initial);

/// What one step did: a row of stats.csv.
struct StepReport {
  double t = 0.0, dt = 0.0, cfl = 0.0;  // time at the end, s; step, s; largest speed * dt / dx
  int halvings = 0;
  SolveReport position, velocity;  // the two coupled solves (position is empty for Scheme::kSingle)
  double divergence = 0.0;         // max |div u| over water cells after the velocity solve, 1/s
  double water_volume = 0.0;       // m^3
  double volume_residual = 0.0;    // m^3, held by cells beyond what surface and drops show
  double volume_refitted = 0.0;    // m^3, that the surface gave or took back nearby since the start
  double spray_volume = 0.0;       // of drops in the air, m^3; not part of water_volume
  double spray_kinetic = 0.0;      // J; their potential energy is part of `potential`
  Vec3 spray_momentum = Vec3::Zero();          // kg m/s
  Vec3 spray_angular_momentum = Vec3::Zero();  // about the origin, kg m^2/s
  double outflow_volume = 0.0;         // left through open sides of the tank since the start, m^3
  Vec3 water_momentum = Vec3::Zero();  // kg m/s
  Vec3 water_angular_momentum = Vec3::Zero();  // about the origin, kg m^2/s
  Budget budget;                               // where momentum and energy came from and went to
  Vec3 body_momentum = Vec3::Zero();           // sum of P, kg m/s
  Vec3 body_angular_momentum = Vec3::Zero();   // sum of L + t x P, kg m^2/s
  double water_kinetic = 0.0, body_kinetic = 0.0, body_elastic = 0.0, potential = 0.0;  // J
  double actuation_work = 0.0;  // of all actuators since the start, J
  double max_speed = 0.0;       // m/s, water and bodies
  int contacts = 0;             // points that touch walls, obstacles or other bodies
  int contact_sweeps = 0;       // of the contact solver, both stages
  double max_penetration = 0.0, mean_penetration = 0.0;  // m, of points that touch (body contact)
  double joint_drift = 0.0;                              // m, largest gap of a joint
  double max_deformation = 0.0;  // largest modal displacement of a surface point / body size
  std::vector<int> held_bodies;  // whose modes were stopped before an element turned inside out

  /// Of water, drops and bodies, J.
  double energy() const {
    return water_kinetic + body_kinetic + body_elastic + spray_kinetic + potential;
  }
  /// Water in the tank, in the air and gone through its open sides, m^3: it should not drift.
  double accounted_volume() const { return water_volume + spray_volume + outflow_volume; }
};

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
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace archetide
