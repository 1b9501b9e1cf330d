#include "runtime/output/run_writer.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/base/number_text.h"
#include "common/base/sha256.h"
#include "runtime/output/csv.h"
#include "runtime/output/manifest.h"
#include "runtime/output/ply.h"
#include "runtime/output/vtp.h"
#include "tests/unit/output/scratch_folder.h"
#include "tests/unit/output/shapes.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

RunSetup setup_in(const std::string& directory) {
  RunSetup setup;
  setup.directory = directory;
  setup.scene_name = "two stones";
  setup.scene_text = "schema = 1\n";
  setup.end_time = 0.02, setup.fps = 100;
  setup.quiet = true;
  return setup;
}

// Two rigid bodies in a dry tank next to an obstacle.
Simulation two_stones() {
  SimulationOptions options;
  options.grid.nx = options.grid.ny = options.grid.nz = 4, options.grid.dx = 4.0;
  options.grid.origin.setConstant(-8.0);
  options.gravity.setZero();
  const auto archetype = tetrahedron_archetype();
  std::vector<ReducedBody> bodies = {rigid_body(archetype), rigid_body(archetype)};
  bodies[0].P = Vec3(2, 0, 0);  // 1 m/s
  bodies[1].position = Vec3(0, 5, 0);
  return Simulation(options, FluidState(), bodies, {archetype->surface});
}

// Two frames of two steps each.
void run_to_the_end(const std::string& directory, int exit_code) {
  Simulation simulation = two_stones();
  RunWriter writer(setup_in(directory), simulation);
  writer.on_frame(simulation);
  for (int frame = 0; frame < 2; ++frame) {
    for (int step = 0; step < 2; ++step) writer.on_step(simulation.step(0.005), simulation);
    writer.on_frame(simulation);
  }
  writer.log("a remark");
  writer.finish(exit_code, exit_code == 0 ? "" : "it broke", simulation);
}

TEST(RunWriter, LeavesTheWholeFolderAndNoPartialFile) {
  const ScratchFolder folder;
  run_to_the_end(folder / "run", 0);
  for (const char* name : {"scene.toml", "manifest.json", "run.log", "stats.csv", "bodies.csv",
                           "done.stamp", "frames/bodies.000000.vtp", "frames/bodies.000002.vtp",
                           "frames/bodies.pvd", "frames/obstacles.ply"})
    EXPECT_TRUE(fs::exists(folder / "run/" + name)) << name;
  EXPECT_FALSE(fs::exists(folder / "run/frames/surface.000000.ply"));
  for (const auto& entry : fs::recursive_directory_iterator(folder / "run"))
    EXPECT_NE(entry.path().extension(), ".part") << entry.path();
  EXPECT_EQ(read_whole_file(folder / "run/scene.toml"), "schema = 1\n");
}

TEST(RunWriter, TablesAndManifestTellTheRun) {
  const ScratchFolder folder;
  run_to_the_end(folder / "run", 0);
  const CsvTable stats = read_csv(folder / "run/stats.csv");
  const CsvTable bodies = read_csv(folder / "run/bodies.csv");
  EXPECT_EQ(stats.rows(), 4u);
  ASSERT_EQ(bodies.rows(), 6u);
  EXPECT_EQ(bodies.column("body"), (std::vector<double>{0, 1, 0, 1, 0, 1}));
  EXPECT_NEAR(bodies.column("x")[4], 0.02, 1e-15);  // 1 m/s over 0.02 s
  EXPECT_NEAR(bodies.column("t")[4], 0.02, 1e-15);

  const Manifest m = read_manifest(folder / "run/manifest.json");
  EXPECT_EQ(m.exit, 0);
  EXPECT_EQ(m.frames, 3);
  EXPECT_EQ(m.steps, 4);
  EXPECT_EQ(m.scene_hash, sha256_hex("schema = 1\n"));
  ASSERT_EQ(m.archetypes.size(), 1u);
  ASSERT_EQ(m.bodies.size(), 2u);
  EXPECT_EQ(m.bodies[0].mass, 2.0);
  EXPECT_EQ(m.bodies[0].bytes,
            static_cast<double>(instance_bytes(rigid_body(tetrahedron_archetype()))));
  const std::string log = read_whole_file(folder / "run/run.log");
  EXPECT_NE(log.find("bodies     2 of 1 archetypes"), std::string::npos) << log;
  EXPECT_NE(log.find("a remark"), std::string::npos);
  EXPECT_NE(log.find("worst iteration count"), std::string::npos);
}

// Once for a frame's time, however many steps it has.
TEST(RunWriter, BodiesThatGainEnergyFromNothingAreSaid) {
  const ScratchFolder folder;
  Simulation simulation = two_stones();
  RunWriter writer(setup_in(folder / "run"), simulation);
  for (const double t : {0.001, 0.002, 0.5}) {
    StepReport report = simulation.step(0.005);
    report.t = t, report.halvings = 6, report.thrown = t != 0.001;
    writer.on_step(report, simulation);
  }
  const std::string log = read_whole_file(folder / "run/run.log");
  std::size_t lines = 0, at = 0;
  for (; (at = log.find("gain energy from nothing", at)) != std::string::npos; ++at) ++lines;
  EXPECT_EQ(lines, 2u) << log;
  EXPECT_NE(log.find("t = 0.002000 s: bodies gain"), std::string::npos) << log;
  EXPECT_NE(log.find("halved 6 times"), std::string::npos) << log;
}

TEST(RunWriter, FramesHoldTheBodiesOfTheirTime) {
  const ScratchFolder folder;
  run_to_the_end(folder / "run", 0);
  const SurfaceMesh first = read_vtp(folder / "run/frames/bodies.000000.vtp");
  const SurfaceMesh last = read_vtp(folder / "run/frames/bodies.000002.vtp");
  ASSERT_EQ(first.vertices.size(), 8u);
  // float32 positions of about 1 m: 1e-7.
  EXPECT_NEAR(last.vertices[1][0] - first.vertices[1][0], 0.02, 1e-6);
  EXPECT_NEAR(last.vertices[5][0] - first.vertices[5][0], 0.0, 1e-6);
}

TEST(RunWriter, ABrokenRunHasNoDoneStampButSaysWhy) {
  const ScratchFolder folder;
  run_to_the_end(folder / "run", 0);
  run_to_the_end(folder / "run", kExitNumerics);  // over the old run
  EXPECT_FALSE(fs::exists(folder / "run/done.stamp"));
  const Manifest m = read_manifest(folder / "run/manifest.json");
  EXPECT_EQ(m.exit, 3);
  EXPECT_EQ(m.reason, "it broke");
}

TEST(RunWriter, AnUnknownFrameKindIsRefusedWithTheNearestOne) {
  const ScratchFolder folder;
  const Simulation simulation = two_stones();
  RunSetup setup = setup_in(folder / "run");
  setup.frames = {"body.vtp"};
  try {
    RunWriter writer(setup, simulation);
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("bodies.vtp"), std::string::npos) << error.what();
  }
}

TEST(MemoryEstimate, SharedArchetypesCountOnce) {
  const auto archetype = tetrahedron_archetype();
  const ReducedBody body = rigid_body(archetype);
  const MemoryEstimate one = estimate_memory({}, {}, {body}),
                       three = estimate_memory({}, {}, {body, body, body});
  EXPECT_EQ(one.archetypes, three.archetypes);
  EXPECT_EQ(3.0 * one.bodies, three.bodies);
  EXPECT_EQ(one.water, 0.0);
}

TEST(MemoryEstimate, SaysWhatASplashUpToTheLidTakes) {
  SimulationOptions options;
  options.has_water = true;
  options.grid = {32, 32, 32, 1.0, Vec3::Zero()};
  Grid fields = options.grid;
  EXPECT_EQ(memory_at_the_lid(options, fields, {}), "");
  fields.nz = 16;
  EXPECT_NE(memory_at_the_lid(options, fields, {})
                .find(bytes_text(estimate_memory(options, options.grid, {}).total())),
            std::string::npos);
}

}  // namespace
}  // namespace archetide
