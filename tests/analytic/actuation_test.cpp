// Actuated bodies in vacuum: momentum, the forced oscillator, work.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <cstdio>

#include "runtime/simulation.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

constexpr double kPi = 3.14159265358979323846;

Actuator actuator_on(const ReducedBody& body, double amplitude, double period, double phase = 0.3) {
  std::vector<int> points;
  for (int v = 0; v < 8; ++v) points.push_back(3 * v);
  return {0,
          std::make_shared<const ActuationPattern>(
              actuation_pattern(*body.archetype, points, {}, true)),
          amplitude, period, phase};
}

Simulation in_vacuum(const ReducedBody& body, const Actuator& actuator, double dt,
                     Scheme scheme = Scheme::kNewmark) {
  SimulationOptions options;
  options.gravity = Vec3::Zero();
  options.max_dt = dt;
  options.wall_contact = false;
  options.scheme = scheme;
  Simulation simulation(options, {}, {body}, {});
  simulation.set_actuators({actuator});
  return simulation;
}

double energy(const ReducedBody& body) { return kinetic_energy(body) + elastic_energy(body); }

// It is pushed about by nothing, spins, and is bent by a fifth of its size, so that the points'
// torque about the centre of mass is far from zero.
TEST(ActuatedBody, KeepsItsMomentaToTheLastBit) {
  const SyntheticBody synthetic = random_archetype(11, 5);
  ReducedBody body = make_body(synthetic.archetype, 5);
  const ConfigurationTerms t =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  body.L = t.inertia * Vec3(1.0, 1.5, -1.2);
  body.P = Vec3(3, -1, 2);
  for (const Scheme scheme : {Scheme::kNewmark, Scheme::kSingle}) {
    Simulation simulation = in_vacuum(body, actuator_on(body, 60.0, 0.7), 0.005, scheme);
    double deformation = 0.0;
    for (int i = 0; i < 1000; ++i)
      deformation = std::max(deformation, simulation.step(0.005).max_deformation);
    const ReducedBody& moved = simulation.bodies()[0];
    EXPECT_EQ(moved.P, body.P);
    EXPECT_EQ(moved.L, body.L);
    EXPECT_GT(deformation, 0.02);
    std::printf("deformation %.3f\n", deformation);
  }
}

// One mode of a body at rest: D = 0 at every q, so M q'' + C q' + K q = f sin(w t + phase) exactly.
class OneMode {
 public:
  explicit OneMode(double alpha, double beta) {
    SyntheticOptions options;
    options.r = 1;
    options.alpha = alpha;
    options.beta = beta;
    synthetic_ = deformable_archetype(box_tets(Vec3(1, 1, 1), Vec3i(2, 2, 2)), options);
    body = make_body(synthetic_.archetype, 1);
    actuator = actuator_on(body, 50.0, 2.0 * kPi / 7.0);  // natural frequency 10 rad/s
    force = 50.0 * actuator.pattern->modal[0];
  }

  // Particular solution plus the damped free vibration that starts it from rest.
  double exact(double t) const {
    using Complex = std::complex<double>;
    const Archetype& a = *synthetic_.archetype;
    const double k = a.K_r(0, 0), c = a.alpha + a.beta * k, w = 7.0;
    const Complex forced = force / Complex(k - w * w, c * w) * std::exp(Complex(0, 0.3));
    const double rate = 0.5 * c, free = std::sqrt(k - rate * rate);
    const double q0 = -forced.imag(), v0 = -(w * forced.real());
    return (forced * std::exp(Complex(0, w * t))).imag() +
           std::exp(-rate * t) *
               (q0 * std::cos(free * t) + (v0 + rate * q0) / free * std::sin(free * t));
  }

  ReducedBody body;
  Actuator actuator;
  double force = 0.0;

 private:
  SyntheticBody synthetic_;
};

TEST(ActuatedBody, OneModeIsTheForcedDampedOscillator) {
  const OneMode mode(0.4, 0.003);
  const auto error = [&](int steps) {
    const double dt = 3.0 / steps;
    Simulation simulation = in_vacuum(mode.body, mode.actuator, dt);
    double worst = 0.0;
    for (int i = 0; i < steps; ++i) {
      simulation.step(dt);
      const double q = simulation.bodies()[0].q[0];
      worst = std::max(worst, std::abs(q - mode.exact(simulation.time())));
    }
    return worst;
  };
  double size = 0.0;
  for (double t = 0.0; t < 3.0; t += 0.01) size = std::max(size, std::abs(mode.exact(t)));
  const double coarse = error(300), fine = error(600);
  std::printf("amplitude %.3g, error %.3e at dt 0.01, %.3e at 0.005, order %.2f\n", size, coarse,
              fine, std::log2(coarse / fine));
  // the trapezoid's period is (w dt)^2 / 12 too long: 8e-4 of 30 rad at w dt = 0.1, and less for
  // the damped part; measured 0.0047
  EXPECT_LE(coarse, 0.025 * size);
  EXPECT_GE(std::log2(coarse / fine), 1.9);
}

TEST(ActuatedBody, WorkOfTheForcesIsTheEnergyGained) {
  // one mode: an identity of the trapezoidal rule with the force at the middle of the step
  const OneMode mode(0.0, 0.0);
  Simulation one = in_vacuum(mode.body, mode.actuator, 0.02);
  double worst = 0.0, most = 0.0;
  for (int i = 0; i < 200; ++i) {
    const StepReport report = one.step(0.02);
    most = std::max(most, std::abs(report.actuation_work));
    worst = std::max(worst, std::abs(energy(one.bodies()[0]) - report.actuation_work));
  }
  EXPECT_GT(most, 0.0);
  EXPECT_LE(worst, 1e-12 * most);  // measured 2e-15

  // several modes of a spinning body, whose inertia changes: second order
  const SyntheticBody synthetic = random_archetype(11, 5);
  ReducedBody body = make_body(synthetic.archetype, 5);
  const ConfigurationTerms t =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  body.L = t.inertia * Vec3(1.0, 1.5, -1.2);
  const auto missing = [&](int steps) {
    Simulation simulation = in_vacuum(body, actuator_on(body, 60.0, 0.7), 1.0 / steps);
    const double start = energy(body);
    double miss = 0.0;
    for (int i = 0; i < steps; ++i) {
      const double work = simulation.step(1.0 / steps).actuation_work;
      miss = std::max(miss, std::abs(energy(simulation.bodies()[0]) - start - work));
    }
    return miss;
  };
  const double coarse = missing(200), fine = missing(400);
  std::printf("energy less work: %.3e J at dt 0.005, %.3e at 0.0025, order %.2f\n", coarse, fine,
              std::log2(coarse / fine));
  EXPECT_GE(std::log2(coarse / fine), 1.8);
}

}  // namespace
}  // namespace archetide
