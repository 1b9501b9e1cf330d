// Soft bodies under metres of water: what the static pressure works on linear modes.
#include "tests/hard/hard_case.h"

namespace archetide {
namespace {

// A ring as dense as the water and so soft that its first mode swings at 2 Hz (E of about 1e4 Pa),
// 1.6 m under the surface, pushed at 0.3 m/s: water takes its energy, nothing gives any. Modes that
// swell by the second order of their displacement make 10 times as much out of the pressure
// (without ShapeCorrection: measured 31 times, and steps of a third).
TEST(DeepWater, TakesTheEnergyOfASoftBody) {
  SimulationOptions o;
  o.grid = {16, 16, 40, 1.0 / 20.0, Vec3::Zero()};
  o.open_side[kZMax] = true;
  SyntheticOptions shape;
  shape.r = 8;
  shape.first_omega = 2.0 * M_PI * 2.0;
  ReducedBody ring =
      make_body(deformable_archetype(torus_tets(0.18, 0.06, 16, 2), shape).archetype, 8);
  ring.position = Vec3(0.4, 0.4, 0.3);
  ring.rotation = Quat(Eigen::AngleAxisd(1.2, Vec3(1.0, 0.3, 0.0).normalized()));
  ring.P = body_mass(ring) * Vec3(0.0, 0.0, 0.3);
  const double start = kinetic_energy(ring);
  Simulation s(o, water_to(o.grid, 1.9), {ring}, {});
  double most = 0.0, deformed = 0.0;
  int steps = 0;
  run_to(s, 0.6, 0.02, [&](const StepReport& r) {
    most = std::max(most, r.body_kinetic + r.body_elastic);
    deformed = std::max(deformed, r.max_deformation);
    ++steps;
  });
  expect_at_most("energy against that of the push", most / start, 1.0);
  expect_at_most("deformation", deformed, 0.1);
  std::printf("measured: steps = %d\n", steps);
}

}  // namespace
}  // namespace archetide
