#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "runtime/simulation.h"
#include "tests/support/coupled_tank.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"
#include "tests/support/water_scene.h"

namespace archetide {

/// Prints one figure of a hard case for the table of `make hard` and demands that it is at most
/// `bound` (NaN fails).
inline void expect_at_most(const char* what, double value, double bound) {
  std::printf("measured: %s = %.3g (at most %.3g)\n", what, value, bound);
  EXPECT_TRUE(value <= bound) << what << " is " << value;
}

/// How far the energy of a run has risen above what it was before, J.
class EnergyRise {
 public:
  void see(const StepReport& r) {
    lowest_ = std::min(lowest_, r.energy());
    largest_ = std::max(largest_, r.energy() - lowest_);
  }
  double largest() const { return largest_; }

 private:
  double lowest_ = INFINITY, largest_ = 0.0;
};

/// A tank of 1 m^3 with n^3 cells and an open top; water or dry.
inline SimulationOptions unit_tank(int n, bool water = true) {
  SimulationOptions o;
  o.grid = {n, n, n, 1.0 / n, Vec3::Zero()};
  o.has_water = water;
  o.open_side[kZMax] = true;
  return o;
}

inline ReducedBody rigid_ball(double radius, double density, const Vec3& position) {
  ReducedBody body = make_body(rigid_surface_archetype(volume_true_sphere(3, radius), density), 0);
  body.position = position;
  return body;
}

/// Turns a convex body so that one of its faces is below; returns the height of its centre over it,
/// m.
inline double stand_on_a_face(ReducedBody& body) {
  const TriMesh& surface = body.archetype->surface;
  const Vec3i& t = surface.triangles[0];
  const Vec3 a = surface.vertices[t[0]];
  const Vec3 normal = (surface.vertices[t[1]] - a).cross(surface.vertices[t[2]] - a).normalized();
  body.rotation = Quat::FromTwoVectors(normal, -Vec3::UnitZ());
  return normal.dot(a);
}

inline Vec3 velocity_of(const ReducedBody& b) { return b.P / body_mass(b); }

/// Demands numbers of a step, and bodies after it.
inline void expect_finite(const StepReport& r) {
  ASSERT_TRUE(std::isfinite(r.water_kinetic + r.body_kinetic + r.body_elastic + r.water_volume));
}
inline void expect_sound(const std::vector<ReducedBody>& bodies) {
  for (const ReducedBody& b : bodies) {
    EXPECT_TRUE(b.position.allFinite() && b.q.allFinite());
    EXPECT_NEAR(b.rotation.norm(), 1.0, 1e-12);
  }
}

/// Steps of at most `dt` until `end`, every state finite.
inline void run_to(Simulation& simulation, double end, double dt,
                   const std::function<void(const StepReport&)>& look = {}) {
  while (simulation.time() < end * (1.0 - 1e-9)) {
    const double left = end - simulation.time();
    const StepReport r = simulation.step(std::min({dt, left, simulation.stable_dt()}));
    ASSERT_NO_FATAL_FAILURE(expect_finite(r));
    if (look) look(r);
  }
  expect_sound(simulation.bodies());
}

}  // namespace archetide
