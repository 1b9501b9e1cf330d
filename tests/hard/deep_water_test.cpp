// Soft bodies under metres of water: what the static pressure works on linear modes.
#include "tests/hard/hard_case.h"

namespace archetide {
namespace {

/// A bar of 0.6 m whose modes bend it to both sides and twist it, none with a change of volume.
SyntheticBody limp_bar() {
  const TetMesh tets = box_tets(Vec3(0.6, 0.12, 0.12), Vec3i(10, 2, 2));
  MatX shapes(3 * static_cast<long>(tets.nodes.size()), 3);
  for (std::size_t n = 0; n < tets.nodes.size(); ++n) {
    const Vec3& x = tets.nodes[n];
    shapes.middleRows<3>(3 * static_cast<long>(n)) << -2.0 * x[0] * x[2], -2.0 * x[0] * x[1], 0.0,
        0.0, x[0] * x[0], -x[0] * x[2],  //
        x[0] * x[0], 0.0, x[0] * x[1];
  }
  constexpr double kFirst = 4.0 * M_PI;  // 2 Hz: Young's modulus of about 1e4 Pa
  return deformable_archetype(tets, 1000.0, shapes, Vec3(kFirst, kFirst, 2.0 * kFirst));
}

// The limp bar, as dense as the water, 1.6 m under its surface, pushed askew at 0.3 m/s: water
// takes its energy, nothing gives any. Where modes swell by the square of their displacement the
// static pressure works on that: without ShapeCorrection it
// gives 7.5 times the start's energy, and the bar stands as if it were stiff.
TEST(DeepWater, TakesTheEnergyOfASoftBody) {
  SimulationOptions o;
  o.grid = {16, 16, 40, 1.0 / 20.0, Vec3::Zero()};
  o.has_water = true;
  o.open_side[kZMax] = true;
  const SyntheticBody shape = limp_bar();
  ReducedBody bar = make_body(shape.archetype, 3);
  bar.position = Vec3(0.4, 0.4, 0.3);
  bar.rotation = Quat(Eigen::AngleAxisd(0.9, Vec3(1.0, 0.3, 0.2).normalized()));
  bar.P = body_mass(bar) * Vec3(0.0, 0.0, 0.3);
  bar.q[0] = 0.1;
  const double start = kinetic_energy(bar) + elastic_energy(bar);
  Simulation s(o, water_to(o.grid, 1.9), {bar}, {});
  double most = 0.0, deformed = 0.0;
  int steps = 0;
  run_to(s, 0.6, 0.02, [&](const StepReport& r) {
    most = std::max(most, r.body_kinetic + r.body_elastic);
    deformed = std::max(deformed, r.max_deformation);
    ++steps;
  });
  std::printf("measured: steps = %d, deformation %.3f\n", steps, deformed);
  expect_at_most("energy against that of the start", most / start, 1.0);
}

}  // namespace
}  // namespace archetide
