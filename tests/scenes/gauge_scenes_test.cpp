// gauges.csv of a run that is stopped and resumed.
#include <fstream>

#include "common/base/byte_stream.h"
#include "tests/scenes/scene_folder.h"

#ifdef ARCHETIDE_PRECOMPUTE_BIN

namespace archetide {
namespace {

constexpr char kScene[] =
    "schema = 1\ntime = { end = 0.5, fps = 24 }\n[fluid]\ngrid = [24, 4, 12]\ncell = \"1/12\"\n"
    "water = { boxes = [{ low = [0, 0, 0], high = [0.6, 1, 0.6] }] }\nwalls = { zmax = \"open\" }\n"
    "[output]\nframes = []\n";
constexpr char kGauges[] =
    "[[gauge]]\npoint = [2, 0.1, 0.05]\n[[gauge]]\nname = \"column\"\npoint = [0.1, 0.1, 0.05]\n";

TEST(GaugeScenes, ATableHasARowAStepAndGoesOnWhereItStopped) {
  const SceneFolder folder("gauges");
  const std::string scene = folder.path() + "/dam.scene.toml", run = folder.path() + "/run";
  std::ofstream(scene) << kScene << kGauges;
  ASSERT_EQ(folder.run(scene), 0);
  const std::string whole = read_whole_file(run + "/gauges.csv");
  const CsvTable table = folder.table("gauges.csv");
  EXPECT_EQ(table.names, (std::vector<std::string>{"t", "g1_p", "g1_vx", "g1_vy", "g1_vz",
                                                   "g1_level", "column_p", "column_vx", "column_vy",
                                                   "column_vz", "column_level"}));
  EXPECT_EQ(table.column("t"), folder.table("stats.csv").column("t"));
  // the wall is dry until the water is there
  EXPECT_EQ(table.column("g1_p").front(), 0.0);
  EXPECT_TRUE(std::isnan(table.column("g1_level").front()));
  EXPECT_GT(table.column("column_p").front(), 2000.0);

  ASSERT_EQ(folder.run(scene, "--replace --until 0.2"), 75);
  EXPECT_NE(read_whole_file(run + "/gauges.csv"), whole);
  ASSERT_EQ(folder.run(scene), 0);
  EXPECT_EQ(read_whole_file(run + "/gauges.csv"), whole);

  std::ofstream(scene) << kScene;
  ASSERT_EQ(folder.run(scene, "--replace"), 0);
  EXPECT_FALSE(std::filesystem::exists(run + "/gauges.csv"));
}

// A full tank of moving water whose ends are open is a piece of a stream: it goes on as it is.
TEST(GaugeScenes, AStreamThroughOpenSidesGoesOn) {
  const SceneFolder folder("stream");
  const std::string scene = folder.path() + "/stream.scene.toml";
  std::ofstream(scene) << "schema = 1\ntime = { end = 2, fps = 24 }\n[fluid]\n"
                          "grid = [16, 8, 8]\ncell = \"1/8\"\nvelocity = [1, 0, 0]\n"
                          "walls = { xmin = \"open\", xmax = \"open\" }\n[output]\nframes = []\n"
                          "[[gauge]]\npoint = [1.1, 0.4, 0.3]\n";
  ASSERT_EQ(folder.run(scene), 0);
  const CsvTable table = folder.table("gauges.csv");
  ASSERT_GT(table.rows(), 10u);
  for (std::size_t n = 0; n < table.rows(); ++n) {
    EXPECT_NEAR(table.column("g1_vx")[n], 1.0, 1e-9);
    EXPECT_NEAR(table.column("g1_vy")[n], 0.0, 1e-9);
    EXPECT_NEAR(table.column("g1_vz")[n], 0.0, 1e-9);
  }
}

// A ball of water thrown without gravity keeps its momentum until it meets the wall.
TEST(GaugeScenes, ThrownWaterKeepsItsMomentum) {
  const SceneFolder folder("thrown");
  const std::string scene = folder.path() + "/thrown.scene.toml";
  std::ofstream(scene)
      << "schema = 1\ngravity = [0, 0, 0]\ntime = { end = 0.4, fps = 24 }\n[fluid]\n"
         "grid = [24, 16, 16]\ncell = \"1/16\"\nwater = { spheres = "
         "[{ centre = [0.4, 0.5, 0.5], radius = 0.25, velocity = [1, 0.2, -0.1] }] }\n"
         "walls = { zmax = \"open\" }\n[output]\nframes = []\n";
  ASSERT_EQ(folder.run(scene), 0);
  const CsvTable table = folder.table("stats.csv");
  const double mass = 1000.0 * (table.column("water_volume").front());
  double worst = 0.0;
  for (std::size_t n = 0; n < table.rows(); ++n)
    worst = std::max({worst, std::abs(table.column("water_px")[n] / mass - 1.0),
                      std::abs(table.column("water_py")[n] / mass - 0.2),
                      std::abs(table.column("water_pz")[n] / mass + 0.1)});
  std::printf("measured: %.1e m/s\n", worst);
  EXPECT_LT(worst, 5e-7);
}

}  // namespace
}  // namespace archetide

#endif
