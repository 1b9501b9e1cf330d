// The verb from outside: a stone thrown in vacuum, whose path every step length gets differently.
#include "runtime/bench/bench.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "common/base/byte_stream.h"
#include "runtime/output/report.h"
#include "tests/unit/scene/scene_test_support.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

const char* const kScene = R"(schema = 1
name = "stone"
time = { end = 0.5, fps = 10 }
step = { max = 0.1 }
[[body]]
archetype = "stone.h5"
position = [0, 0, 1]
angular_velocity = [3, 0.2, 0.1]
modes = 0
)";

class BenchVerb : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_.write("stone.scene.toml", kScene);
    // Three different moments of inertia, so that the path of the rotation depends on the step.
    Archetype stone = tetrahedron_archetype("stone");
    stone.integrals.Sxx = 0.05 * Vec3(3, 2, 1).asDiagonal().toDenseMatrix();
    write_archetype(folder_ / "stone.h5", stone);
  }
  BenchRequest request() const {
    BenchRequest r;
    r.program = ARCHETIDE_SIM_BIN;
    r.scene = folder_ / "stone.scene.toml";
    r.sweeps = {"step.max=0.1,0.05,0.025"};
    r.references = {"0.003125"};
    r.out = folder_ / "out";
    r.threads = 1;
    return r;
  }
  const volatile std::sig_atomic_t stop_ = 0;
  const ScratchFolder folder_;
};

TEST_F(BenchVerb, FindsTheSecondOrderOfTheRotation) {
  const BenchTable table = run_bench(request(), stop_);
  ASSERT_EQ(table.rows.size(), 4u);  // three points and a reference of its own
  EXPECT_TRUE(table.rows[0].reference);
  for (int n = 1; n < 4; ++n) {
    const BenchRow& row = table.rows[n];
    EXPECT_EQ(row.status, "done");
    EXPECT_EQ(row.steps, 5 << (n - 1));
    EXPECT_EQ(row.difference.frames, 5);
    EXPECT_LT(row.difference.position, 1e-12);  // a parabola, exactly
    EXPECT_GT(row.cpu_seconds, 0.0);
    EXPECT_GT(row.peak_bytes, 1e6);
  }
  // Second order less the reference's own error; measured 2.0.
  EXPECT_NEAR(std::log2(table.rows[1].difference.rotation / table.rows[2].difference.rotation), 2.0,
              0.15);
  const BenchTable again = read_bench_csv(folder_ / "out/bench.csv");
  EXPECT_EQ(again.rows[2].difference.rotation, table.rows[2].difference.rotation);
  EXPECT_EQ(again.against, "step.max=0.003125");
}

TEST_F(BenchVerb, RunsOnlyWhatIsNotThere) {
  run_bench(request(), stop_);
  const fs::path manifest = folder_ / "out/points/step.max=0.05/manifest.json";
  const auto written = fs::last_write_time(manifest);
  BenchRequest more = request();
  more.sweeps = {"step.max=0.05,0.0125"};
  run_bench(more, stop_);
  EXPECT_EQ(fs::last_write_time(manifest), written);
  EXPECT_TRUE(fs::exists(folder_ / "out/points/step.max=0.0125/manifest.json"));
  // Another scene text is another run.
  folder_.write("stone.scene.toml", std::string(kScene) + "density = 500\n");
  run_bench(more, stop_);
  EXPECT_NE(fs::last_write_time(manifest), written);
}

TEST_F(BenchVerb, AFailedPointIsARowAndTheOthersGoOn) {
  BenchRequest r = request();
  r.overrides = {"time.end=0.2"};
  // Faster than 1 mm/s: the run ends with exit 3.
  r.sweeps = {"limits.speed=400,1e-3,200"};
  r.references = {"400"};
  const BenchTable table = run_bench(r, stop_);
  ASSERT_EQ(table.rows.size(), 3u);
  EXPECT_FALSE(table.rows[0].failed);
  EXPECT_TRUE(table.rows[1].failed) << table.rows[1].status;
  EXPECT_NE(table.rows[1].status.find("failed"), std::string::npos);
  EXPECT_TRUE(std::isnan(table.rows[1].error));
  EXPECT_FALSE(table.rows[2].failed);
}

TEST_F(BenchVerb, MeasuresFromClosedFormsWhereTheSceneHasThem) {
  // Mean height of z = 1 - g t^2 / 2 over the steps of the second half.
  folder_.write("stone.scene.toml",
                std::string(kScene) + "[expect]\nbody = [{ body = 0, window = 0.5, z = 0.0 }]\n");
  BenchRequest r = request();
  r.references.clear();
  const BenchTable table = run_bench(r, stop_);
  EXPECT_EQ(table.against, "closed forms of [expect]");
  // Steps of 0.1 s that end at 0.3, 0.4 and 0.5 s; the size is the cube root of 1/6 m^3.
  const double z = 1.0 - 9.81 / 2 * (0.09 + 0.16 + 0.25) / 3;
  EXPECT_NEAR(table.rows[0].error, std::abs(z) / std::cbrt(1.0 / 6.0), 1e-9);
}

TEST_F(BenchVerb, RefusesWrongSweepsBeforeAnythingRuns) {
  const auto refused = [&](const std::string& sweep, const std::string& reference) {
    BenchRequest r = request();
    r.sweeps = {sweep};
    r.references = {reference};
    return message_of<InputError>([&] { run_bench(r, stop_); });
  };
  expect_contains(refused("step.maxx=1,2", "1"), "step.max");
  expect_contains(refused("step.max=-1,0.1", "0.1"), "step.max");
  expect_contains(refused("step.max=0.1,0.2", "step.cfl=1"), "is not swept");
  EXPECT_FALSE(fs::exists(folder_ / "out/points"));
}

TEST_F(BenchVerb, ReportDrawsItsTable) {
  run_bench(request(), stop_);
  write_report({folder_ / "out", folder_ / "out/points/step.max=0.05"}, folder_ / "report.html");
  const std::string html = read_whole_file(folder_ / "report.html");
  EXPECT_NE(html.find("Speed against error"), std::string::npos);
  EXPECT_NE(html.find("stone: step.max"), std::string::npos);
  EXPECT_EQ(html.find("nan"), std::string::npos);
}

}  // namespace
}  // namespace archetide
