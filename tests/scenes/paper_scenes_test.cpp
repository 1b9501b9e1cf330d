// The contact scenes of the paper (Figs. 3, 6, 7, 10), coarse: archetypes and runs by the programs.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "tests/scenes/scene_folder.h"

#ifdef ARCHETIDE_PRECOMPUTE_BIN

namespace archetide {
namespace {

struct Coarse {
  std::string scene, archetypes, grid, cell;  // archetypes: one or more words; grid in cells
  double end = 0.0;                           // s
};

// A scene of the assets, run with a coarse grid.
class CoarseScene {
 public:
  explicit CoarseScene(Coarse coarse) : coarse_(std::move(coarse)), folder_(coarse_.scene) {}
  int build() const { return folder_.build(coarse_.archetypes); }
  int run(const std::string& settings) const {
    return folder_.run(
        ARCHETIDE_ASSETS "/scenes/" + coarse_.scene + ".scene.toml",
        fmt::format("--set 'fluid.grid={}' --set fluid.cell={} --set time.end={:f}{}", coarse_.grid,
                    coarse_.cell, coarse_.end, settings));
  }
  CsvTable table(const std::string& name) const { return folder_.table(name); }

 private:
  Coarse coarse_;
  SceneFolder folder_;
};

class PaperScenes : public ::testing::TestWithParam<Coarse> {};

double sum(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}
double mean_of_last(const std::vector<double>& values, std::size_t count) {
  double sum = 0.0;
  for (std::size_t n = values.size() - count; n < values.size(); ++n) sum += values[n];
  return sum / static_cast<double>(count);
}

// Kinetic and elastic energy of water and bodies together.
double largest_motion(const CsvTable& stats) {
  const auto water = stats.column("water_kinetic"), body = stats.column("body_kinetic"),
             elastic = stats.column("body_elastic");
  double most = 0.0;
  for (std::size_t n = 0; n < water.size(); ++n)
    most = std::max(most, water[n] + body[n] + elastic[n]);
  return most;
}

// Bodies stay in the tank and overlap by at most half a cell, one step in twenty at most is taken
// again for that, and what the scenes expect (`[expect]` and `[limits]`: deformation, 5 % of
// volume) holds: exit code 0.
TEST_P(PaperScenes, RunsCoarse) {
  const CoarseScene scene(GetParam());
  ASSERT_EQ(scene.build(), 0);
  ASSERT_EQ(scene.run(" --set coupling.tolerance=1e-5"), 0);
  const CsvTable stats = scene.table("stats.csv");
  const double dx = 1.0 / std::stod(GetParam().cell.substr(2));
  const auto penetration = stats.column("max_penetration");
  std::printf("measured: %s: %zu steps, overlap at most %.3f cells, at the end %.4f (mean %.4f), ",
              GetParam().scene.c_str(), stats.rows(), largest(penetration) / dx,
              mean_of_last(penetration, 5) / dx,
              mean_of_last(stats.column("mean_penetration"), 5) / dx);
  std::printf("iterations at most %.0f, halvings %.0f\n", largest(stats.column("iterations")),
              sum(stats.column("halvings")));
  const double share = sum(stats.column("seconds_contact")) / sum(stats.column("seconds"));
  std::printf("measured: contact takes %.1f %% of a step\n", 100.0 * share);
  EXPECT_LE(share, 0.5);
  EXPECT_LE(largest(penetration) / dx, 0.5);
  EXPECT_LE(sum(stats.column("halvings")), 0.05 * static_cast<double>(stats.rows()));
  const CsvTable bodies = scene.table("bodies.csv");
  EXPECT_GE(*std::min_element(bodies.column("z").begin(), bodies.column("z").end()), 0.0);
}

// The ring of `tub` hits the water at 1.9 m/s and takes long steps in its splash. What it gave the
// water is lost bit by bit, not won: of the largest kinetic and elastic energy no later gain is
// more than 0.1 % (measured none; air that closing gaps squeeze out once made it 25 times that energy
// and 194 m/s), and no jet is five times as fast as the fall (measured 2.9 m/s).
TEST(SlowSplash, OfTheTubsRingGainsNoEnergy) {
  const CoarseScene scene({"tub", "torus", "[64,64,64]", "1/64", 1.0});
  ASSERT_EQ(scene.build(), 0);
  ASSERT_EQ(scene.run(" --set step.cfl=3 --set coupling.tolerance=1e-4 --set expect=absent"), 0);
  const CsvTable stats = scene.table("stats.csv");
  const double most = largest_motion(stats);
  const double gain = largest_rise(stats.column("energy")),
               speed = largest(stats.column("max_speed"));
  std::printf("measured: %zu steps, gain %.3f of %.3f J, fastest %.2f m/s\n", stats.rows(), gain,
              most, speed);
  EXPECT_LE(gain, 1e-3 * most);
  EXPECT_LE(speed, 9.0);
}

// Afterwards the ring rides the waves of its splash. All that it does to the surface stays in sight:
// from 2.4 s on at most 1e-3 of the water is held beyond what the surface shows; and no energy comes
// back but what a sloshing tank exchanges. Measured 1.1e-4, and 1.6e-3 of the largest motion; when
// air could come out under the ring [D68] 2.7e-3 and 2.4e-2.
TEST(SlowSplash, WavesUnderTheTubsRingStayInSight) {
  const CoarseScene scene({"tub", "torus", "[48,48,48]", "1/48", 9.0});
  ASSERT_EQ(scene.build(), 0);
  ASSERT_EQ(scene.run(" --set time.fps=1 --set expect=absent"), 0);
  const CsvTable stats = scene.table("stats.csv");
  const auto time = stats.column("t"), energy = stats.column("energy"),
             hidden = stats.column("volume_residual"), volume = stats.column("water_volume"),
             water = stats.column("water_kinetic"), body = stats.column("body_kinetic");
  const auto after = std::lower_bound(time.begin(), time.end(), 2.4) - time.begin();
  double motion = 0.0, most = 0.0;
  for (std::size_t n = 0; n < time.size(); ++n) motion = std::max(motion, water[n] + body[n]);
  for (std::size_t n = after; n < time.size(); ++n)
    most = std::max(most, std::abs(hidden[n]) / volume[0]);
  const double gain = largest_rise(energy, after);
  std::printf("measured: %.1e of the water out of sight, gain %.1e of the motion\n", most,
              gain / motion);
  EXPECT_LE(most, 1e-3);
  EXPECT_LE(gain, 5e-3 * motion);
}

// H28 as it is written, under water: the 150 starfish of Fig. 10 for 10 s, beating, in heaps on rocks
// and on each other. Overlaps stay below half a cell, and a twentieth in the mean; no motion of
// bodies or water outgrows the fall; no solve takes three times what one starfish alone takes.
// Measured: 490 steps, 1 halving, overlap 0.27 cells at most (0.0033 in the mean), 21 iterations at
// most (one alone 8), 4.0 m/s; 12 min.
TEST(SlowHeapInWater, OfHundredFiftyStarfishOverlapsLittle) {
  const CoarseScene scene({"starfish150", "starfish_firm", "[112,176,32]", "1/32", 10.0});
  ASSERT_EQ(scene.build(), 0);
  ASSERT_EQ(scene.run(" --set time.end=2 --set scatter[0].count=1 --set scatter[0].waves=absent "
                      "--set expect=absent"),
            0);
  const double single = largest(scene.table("stats.csv").column("iterations"));
  ASSERT_EQ(scene.run(" --replace --set output.frames=[]"), 0);
  const CsvTable stats = scene.table("stats.csv");
  const double dx = 1.0 / 32.0, most = largest(stats.column("max_penetration")) / dx,
               mean = mean_of_last(stats.column("mean_penetration"), stats.rows()) / dx,
               speed = largest(stats.column("max_speed")),
               iterations = largest(stats.column("iterations"));
  std::printf("measured: %zu steps, %.0f halvings, overlap %.3f cells at most, mean %.4f, ",
              stats.rows(), sum(stats.column("halvings")), most, mean);
  std::printf("%.0f iterations at most (one alone %.0f), fastest %.2f m/s\n", iterations, single,
              speed);
  EXPECT_LE(most, 0.5);
  EXPECT_LE(mean, 0.05);
  EXPECT_LE(iterations, 3.0 * single);
  EXPECT_LE(speed, 4.0 * std::sqrt(2.0 * 9.81 * 0.8));
}

// A jellyfish of five parts falls into a breaking dam: the wave bends the linear modes of its arms
// to where their elements are held, and throws it about the tank. All joints stay closed, the water is
// at no time faster than three times its fall from 0.9 m, and no energy comes from nothing beyond 1 %.
// Measured: 232 steps, 183 halvings, gap 1e-13 m, 4.7 m/s, 0.3 % (1.1 % before [D97]). (Before closing
// joints by shapes far away was given up [D84] the joints came open in the first half second.)
TEST(SlowSkin, AJellyfishSurvivesABreakingDam) {
  const CoarseScene scene({"jellyfish",
                           "jellyfish_bell jellyfish_arm1 jellyfish_arm2 jellyfish_arm3 "
                           "jellyfish_arm4 jellyfish_skin",
                           "[32,32,40]", "1/32", 2.0});
  ASSERT_EQ(scene.build(), 0);
  ASSERT_EQ(scene.run(" --set gravity=[0,0,-9.81] --set skin[0].position=[0.55,0.5,0.75] --set "
                      "expect=absent --set 'fluid.water={boxes=[{low=[0,0,0],high=[0.35,1,0.9]},"
                      "{low=[0,0,0],high=[1,1,0.25]}]}'"),
            0);
  const CsvTable stats = scene.table("stats.csv");
  const auto energy = stats.column("energy"), work = stats.column("actuation_work");
  std::vector<double> given;
  for (std::size_t n = 0; n < energy.size(); ++n) given.push_back(energy[n] - work[n]);
  const double gain = largest_rise(given) / largest_motion(stats),
               speed = largest(stats.column("max_speed")),
               gap = largest(stats.column("joint_drift"));
  std::printf("measured: %zu steps, %.0f halvings, gap %.1e m, fastest %.2f m/s, gain %.2e\n",
              stats.rows(), sum(stats.column("halvings")), gap, speed, gain);
  EXPECT_LE(gap, 1e-9);
  EXPECT_LE(speed, 3.0 * std::sqrt(2.0 * 9.81 * 0.9));
  EXPECT_LE(gain, 0.01);
}

// Measured overlap, cells: 0.015, 0.007, 0.08, 0.18.
INSTANTIATE_TEST_SUITE_P(
    Slow, PaperScenes,
    ::testing::Values(Coarse{"starfish", "starfish", "[32,32,32]", "1/32", 1.5},
                      Coarse{"tori15", "torus", "[48,48,16]", "1/16", 1.5},
                      Coarse{"tori50", "torus", "[64,64,16]", "1/16", 2.0},
                      Coarse{"starfish150", "starfish_firm", "[56,88,16]", "1/16", 2.0}),
    [](const auto& at) { return at.param.scene; });

}  // namespace
}  // namespace archetide

#endif
