// Bodies that meet nothing: conservation, order of accuracy, limits.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/dry_body.h"
#include "tests/support/dry_cases.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

/// Spins at about 2 rad/s around no principal axis while modes of 10 rad/s and up vibrate by some
/// per cent.
ReducedBody spinning_body(const SyntheticBody& synthetic, double amplitude) {
  const int r = synthetic.archetype->r();
  ReducedBody body = make_body(synthetic.archetype, r);
  const ConfigurationTerms t =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  body.rotation = Quat(0.8, 0.3, -0.2, 0.4).normalized();
  body.L = t.inertia * Vec3(1.0, 1.5, -1.2);
  body.P = Vec3(3, -1, 2);
  body.q = amplitude * VecX::LinSpaced(r, 1.0, -0.5);
  body.q_dot = 10.0 * amplitude * VecX::LinSpaced(r, -0.3, 0.8);
  return body;
}

/// Largest displacement of a surface point over the distance of the farthest one.
double deformation(const ReducedBody& body) {
  const VecX u = body.archetype->surface_modes.leftCols(body.r) * body.q;
  double moved = 0.0, size = 0.0;
  for (std::size_t v = 0; v < body.archetype->surface.vertices.size(); ++v) {
    moved = std::max(moved, u.segment<3>(3 * v).norm());
    size = std::max(size, body.archetype->surface.vertices[v].norm());
  }
  return moved / size;
}

double energy(const ReducedBody& body) { return kinetic_energy(body) + elastic_energy(body); }

/// Largest |E - E0| / E0 over `duration` seconds.
double energy_error(ReducedBody body, double duration, double dt, const ModalOptions& options) {
  const double start = energy(body);
  double worst = 0.0;
  for (int i = 0; i < std::lround(duration / dt); ++i) {
    dry_steps(body, 1, dt, options);
    worst = std::max(worst, std::abs(energy(body) - start) / start);
  }
  return worst;
}

TEST(FreeMotion, EnergyErrorFallsWithTheStepForTheExactModalMassOnly) {
  const SyntheticBody synthetic = random_archetype(11, 5);
  const ReducedBody body = spinning_body(synthetic, 0.25);
  std::printf("deformation %.3f\n      dt     exact mass   order   paper's mass\n",
              deformation(body));
  double previous = 0.0, exact = 0.0, paper = 0.0;
  for (int halving = 0; halving <= 3; ++halving) {
    const double dt = 0.004 / (1 << halving);
    exact = energy_error(body, 2.0, dt, {ModalStep::kTrapezoid, ModalMass::kExact});
    paper = energy_error(body, 2.0, dt, {ModalStep::kTrapezoid, ModalMass::kPaper});
    const double order = halving > 0 ? std::log2(previous / exact) : NAN;
    std::printf("%9.6f  %11.3e  %6.2f  %11.3e\n", dt, exact, order, paper);
    if (halving > 0) {
      EXPECT_GE(order, 1.8);
    }
    previous = exact;
  }
  // what is left of the paper's mass is the model's error, O(q²), not the step's
  EXPECT_GE(paper, 20.0 * exact);
}

TEST(FreeMotion, SolutionIsSecondOrderInTheStep) {
  const SyntheticBody synthetic = random_archetype(11, 4);
  const ReducedBody start = spinning_body(synthetic, 0.2);
  VecX force = VecX::Zero(start.dofs());
  force << 5, -3, 2, 0.5, 0.2, -0.4, 20, -10, 5, 10;
  const auto run = [&](int steps) {
    ReducedBody body = start;
    for (int i = 0; i < steps; ++i) dry_step(body, force, 1.0 / steps, ModalOptions{});
    VecX out(7 + 2 * body.r);
    out << body.position, body.rotation.coeffs(), body.q, 0.1 * body.q_dot;
    return out;
  };
  const VecX reference = run(8000);
  const double coarse = (run(200) - reference).norm(), fine = (run(400) - reference).norm();
  EXPECT_LE(coarse, 1e-2);
  EXPECT_GE(std::log2(coarse / fine), 1.9);  // measured 2.01
}

struct Vacuum : ::testing::TestWithParam<ModalStep> {};

TEST_P(Vacuum, TorusKeepsItsMomentaAndBoundsItsEnergy) {
  SyntheticOptions options;
  options.r = 10;
  options.seed = 5;
  const SyntheticBody torus = deformable_archetype(torus_tets(0.5, 0.1, 24, 2), options);
  ReducedBody body = spinning_body(torus, 0.15);
  const Vec3 P = body.P, L = body.L;
  const double start = energy(body);
  double lowest = start, highest = start;
  for (int i = 0; i < 1000; ++i) {
    dry_steps(body, 1, 0.01, {GetParam(), ModalMass::kExact});
    lowest = std::min(lowest, energy(body));
    highest = std::max(highest, energy(body));
  }
  EXPECT_LE((body.P - P).norm(), 1e-12 * P.norm());
  EXPECT_LE((body.L - L).norm(), 1e-12 * L.norm());
  EXPECT_NEAR(body.rotation.norm(), 1.0, 1e-14);
  std::printf("deformation %.3f, energy in [%.4f, %.4f] of the start\n", deformation(body),
              lowest / start, highest / start);
  EXPECT_LE(highest, 1.02 * start);
  if (GetParam() == ModalStep::kTrapezoid) {
    EXPECT_GE(lowest, 0.98 * start);
  }
}
INSTANTIATE_TEST_SUITE_P(BothSteps, Vacuum,
                         ::testing::Values(ModalStep::kTrapezoid, ModalStep::kBackwardEuler));

// Torque-free I = diag(1, 2, 3), ω(0) = (1e-3, 1, 1e-3): body-frame spin at t = 20 from an accurate
// integrator.
TEST(FreeMotion, TumblingRigidBodyConvergesToTheReferenceSpin) {
  const Vec3 expected(-0.105321008, -0.994438779, 0.06081259389);
  const double coarse = (tumbling_spin(20.0, 2000) - expected).norm();
  const double fine = (tumbling_spin(20.0, 4000) - expected).norm();
  std::printf("error %.3e at dt 0.01, %.3e at 0.005, order %.2f\n", coarse, fine,
              std::log2(coarse / fine));
  EXPECT_LE(fine, 1e-4);
  EXPECT_GE(std::log2(coarse / fine), 1.9);
}

TEST(Vibration, TrapezoidKeepsTheAmplitudeAndHasItsClosedFormFrequency) {
  // ratio 2 atan(ω dt / 2) / (ω dt); 0.9991679144 at 0.1 and 0.9799146525 at 0.5
  for (double x : {0.01, 0.1, 0.5, 2.0}) {
    const Vibration v = measured_vibration(x, ModalStep::kTrapezoid);
    EXPECT_NEAR(v.amplitude_per_period, 1.0, 1e-11 / x);  // measured 2e-12
    EXPECT_NEAR(v.frequency_ratio, 2.0 * std::atan(0.5 * x) / x, 1e-11 / x);
  }
  EXPECT_NEAR(measured_vibration(0.5, ModalStep::kTrapezoid).frequency_ratio, 0.9799146525, 1e-9);
}

TEST(Vibration, TwoStageBackwardEulerHasItsClosedFormDamping) {
  for (double x : {0.01, 0.1, 0.5}) {
    const Vibration v = measured_vibration(x, ModalStep::kBackwardEuler);
    const Vibration exact = exact_vibration(x, ModalStep::kBackwardEuler);
    EXPECT_NEAR(v.amplitude_per_period, exact.amplitude_per_period, 1e-11 / x);
    EXPECT_NEAR(v.frequency_ratio, exact.frequency_ratio, 1e-10 / x);
  }
  EXPECT_NEAR(measured_vibration(0.1, ModalStep::kBackwardEuler).amplitude_per_period, 0.855, 1e-3);
}

TEST(Vibration, RayleighDampingDecaysAtItsRate) {
  SyntheticOptions options;
  options.r = 1;
  options.alpha = 0.3;
  options.beta = 0.004;
  const SyntheticBody synthetic =
      deformable_archetype(box_tets(Vec3(1, 1, 1), Vec3i(2, 2, 2)), options);
  ReducedBody body = make_body(synthetic.archetype, 1);
  body.q[0] = 0.1;
  // decay exp(−(α + β ω²) t / 2), ω = 10: over t = 2 s by exp(−0.7); measured error 8e-8
  const double start = energy(body);
  dry_steps(body, 20000, 1e-4, ModalOptions{});
  const double rate = 0.5 * (0.3 + 0.004 * 100.0), damped = std::sqrt(100.0 - rate * rate);
  const double q = 0.1 * std::exp(-rate * 2.0) *
                   (std::cos(damped * 2.0) + rate / damped * std::sin(damped * 2.0));
  EXPECT_NEAR(body.q[0], q, 1e-6);
  EXPECT_LT(energy(body), start);
}

TEST(FreeMotion, StiffBodyMovesAsTheRigidOne) {
  SyntheticOptions options;
  options.r = 5;
  options.first_omega = 1e6;  // 10 rad/s at 1 kPa is 1e6 rad/s at 1e13 Pa
  const SyntheticBody synthetic =
      deformable_archetype(blob_tets(3, Vec3(0.5, 0.4, 0.3), Vec3i(3, 3, 3)), options);
  ReducedBody stiff = spinning_body(synthetic, 0.0);
  ReducedBody rigid = stiff;
  rigid.r = 0;
  rigid.q.resize(0);
  rigid.q_dot.resize(0);
  dry_steps(stiff, 500, 0.01, ModalOptions{});
  dry_steps(rigid, 500, 0.01, ModalOptions{});
  EXPECT_LE((stiff.position - rigid.position).norm(), 1e-12);
  // displacement is of order (spin/ω)² = 4e-12, and so is the change of the path; measured
  // 7e-12
  EXPECT_LE(stiff.rotation.angularDistance(rigid.rotation), 1e-8);
  EXPECT_LE(stiff.q.norm(), 1e-9);
}

TEST(FreeMotion, MassScaleIsTheSameAsAHeavierMaterial) {
  SyntheticOptions light, heavy;
  light.r = heavy.r = 3;
  light.alpha = heavy.alpha = 0.2;
  heavy.density = 2.5 * light.density;
  // modes are normalised to 1 kg: the heavier material has φ / √2.5 and, at equal stiffness, ω²
  // / 2.5
  heavy.first_omega = light.first_omega / std::sqrt(2.5);
  const TetMesh tets = blob_tets(4, Vec3(0.5, 0.4, 0.3), Vec3i(3, 2, 2));
  const SyntheticBody a = deformable_archetype(tets, light), b = deformable_archetype(tets, heavy);
  ReducedBody scaled = spinning_body(a, 0.1);
  scaled.mass_scale = 2.5;
  ReducedBody made = make_body(b.archetype, 3);
  made.rotation = scaled.rotation;
  made.P = scaled.P;
  made.L = scaled.L;
  made.q = std::sqrt(2.5) * scaled.q;
  made.q_dot = std::sqrt(2.5) * scaled.q_dot;
  EXPECT_NEAR(energy(scaled), energy(made), 1e-12 * energy(made));
  dry_steps(scaled, 100, 0.01, ModalOptions{});
  dry_steps(made, 100, 0.01, ModalOptions{});
  EXPECT_LE((scaled.position - made.position).norm(), 1e-12);
  EXPECT_LE(scaled.rotation.angularDistance(made.rotation), 1e-10);
  EXPECT_LE((std::sqrt(2.5) * scaled.q - made.q).norm(), 1e-11);
}

TEST(FreeMotion, ConstantForceChangesMomentaByExactlyForceTimesTime) {
  const SyntheticBody synthetic = random_archetype(11, 4);
  ReducedBody body = spinning_body(synthetic, 0.1);
  VecX force = VecX::Zero(body.dofs());
  force << 1, 2, 3, 0.1, -0.2, 0.3, 5, 5, 5, 5;
  const Vec3 P = body.P, L = body.L;
  for (int i = 0; i < 64; ++i) dry_step(body, force, 1.0 / 64, ModalOptions{});
  EXPECT_LE((body.P - P - force.head<3>()).norm(), 1e-13);
  EXPECT_LE((body.L - L - force.segment<3>(3)).norm(), 1e-13);
}

TEST(FreeMotion, SpinBeyondTheFirstFrequencyStaysFinite) {
  const SyntheticBody synthetic = random_archetype(11, 4);
  ReducedBody body = spinning_body(synthetic, 0.1);
  body.L *= 10.0;  // 20 rad/s against 10
  dry_steps(body, 200, 0.01, ModalOptions{});
  EXPECT_TRUE(body.q.allFinite());
  EXPECT_TRUE(body.rotation.coeffs().allFinite());
}

}  // namespace
}  // namespace archetide
