// What a scene foretells of the deformation of its bodies.
#include "runtime/scene/deformation_forecast.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include "runtime/scene/parse_scene.h"
#include "runtime/scene/scene_builder.h"
#include "scene_test_support.h"
#include "tests/support/dry_body.h"

namespace archetide {
namespace {

const std::string kForecastHead = "schema = 1\ntime = { end = 1.0 }\n";
const std::string kTank = "[fluid]\ngrid = [32, 32, 32]\ncell = 0.25\nwater = { level = 0 }\n";

std::string body_at(double x, double z, const std::string& more = "") {
  return fmt::format("[[body]]\narchetype = \"tetra\"\nposition = [{:f}, 4, {:f}]\n{}", x, z, more);
}

class Forecast : public testing::Test {
 protected:
  void SetUp() override { write(1.0); }

  void write(double stiffness) const {
    Archetype a = tetrahedron_archetype("tetra");
    a.omega2 *= stiffness, a.K_r *= stiffness;
    write_archetype(folder_ / "tetra.h5", a);
  }
  BuiltScene build(const std::string& text) const {
    folder_.write("s.scene.toml", kForecastHead + text);
    ArchetypeLibrary library(folder_.path(), folder_.path());
    return build_scene(parse_scene(folder_ / "s.scene.toml"), library);
  }

  ScratchFolder folder_;
};

TEST_F(Forecast, TheWorstBodyOfAKindCountsInAnyOrder) {
  const std::string low = body_at(2, 1), high = body_at(4, 5),
                    heavy = body_at(6, 0.5, "density = 900\n");
  const auto one = build(kTank + low + high + heavy).forecasts;
  const auto other = build(kTank + heavy + high + low).forecasts;
  ASSERT_EQ(one.size(), 1u);
  ASSERT_EQ(other.size(), 1u);
  EXPECT_EQ(forecast_text(one[0]), forecast_text(other[0]));
  EXPECT_EQ(one[0].weight, build(kTank + heavy).forecasts.at(0).weight);
  EXPECT_EQ(one[0].impact, build(kTank + high).forecasts.at(0).impact);
  EXPECT_GT(one[0].impact, build(kTank + low).forecasts.at(0).impact);
  EXPECT_GT(one[0].weight, build(kTank + low).forecasts.at(0).weight);
}

TEST_F(Forecast, RigidBodiesHaveNone) {
  EXPECT_TRUE(build(kTank + body_at(4, 5, "modes = 0\n")).forecasts.empty());
}

TEST_F(Forecast, WithoutGravityAndMotionThereIsNone) {
  const BuiltScene built = build("gravity = [0, 0, 0]\n" + kTank + body_at(4, 5));
  EXPECT_EQ(built.forecasts.at(0).largest(), 0.0);
  EXPECT_EQ(forecast_text(built.forecasts[0]), "tetra: none under its weight or in its first fall");
}

TEST_F(Forecast, SoftBodiesAreNotedAndStiffOnesAreNot) {
  write(1e-4);
  const BuiltScene soft = build(kTank + body_at(4, 5));
  ASSERT_EQ(soft.notes.size(), 1u);
  EXPECT_GT(soft.forecasts.at(0).impact, kModesTell);
  expect_contains(soft.notes[0], "deformation: tetra may deform by up to");
  expect_contains(soft.notes[0], "modes = 0 (rigid)");
  write(1e4);
  const BuiltScene stiff = build(kTank + body_at(4, 5));
  EXPECT_TRUE(stiff.notes.empty());
  EXPECT_LT(stiff.forecasts.at(0).impact, kModesTell);
}

// Light bodies that fall on a corner: the water gives way more than another of them does.
TEST_F(Forecast, InACrowdTheyFallOnEachOther) {
  const auto scattered = [&](int count, const std::string& bodies) {
    return build(fmt::format(
                     "[fluid]\ngrid = [32, 32, 32]\ncell = 0.25\nwater = {{ level = 2 }}\n"
                     "[contact]\nbodies = {}\n[[scatter]]\narchetype = \"tetra\"\ncount = {}\n"
                     "box = [[2, 2, 5], [6, 6, 5]]\n",
                     bodies, count))
        .forecasts.at(0);
  };
  const DeformationForecast crowd = scattered(2, "true"), apart = scattered(2, "false");
  EXPECT_EQ(crowd.on, FallsOn::kBody);
  EXPECT_EQ(apart.on, FallsOn::kWater);
  EXPECT_GT(crowd.impact, apart.impact);
  EXPECT_EQ(scattered(1, "true").on, FallsOn::kWater);
}

// 1.2 m of water press with 11.8 kPa.
TEST(BeyondPressure, SoftBodiesDeepUnderWaterAreNoted) {
  SimulationOptions o;
  o.grid = {8, 8, 16, 0.1, Vec3::Zero()};
  o.has_water = true;
  o.reference_point = Vec3(0, 0, 1.2);
  auto shape = std::make_shared<Archetype>(tetrahedron_archetype("noodle"));
  shape->poisson = 0.4;  // bulk modulus: 1.67 times Young's
  const auto note = [&](double young, int modes) {
    shape->young = young;
    return beyond_pressure(make_body(shape, modes), o);
  };
  expect_contains(note(5e4, shape->r()),
                  "pressure: the water presses on noodle with up to 1.2e+04 Pa, Young's modulus is "
                  "5e+04 Pa: it loses 13 % of its volume");
  EXPECT_EQ(note(2e5, shape->r()), "");
  EXPECT_EQ(note(5e4, 0), "");  // rigid
  o.gravity.setZero();
  EXPECT_EQ(note(5e4, shape->r()), "");
}

TEST(ForecastText, SaysWeightImpactAndLimit) {
  DeformationForecast f{.archetype = "ring", .weight = 0.031, .impact = 0.24, .speed = 3.14};
  EXPECT_EQ(
      forecast_text(f),
      "ring: 3.1 % under its weight, 24 % in the impact at 3.1 m/s on the floor (modes tell to "
      "30 %)");
  EXPECT_EQ(beyond_modes(f), "");
  f.impact = 0.31, f.on = FallsOn::kWater;
  expect_contains(
      beyond_modes(f),
      "ring may deform by up to 31 % of its radius in the impact at 3.1 m/s on the water");
  f.weight = 0.5;
  expect_contains(beyond_modes(f), "50 % of its radius under its weight");
}

TEST(ForecastText, NonlinearModesHaveNoLimit) {
  const DeformationForecast f{.archetype = "ring", .nonlinear = true, .impact = 0.6, .speed = 5};
  EXPECT_EQ(forecast_text(f), "ring: 60 % in the impact at 5 m/s on the floor (nonlinear modes)");
  EXPECT_EQ(beyond_modes(f), "");
}

}  // namespace
}  // namespace archetide
