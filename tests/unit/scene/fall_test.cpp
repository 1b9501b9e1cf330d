// What a body meets on its way down, and how fast, against closed forms.
#include "runtime/scene/fall.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cmath>

#include "runtime/scene/parse_scene.h"
#include "runtime/scene/scene_builder.h"
#include "scene_test_support.h"

namespace archetide {
namespace {

constexpr double kG = 9.81;            // m/s^2
constexpr double kLowest = 0.25;       // m, of the tetrahedron below its centre
constexpr double kVolume = 1.0 / 6.0;  // m^3
// kNear of the way to the water: a thousandth of a cell of 0.25 m, relative to ways of 1 m.
constexpr double kNear = 3e-4;

class FallTest : public testing::Test {
 protected:
  FallTest() { write_archetype(folder_ / "tetra.h5", tetrahedron_archetype("tetra")); }

  /// Of a tetrahedron in a tank of 4 m x 4 m x `layers` cells of 0.25 m; `more`: keys of its body.
  Fall fall(const std::string& head, const std::string& water, const std::string& more,
            int layers = 16) const {
    folder_.write(
        "s.scene.toml",
        fmt::format("schema = 1\ntime = {{ end = 1.0 }}\n{}\n[fluid]\ngrid = [16, 16, {}]\n"
                    "cell = 0.25\n{}\n[[body]]\narchetype = \"tetra\"\nmodes = 0\n{}",
                    head, layers, water, more));
    ArchetypeLibrary library(folder_.path(), folder_.path());
    const SceneSpec scene = parse_scene(folder_ / "s.scene.toml");
    const BuiltScene built = build_scene(scene, library);
    return fall_of(scene, built.options, built.bodies.at(0));
  }

  ScratchFolder folder_;
};

const std::string kDry = "water = { level = 0 }", kWet = "water = { level = 1.0 }",
                  kHigh = "position = [2, 2, 3]\n";

TEST_F(FallTest, OnTheFloorItHasTheSpeedOfItsHeightAndItsStart) {
  const Fall f = fall("", kDry, kHigh + "velocity = [0, 0, -2]\n");
  EXPECT_NEAR(f.onto_floor, std::sqrt(4.0 + 2.0 * kG * (3.0 - kLowest)), 1e-12);
  EXPECT_EQ(f.into_water, 0.0);
  EXPECT_EQ(f.pull, kG);
  EXPECT_EQ(f.up, Vec3::UnitZ());
}

TEST_F(FallTest, TheWaterIsMetFirst) {
  const Fall f = fall("", kWet, kHigh);
  const double expected = std::sqrt(2.0 * kG * (3.0 - kLowest - 1.0));
  EXPECT_NEAR(f.into_water, expected, kNear * expected);
}

TEST_F(FallTest, WaterBesideItIsNotMet) {
  const Fall f = fall("", "water = { boxes = [{ low = [0, 0, 0], high = [1, 4, 2] }] }", kHigh);
  EXPECT_EQ(f.into_water, 0.0);
  EXPECT_NEAR(f.onto_floor, std::sqrt(2.0 * kG * (3.0 - kLowest)), 1e-12);
}

TEST_F(FallTest, NothingIsMetWithoutFloorOrWithoutMotion) {
  const Fall open = fall("", kDry + "\nwalls = { zmin = \"open\" }", kHigh);
  EXPECT_EQ(open.onto_floor, 0.0);
  EXPECT_EQ(open.pull, 0.0);
  const Fall still = fall("gravity = [0, 0, 0]", kDry, kHigh);
  EXPECT_EQ(still.onto_floor, 0.0);
  EXPECT_EQ(still.pull, 0.0);
}

TEST_F(FallTest, WithoutGravityItGoesWhereItIsThrown) {
  const Fall f = fall("gravity = [0, 0, 0]", kDry, kHigh + "velocity = [1.5, 0, 0]\n");
  EXPECT_DOUBLE_EQ(f.onto_floor, 1.5);
  EXPECT_EQ(f.up, -Vec3::UnitX());
  EXPECT_EQ(f.pull, 0.0);
}

TEST_F(FallTest, ALightBodyFloatsAndMeetsNoFloor) {
  const Fall f = fall("", "water = { level = 2.0 }", "position = [2, 2, 2.4]\n");  // 400 kg/m^3
  EXPECT_GT(f.into_water, 0.0);
  EXPECT_EQ(f.onto_floor, 0.0);
  EXPECT_EQ(f.pull, 0.0);
}

TEST_F(FallTest, ABodyAsDenseAsTheWaterAroundItStaysWhereItIs) {
  const Fall f = fall("", "", "position = [2, 2, 2]\ndensity = 1000\n");
  EXPECT_EQ(f.into_water, 0.0);
  EXPECT_NEAR(f.onto_floor, 0.0, 1e-6);  // root of the round-off of g h, 1e-15 of it
  EXPECT_NEAR(f.pull, 0.0, 1e-12);
}

TEST_F(FallTest, UnderWaterItsWeightIsLessByThatOfTheWater) {
  EXPECT_NEAR(fall("", "", "position = [2, 2, 2]\ndensity = 4000\n").pull, 0.75 * kG, 1e-12);
}

// Drag, added mass and buoyancy are in proportion to rho_w / rho = 1e-6.
TEST_F(FallTest, WaterDoesNotStopWhatIsAMillionTimesAsDense) {
  const Fall f = fall("", kWet, kHigh + "density = 1e9\n");
  const double expected = std::sqrt(2.0 * kG * (3.0 - kLowest));
  EXPECT_NEAR(f.onto_floor, expected, 1e-5 * expected);
}

// Without gravity: v m / (m + m_a) at the surface, m_a = m / 2, then exp(-C_d rho A h / 2 (m + m_a)).
TEST_F(FallTest, WaterTakesMomentumAtItsSurfaceAndByDragBelow) {
  const Fall f =
      fall("gravity = [0, 0, 0]", kWet, kHigh + "velocity = [0, 0, -3]\ndensity = 1000\n");
  const double moving = 1.5 * 1000.0 * kVolume, area = 0.5;
  const double expected = 3.0 / 1.5 * std::exp(-0.8 * 1000.0 * area * 1.0 / (2.0 * moving));
  EXPECT_NEAR(f.onto_floor, expected, kNear * expected);
}

// Deep down weight, buoyancy and drag balance: v^2 = 2 (m - rho V) g / (C_d rho A).
TEST_F(FallTest, DeepWaterLeavesTheSpeedAtWhichDragBalances) {
  const Fall f = fall("", "", "position = [2, 2, 90]\ndensity = 1500\n", 400);
  const double area = 0.5;  // of its lower face, m^2
  const double expected = std::sqrt(2.0 * 500.0 * kVolume * kG / (0.8 * 1000.0 * area));
  EXPECT_NEAR(f.onto_floor, expected, 1e-6 * expected);  // exp(-C_d rho A h / m) is 1e-60
}

}  // namespace
}  // namespace archetide
