#pragma once

#include <vector>

#include "common/base/types.h"
#include "runtime/budget.h"
#include "runtime/numerics/solve_report.h"

namespace archetide {

/// Why an attempt at a step was given up.
enum class Refusal {
  kNone,
  kNotConverged,  // a coupled solve
  kNotLinear,     // forces of nonlinear bodies are far from what the step has them linear about
  kJointOpen,     // and cannot be closed
  kJointWork,     // joints gave or took energy [D62]
  kSank,          // bodies came deeper into each other
  kThrown,        // bodies took more energy than there was to take [D63]
  kNotFinite      // a body
};

/// What one step did: a row of stats.csv.
struct StepReport {
  double t = 0.0, dt = 0.0, cfl = 0.0;  // time at the end, s; step, s; largest speed * dt / dx
  int halvings = 0;
  std::vector<Refusal> refused;    // why, one for each halving
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
  double source_volume = 0.0;          // brought by sources since the start, m^3
  Vec3 water_momentum = Vec3::Zero();  // kg m/s
  Vec3 water_angular_momentum = Vec3::Zero();  // about the origin, kg m^2/s
  Budget budget;                               // where momentum and energy came from and went to
  Vec3 body_momentum = Vec3::Zero();           // sum of P, kg m/s
  Vec3 body_angular_momentum = Vec3::Zero();   // sum of L + t x P, kg m^2/s
  double water_kinetic = 0.0, body_kinetic = 0.0, body_elastic = 0.0, potential = 0.0;  // J
  double actuation_work =
      0.0;                 // of actuators, external loads, springs and motors since the start, J
  double max_speed = 0.0;  // m/s, water and bodies
  int contacts = 0;        // points that touch walls, obstacles or other bodies
  int contact_sweeps = 0;  // of the contact solver, both stages
  double max_penetration = 0.0, mean_penetration = 0.0;  // m, of points that touch (body contact)
  double joint_drift = 0.0;                              // m, largest gap of a joint
  bool thrown = false;           // bodies gained energy from nothing, however short the step [D63]
  double max_deformation = 0.0;  // largest modal displacement of a surface point / body size
  std::vector<int> held_bodies;  // whose modes were stopped before an element turned inside out

  /// Of water, drops and bodies, J.
  double energy() const {
    return water_kinetic + body_kinetic + body_elastic + spray_kinetic + potential;
  }
  /// Water in the tank, in the air and gone through its open sides, less what sources brought, m^3:
  /// it should not drift.
  double accounted_volume() const {
    return water_volume + spray_volume + outflow_volume - source_volume;
  }
  /// How far that is from what it was in the first step (m^3), of all the water that was there or
  /// came; 0 without any.
  double volume_drift(double first) const {
    const double all = first + source_volume;
    return all > 0.0 ? (accounted_volume() - first) / all : 0.0;
  }
};

/// What one attempt at a step has found out, also where it failed.
struct StepAttempt {
  StepReport report;
  Refusal refusal = Refusal::kNone;
  int open_joint = -1;    // that could not be closed (Section 7), or -1 ..
  double open_gap = 0.0;  // .. and how far it stays open, m

  /// Gives it up: false.
  bool refuse(Refusal why) {
    refusal = why;
    return false;
  }
};

struct SimulationState;

/// Fills what is known after a step of dt (s): time, momenta, energies, volumes and the budget. The
/// reports of solves and contacts are there already.
void fill_report(SimulationState& s, double dt, StepReport& report);

}  // namespace archetide
