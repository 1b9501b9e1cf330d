// How a body bends under its own weight and in an impact, against closed forms.
#include "runtime/solid/support_response.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

constexpr double kLength = 0.8, kWidth = 0.2;  // m, of a bar along x
constexpr double kOmega = 30.0;                // rad/s, of its only mode
constexpr double kGravity = 9.81;              // m/s^2
constexpr double kRoundOff = 1e-12;            // relative; measured 4e-16 to 3e-15

ReducedBody body_of(std::shared_ptr<const Archetype> archetype) {
  ReducedBody body;
  body.r = archetype->r();
  body.archetype = std::move(archetype);
  return body;
}

/// A bar that can only stretch evenly: S_x = x sqrt(12 / (m L^2)), so that it carries 1 kg. Where
/// it stands on its end c = -sqrt(3 / m), and the end opposite moves as far.
std::shared_ptr<Archetype> stretching_bar(double omega = kOmega) {
  const TetMesh tets = box_tets(Vec3(kLength, kWidth, kWidth), Vec3i(4, 1, 1));
  MatX stretch = MatX::Zero(3 * static_cast<Eigen::Index>(tets.nodes.size()), 1);
  for (std::size_t v = 0; v < tets.nodes.size(); ++v)
    stretch(3 * static_cast<Eigen::Index>(v), 0) = tets.nodes[v][0];
  return deformable_archetype(tets, 500.0, stretch, VecX::Constant(1, omega)).archetype;
}

double radius() { return 0.5 * std::sqrt(kLength * kLength + 2.0 * kWidth * kWidth); }

SupportResponse on_its_end(const ReducedBody& body) {
  return support_response(body, body.rotation * Vec3::UnitX());
}

TEST(SupportResponse, AStandingBarIsThatOfTheClosedForm) {
  const ReducedBody bar = body_of(stretching_bar());
  const double m = bar.archetype->integrals.mass;
  const SupportResponse s = on_its_end(bar);
  const double compliance = 3.0 / (m * kOmega * kOmega);
  EXPECT_NEAR(s.mass, m, kRoundOff * m);
  EXPECT_NEAR(s.mobility, 3.0 / m, kRoundOff * 3.0 / m);
  EXPECT_NEAR(s.compliance, compliance, kRoundOff * compliance);
  EXPECT_NEAR(s.deformation, compliance / radius(), kRoundOff * compliance / radius());
  EXPECT_NEAR(s.height, kLength / radius(), kRoundOff);
  EXPECT_NEAR(s.area, kWidth * kWidth, kRoundOff);
}

// The mode's own load under weight is c m g: delta = 3 g / omega^2.
TEST(SupportResponse, TheWeightOfAStandingBarShortensItAsItsSpringDoes) {
  const double expected = 3.0 * kGravity / (kOmega * kOmega) / radius();
  EXPECT_NEAR(resting_deformation(on_its_end(body_of(stretching_bar())), kGravity), expected,
              kRoundOff);
}

// m_s times the mobility is 3: three quarters of m v^2 / 2 stay, and k = m omega^2 / 3.
TEST(SupportResponse, AnImpactLeavesTheEnergyOfAPlasticOne) {
  const double v = 0.7;
  const SupportResponse s = on_its_end(body_of(stretching_bar()));
  EXPECT_NEAR(impact_deformation(s, v, INFINITY), 1.5 * v / (kOmega * radius()), kRoundOff);
}

// On as much mass as the bar's own: m / 2 is left, of whose energy 3/2 / (1 + 3/2) stays.
TEST(SupportResponse, WhatGivesWayIsStruckWithTheReducedMass) {
  const double v = 0.7;
  const ReducedBody bar = body_of(stretching_bar());
  EXPECT_NEAR(impact_deformation(on_its_end(bar), v, body_mass(bar)),
              3.0 * std::sqrt(0.1) * v / (kOmega * radius()), kRoundOff);
  EXPECT_EQ(impact_deformation(on_its_end(bar), v, 0.0), 0.0);
}

TEST(SupportResponse, FallsWithTheStiffnessUnderWeightAndWithItsRootInImpacts) {
  const SupportResponse soft = on_its_end(body_of(stretching_bar(kOmega))),
                        stiff = on_its_end(body_of(stretching_bar(2.0 * kOmega)));  // 4 E
  EXPECT_NEAR(resting_deformation(soft, kGravity), 4.0 * resting_deformation(stiff, kGravity),
              kRoundOff);
  EXPECT_NEAR(impact_deformation(soft, 1.0, INFINITY),
              2.0 * impact_deformation(stiff, 1.0, INFINITY), kRoundOff);
}

TEST(SupportResponse, GrowsWithWeightAndSpeedInProportion) {
  const SupportResponse s = on_its_end(body_of(stretching_bar()));
  EXPECT_EQ(resting_deformation(s, 0.0), 0.0);
  EXPECT_EQ(impact_deformation(s, 0.0, INFINITY), 0.0);
  EXPECT_NEAR(resting_deformation(s, 3.0), 3.0 * resting_deformation(s, 1.0), kRoundOff);
  EXPECT_NEAR(impact_deformation(s, 0.9, INFINITY), 3.0 * impact_deformation(s, 0.3, INFINITY),
              kRoundOff);
  ReducedBody dense = body_of(stretching_bar());
  dense.mass_scale = 2.0;
  EXPECT_NEAR(resting_deformation(on_its_end(dense), 1.0), 2.0 * resting_deformation(s, 1.0),
              kRoundOff);
}

TEST(SupportResponse, IsThatOfTheRestFrameWhereverTheBodyTurns) {
  ReducedBody bar = body_of(stretching_bar());
  const SupportResponse before = on_its_end(bar);
  bar.rotation = Quat(Eigen::AngleAxisd(0.7, Vec3(1, -2, 3).normalized()));
  const SupportResponse after = on_its_end(bar);
  EXPECT_NEAR(after.deformation, before.deformation, kRoundOff);
  EXPECT_NEAR(after.mobility, before.mobility, kRoundOff);
  // Flat on a side the mode meets no push: what the one half takes the other gives.
  EXPECT_NEAR(support_response(bar, bar.rotation * Vec3::UnitZ()).deformation, 0.0, kRoundOff);
}

// No point sinks below the floor.
TEST(SupportResponse, NeverExceedsTheHeightOfTheBody) {
  const SupportResponse limp = on_its_end(body_of(stretching_bar(0.1)));
  EXPECT_DOUBLE_EQ(resting_deformation(limp, kGravity), limp.height);
  EXPECT_DOUBLE_EQ(impact_deformation(limp, 9.0, INFINITY), limp.height);
}

// On a corner of a block: n^T J H^-1 J^T n is what the coupled solve would find there.
TEST(SupportResponse, ACornerMovesAsTheGeneralisedMassSays) {
  SyntheticOptions options;
  options.r = 3;
  ReducedBody body = body_of(
      deformable_archetype(box_tets(Vec3(0.5, 0.4, 0.3), Vec3i(1, 1, 1)), options).archetype);
  body.q = body.q_dot = VecX::Zero(body.r);
  body.mass_scale = 0.6;
  body.rotation = Quat(Eigen::AngleAxisd(0.4, Vec3(3, 2, 1).normalized()));
  const Vec3 up = body.rotation * Vec3(1.0, 1.1, 1.2).normalized();
  int lowest = 0;
  for (int v = 1; v < static_cast<int>(body.archetype->surface.vertices.size()); ++v)
    if (up.dot(surface_point(body, v)) < up.dot(surface_point(body, lowest))) lowest = v;
  const ConfigurationTerms terms =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  const GeneralisedMass H =
      generalised_mass(body, terms, 0.0, Stage::kVelocityFull, ModalStep::kTrapezoid);
  const VecX push = point_jacobian(body, terms, lowest).transpose() * up;
  const double expected = push.dot(H.solve(push));  // 1/kg
  const SupportResponse s = support_response(body, up);
  EXPECT_NEAR(1.0 / s.mass + s.mobility, expected, 1e-10 * expected);  // measured 1e-15
  EXPECT_GT(s.mobility, 0.1 / s.mass);                                 // the modes do count
}

TEST(SupportResponse, ARigidBodyDoesNotDeform) {
  ReducedBody body = body_of(stretching_bar());
  body.r = 0;
  const SupportResponse s = on_its_end(body);
  EXPECT_EQ(resting_deformation(s, kGravity), 0.0);
  EXPECT_EQ(impact_deformation(s, 5.0, INFINITY), 0.0);
}

// 4/3 rho a^3 of a disc of the same area [Kar29].
TEST(SupportResponse, ASlamMovesTheWaterBelowADisc) {
  SupportResponse s;
  s.area = M_PI * 0.2 * 0.2;
  EXPECT_NEAR(slammed_water(s, 1000.0), 4.0 / 3.0 * 1000.0 * 0.008, 1e-10);
}

}  // namespace
}  // namespace archetide
