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

}  // namespace
}  // namespace archetide

#endif
