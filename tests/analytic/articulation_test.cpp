// Jointed bodies without water against reference trajectories.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "runtime/simulation.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

constexpr double kGravity = 9.81, kLength = 0.5, kWidth = 0.02;

/// A rod along z, ends at +-kLength/2.
std::shared_ptr<const Archetype> rod() {
  static const auto shape =
      rigid_surface_archetype(box_surface(Vec3(kWidth, kWidth, kLength), 0), 1000.0);
  return shape;
}

/// Rods hanging from each other and from the origin, turned by the angles about y (from the vertical).
struct Chain {
  std::vector<ReducedBody> bodies;
  std::vector<Joint> joints;
};
Chain hanging_chain(const std::vector<double>& angles, double last_mass = 1.0, int points = 1) {
  Chain chain;
  Vec3 top = Vec3::Zero();
  for (std::size_t k = 0; k < angles.size(); ++k) {
    ReducedBody body = make_body(rod(), 0);
    body.rotation = Eigen::AngleAxisd(-angles[k], Vec3::UnitY());
    const Vec3 down = body.rotation * Vec3(0, 0, -kLength);
    body.position = top + 0.5 * down;
    if (k + 1 == angles.size()) body.mass_scale = last_mass;
    chain.bodies.push_back(body);
    top += down;
  }
  for (int k = 0; k < static_cast<int>(angles.size()); ++k) {
    std::vector<Vec3> at = {Vec3(0, 0, 0.5 * kLength)};
    if (points >= 2) at.push_back(Vec3(0, 0.5 * kWidth, 0.5 * kLength));
    if (points >= 3) at.push_back(Vec3(0, -0.5 * kWidth, 0.5 * kLength));
    chain.joints.push_back(make_joint(chain.bodies, k, k - 1, at));
  }
  return chain;
}

Simulation dry(const Chain& chain, Scheme scheme = Scheme::kNewmark) {
  SimulationOptions o;
  o.gravity = Vec3(0, 0, -kGravity);
  o.scheme = scheme;
  return Simulation(o, FluidState(), chain.bodies, {}, {}, chain.joints);
}

/// Angles of a plane chain of equal rods, by Lagrange's equations and the classical Runge-Kutta method
/// (step 1e-5 s: error below 1e-12). Independent of the program.
VecX reference_angles(const std::vector<double>& start, double seconds, double last_mass = 1.0) {
  const auto n = static_cast<long>(start.size());
  const double m = 1000.0 * kWidth * kWidth * kLength;
  const double inertia = m / 12.0 * (kLength * kLength + kWidth * kWidth);
  MatX weight = MatX::Zero(n, n);  // sum_k m_k a_ki a_kj
  VecX load = VecX::Zero(n), own = VecX::Constant(n, inertia);
  own[n - 1] *= last_mass;
  for (long k = 0; k < n; ++k) {
    const double m_k = k + 1 == n ? last_mass * m : m;
    VecX a = VecX::Zero(n);
    a.head(k).setConstant(kLength);
    a[k] = 0.5 * kLength;
    weight += m_k * a * a.transpose();
    load += m_k * kGravity * a;
  }
  const auto rate = [&](const VecX& s) {
    const VecX angle = s.head(n), w = s.tail(n);
    MatX M(n, n);
    VecX f(n);
    for (long i = 0; i < n; ++i) {
      f[i] = -load[i] * std::sin(angle[i]);
      for (long j = 0; j < n; ++j) {
        M(i, j) = weight(i, j) * std::cos(angle[i] - angle[j]) + (i == j ? own[i] : 0.0);
        f[i] -= weight(i, j) * std::sin(angle[i] - angle[j]) * w[j] * w[j];
      }
    }
    VecX out(2 * n);
    out << w, M.ldlt().solve(f);
    return out;
  };
  VecX s = VecX::Zero(2 * n);
  for (long k = 0; k < n; ++k) s[k] = start[static_cast<std::size_t>(k)];
  const auto steps = static_cast<long>(std::lround(seconds / 1e-4));
  const double h = seconds / static_cast<double>(steps);
  for (long k = 0; k < steps; ++k) {
    const VecX a = rate(s), b = rate(s + 0.5 * h * a), c = rate(s + 0.5 * h * b),
               d = rate(s + h * c);
    s += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
  }
  return s.head(n);
}

/// Where rod k's centre is at these angles.
Vec3 centre_of(const VecX& angles, long k) {
  Vec3 top = Vec3::Zero();
  const auto down = [&](long i) {
    return Vec3(kLength * std::sin(angles[i]), 0, -kLength * std::cos(angles[i]));
  };
  for (long i = 0; i < k; ++i) top += down(i);
  return top + 0.5 * down(k);
}

struct Outcome {
  double error = 0.0;  // largest distance from the reference, of the length of a rod
  double drift = 0.0;  // largest gap of a joint, of that too
  double energy = 0.0;
};
Outcome run_against_reference(const std::vector<double>& angles, double seconds, double dt,
                          Scheme scheme = Scheme::kNewmark) {
  Simulation s = dry(hanging_chain(angles), scheme);
  Outcome run;
  double start = NAN;
  const auto steps = std::lround(seconds / dt);
  for (long n = 0; n < steps; ++n) {
    const StepReport r = s.step(dt);
    run.drift = std::max(run.drift, r.joint_drift / kLength);
    const double energy = r.body_kinetic + r.potential;
    if (n == 0) start = energy;
    run.energy = energy - start;
  }
  const VecX exact = reference_angles(angles, seconds);
  for (long k = 0; k < exact.size(); ++k)
    run.error = std::max(run.error,
                         (s.bodies()[k].position - centre_of(exact, k)).norm() / kLength);
  return run;
}

TEST(JointedRods, FollowTheReferenceWithSecondOrder) {
  const std::vector<std::vector<double>> cases = {
      {1.2}, {0.9, 1.4}, {0.5, 0.7, 0.9, 1.1, 1.3, 1.5}};
  for (const std::vector<double>& angles : cases) {
    double before = 0.0, order = 0.0;
    for (const double dt : {0.01, 0.005, 0.0025}) {
      const Outcome run = run_against_reference(angles, 1.0, dt);
      order = before > 0.0 ? std::log2(before / run.error) : 0.0;
      std::printf("%zu rods, dt %.4f: error %.2e, order %.2f, gap %.1e, energy %+.1e J\n",
                  angles.size(), dt, run.error, order, run.drift, run.energy);
      EXPECT_LE(run.drift, 1e-11);
      before = run.error;
    }
    EXPECT_GE(order, 1.8);
  }
}

}  // namespace
}  // namespace archetide
