#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "runtime/contact/push_out.h"
#include "runtime/coupling/coupling.h"
#include "runtime/fluid/fluid_state.h"
#include "runtime/fluid/spray.h"
#include "runtime/fluid/surface.h"
#include "runtime/fluid/surface_refit.h"
#include "runtime/fluid/volume_flux.h"
#include "runtime/fluid/water_beyond.h"
#include "runtime/options.h"

namespace archetide {

/// The tank up to the ceiling that the fields of a run begin with (Simulation::grid).
Grid field_grid(const SimulationOptions& options, const FluidState& initial);

/// The water between the coupled solves of a step (Section 6): its state, the fields that carry it
/// from one solve to the next, and the volume that it should have. A tank without water only keeps
/// the time, and its stages do nothing. The first stage of an attempt begins anew, each other
/// checks that the one before it is done; "solve" is the coupled solve on half_velocity() or
/// full_velocity().
class WaterStep {
 public:
  /// `options` must outlive it.
  WaterStep(const SimulationOptions& options, FluidState initial);

  const FluidState& fluid() const { return fluid_; }
  /// Through open sides since the start, m^3.
  double outflow() const { return outflow_; }
  /// From sources since the start, m^3.
  double poured() const { return poured_; }
  /// Moved between surface and residual since the start, m^3, without sign.
  double refitted() const { return refitted_; }

  bool present() const { return options_.has_water && options_.grid.cells() > 0; }
  /// The tank up to a ceiling above all water, where the fields are: air higher up costs nothing.
  /// The ceiling is open.
  const Grid& grid() const { return grid_; }
  const Sides& open_side() const { return open_side_; }
  /// No water is higher than this, m.
  double top() const;
  /// Before a step: raises or lowers the ceiling where the water needs it; true if it did.
  bool fit_ceiling();
  /// Faces of fluid.u that mean something (layers count).
  const FaceField<unsigned char>& valid() const { return valid_; }

  /// Before a step, in the geometry of its start: sources are filled again.
  struct Poured {
    Motion motion;        // that came with the water
    double energy = 0.0;  // kinetic and potential, J
  };
  Poured pour(const Coupling& coupling);
  /// Whether any source pours now.
  bool pours() const;

  /// First look at the scene: fields, a clean level set, particles.
  void prepare(const Coupling& coupling);
  /// Markers, if there are any, out of bodies and obstacles.
  void place_markers(const std::vector<TriMesh>& obstacles, const std::vector<ReducedBody>& bodies);

  /// Of the half-step and of the full-step solve, u* in and u out, m/s.
  MacField& half_velocity() { return u_half_; }
  MacField& full_velocity() { return u_star_; }

  /// Before the first step: the given velocity is the u* of a velocity solve in which nothing moves.
  void start_with_given_velocity();
  /// Positions stage: u* of the half step; then its solve.
  void advect_to_half(double dt);
  /// That solve is to be made again: its velocity before it.
  void restore_half() {
    if (present()) u_half_ = push_;
  }
  /// After that solve.
  void after_position_solve(double dt, const Coupling& coupling);
  /// One solve a step: instead of the positions stage.
  void start_single();

  /// The velocities stage's solve may be made again: its velocity before it is kept, and restored.
  void keep_full() {
    if (present()) copy_values(u_star_, carrier_);
  }
  void restore_full() {
    if (present()) copy_values(carrier_, u_star_);
  }

  /// Velocities stage: what flows from cell to cell in the whole step; the geometry is still that of
  /// the last solve.
  void let_flow(double dt, const Coupling& coupling);
  /// The level set and the particles over the whole step; what they lose is the residual's, and the
  /// surface takes it up again nearby. The geometry is that of the next solve.
  void move_surface(double dt, const Coupling& coupling, std::int64_t step);
  /// u* of the full step; then its solve.
  void advect_to_end(double dt);
  /// How the velocity solve reads the surface's pressure.
  FreeSurface surface_now(double dt) const;
  /// Where it stands, nothing carried.
  FreeSurface surface_as_it_stands() const;
  /// After that solve: the water is at the end of the step.
  void after_velocity_solve(double dt, const Coupling& coupling);
  /// A step of dt (s) is done.
  void end_step(double dt);
  /// Water that neither the surface nor drops show, m^3 (negative: shown twice); see
  /// surface_refit.h.
  double residual_volume() const;
  /// What fluid.drag and beaches, and step.outrun, took from the water in this step (<= 0), J.
  double drag_energy() const { return drag_energy_; }
  double slowed_energy() const { return slowed_energy_; }
  /// What the surface shows in each cell, dx^3.
  const Array3<double>& held() const { return held_; }
  /// What each cell should hold beyond that, dx^3.
  const Array3<double>& residual() const { return residual_; }
  /// What narrow faces carry into the next solve beside u_half or u_star.
  const NarrowFlow& narrow_flow() const { return narrow_; }

  /// Length of the last step, s; 0 at the start and after a step that was rejected.
  double last_dt() const { return last_dt_; }

  /// Markers follow the water at the middle of the step.
  void carry_markers(double dt, const std::vector<ReducedBody>& bodies);

  /// Time and the last step, of a tank without water as well; and the rest.
  void visit_clock(StateArchive& a);
  void visit_state(StateArchive& a);

  /// What an attempt changes and a rejected one must give back (u^n is only replaced by a step that
  /// succeeds).
  struct Memory {
    Array3<double> phi;
    Particles particles;
    FaceField<unsigned char> valid;
    double refitted = 0.0, outflow = 0.0;
    Array3<double> held, residual;
    Spray spray;
    NarrowFlow narrow;
  };
  void remember(Memory& now) const;
  void restore(const Memory& before);

 private:
  void set_ceiling(int layers);
  bool single() const { return options_.scheme == Scheme::kSingle; }
  SurfaceOptions surface_options() const;
  void find_air_beyond();
  Sides water_beyond() const;  // sides that take and give water
  Sides air_sides() const;     // the other open ones
  /// How far from the surface the velocity that carries it is read, m: where a step may carry it,
  /// and the cells around.
  double swept_reach() const { return (1.5 + std::min(options_.cfl, 3.0)) * options_.grid.dx; }
  void extrapolate(const Coupling& coupling, double wall_speed,
                   const std::vector<MacField*>& fields);
  void continue_around_sources(const Coupling& coupling, FaceField<unsigned char> keeps);
  void mark_for_advection(const Coupling& coupling);
  double usual_acceleration(double dt) const;
  double damp_water(double dt, MacField& u) const;
  double most_speed(double dt) const;
  void slow_down(double dt, MacField& u) const;
  void move_spray(double dt, const Array3<double>& solid);
  void keep_markers_in_water(const std::vector<ReducedBody>& bodies);

  // How far the attempt at a step has come.
  enum class At { kEnd, kHalfAdvected, kHalfSolved, kFlowBooked, kSurfaceMoved, kAdvected };
  void follow(At expected, At next);

  const SimulationOptions& options_;
  At at_ = At::kEnd;
  FluidState fluid_;
  MacField u_half_;  // at the middle of the step, m/s
  MacField u_star_;  // advected, for the full-step solve, m/s
  Grid grid_;
  Sides open_side_;
  VelocityBeyond beyond_;  // of the water there, as the scene begins
  Sides air_beyond_{};     // open sides that the water did not cover whole at the start
  bool full_ = false;      // no air in the tank as the scene begins
  double last_dt_ = 0.0;   // s, of the step that u_half_ stems from; 0: of none
  double outflow_ = 0.0, refitted_ = 0.0, poured_ = 0.0;  // m^3
  FaceField<unsigned char> valid_, target_, deep_;
  Array3<unsigned char> solid_cells_;
  MacField push_;  // dt grad p / rho over the last half-step (one solve a step: full-step) solve,
                   // m/s, continued like the velocity
  Array3<double> held_, residual_;  // per cell, dx^3; see surface_refit.h
  SurfaceRefit refit_;
  std::vector<Landing> landings_;  // of this step
  std::vector<FaceFlow> hidden_;   // of the last solve that gave u_half
  NarrowFlow narrow_;              // of the last solve
  double mean_push_ = 0.0;         // of the last half-step solve, m/s
  double drag_energy_ = 0.0, slowed_energy_ = 0.0;
  MacField carrier_;                   // transporting velocity, m/s
  MacField u_last_;                    // u^{n-1}, m/s (one solve a step)
  std::unique_ptr<PushOut> push_out_;  // null: no markers
};

}  // namespace archetide
