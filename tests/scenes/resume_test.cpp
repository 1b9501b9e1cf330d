// The program stopped and resumed, and what it leaves behind when the numbers fail.
#include <fmt/core.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/archetype/archetype.h"
#include "common/base/byte_stream.h"
#include "common/base/sha256.h"
#include "runtime/output/csv.h"
#include "runtime/output/manifest.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

const char* const kScene = R"(schema = 1
name = "busy"
time = { end = 0.5, fps = 12 }
[fluid]
grid = [12, 12, 12]
cell = "1/12"
water = { level = 0.5 }
walls = { zmax = "open" }
particles = { per_cell = 8 }
[[markers]]
count = 20
box = [[0, 0, 0], [1, 1, 0.5]]
[[source]]
box = [[0.1, 0.1, 0.7], [0.3, 0.3, 0.9]]
velocity = [0, 0, -0.5]
[coupling]
tolerance = 1e-6
[[body]]
name = "left"
archetype = "soft"
position = [0.35, 0.5, 0.5]
[[body]]
name = "right"
archetype = "soft"
position = [0.62, 0.5, 0.5]
[[scatter]]
archetype = "soft"
count = 2
box = [[0.4, 0.4, 0.75], [0.6, 0.6, 0.85]]
waves = { count = 2, every = 0.2 }
[[joint]]
bodies = ["left", "right"]
points = [[0.135, 0, 0]]
[[force]]
body = "left"
points = "few"
amplitude = 20
period = 0.2
[contact]
friction = 0.3
[output]
frames = ["surface.ply", "bodies.vtp", "particles.vtp", "markers.vtp"]
checkpoint = { every_frames = 2, keep = 3 }
[expect]
deformation_min = 0.0
)";

class RunProgram : public ::testing::Test {
 protected:
  RunProgram() : folder_(fmt::format("{}run_{}/", testing::TempDir(), ::getpid())) {
    fs::create_directories(folder_);
    SyntheticOptions soft;
    soft.r = 3, soft.density = 600.0, soft.first_omega = 30.0, soft.beta = 0.001;
    const SyntheticBody box =
        deformable_archetype(box_tets(Vec3(0.2, 0.2, 0.15), Vec3i(2, 2, 2)), soft);
    box.archetype->name = "soft";
    box.archetype->point_sets = {{"few", {0, 2, 5, 8, 11}}};
    write_archetype(folder_ + "soft.h5", *box.archetype);
    write_scene(kScene);
  }
  ~RunProgram() override { fs::remove_all(folder_); }

  void write_scene(const std::string& text) const {
    std::ofstream(folder_ + "s.scene.toml") << text;
  }

  std::vector<std::string> words(const std::string& arguments) const {
    std::vector<std::string> list = {ARCHETIDE_SIM_BIN,
                                     "run",
                                     folder_ + "s.scene.toml",
                                     "--archetypes",
                                     folder_,
                                     "-q",
                                     "-t",
                                     "1"};
    std::istringstream in(arguments);
    for (std::string word; in >> word;) list.push_back(word);
    return list;
  }
  // Starts the program; its messages go to `err`.
  pid_t start(const std::vector<std::string>& list, rlim_t file_bytes = RLIM_INFINITY) const {
    const pid_t child = ::fork();
    if (child != 0) return child;
    if (!std::freopen((folder_ + "err").c_str(), "w", stderr)) ::_exit(126);
    if (file_bytes != RLIM_INFINITY) {
      const rlimit limit{file_bytes, file_bytes};
      ::signal(SIGXFSZ, SIG_IGN);  // writing fails instead, as on a full disk
      ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    std::vector<char*> argv;
    for (const std::string& word : list) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  static int wait(pid_t child) {
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  int run(const std::string& arguments) const { return wait(start(words(arguments))); }
  std::string err() const { return read_whole_file(folder_ + "err"); }
  std::string out(const std::string& name) const { return " -o " + folder_ + name; }

  void expect_err(const std::string& part) const {
    EXPECT_NE(err().find(part), std::string::npos) << "'" << part << "' is not in:\n" << err();
  }

  // Everything that two runs left: checkpoint, tables (without clocks) and frames.
  void expect_same_runs(const std::string& a, const std::string& b) const {
    for (const char* name : {"/checkpoint/000004.h5", "/checkpoint/000006.h5"})
      EXPECT_EQ(sha256_of_file(folder_ + a + name), sha256_of_file(folder_ + b + name)) << name;
    EXPECT_FALSE(fs::exists(folder_ + b + "/checkpoint/stopped.h5"));
    EXPECT_EQ(read_whole_file(folder_ + a + "/bodies.csv"),
              read_whole_file(folder_ + b + "/bodies.csv"));
    const CsvTable first = read_csv(folder_ + a + "/stats.csv"),
                   second = read_csv(folder_ + b + "/stats.csv");
    ASSERT_EQ(first.names, second.names);
    for (std::size_t c = 0; c < first.names.size(); ++c) {
      if (!first.names[c].starts_with("seconds")) {
        EXPECT_EQ(first.columns[c], second.columns[c]) << first.names[c];
      }
    }
    int frames = 0;
    for (const auto& entry : fs::directory_iterator(folder_ + a + "/frames")) {
      const std::string name = entry.path().filename().string();
      EXPECT_EQ(read_whole_file(entry.path().string()),
                read_whole_file(folder_ + b + "/frames/" + name))
          << name;
      ++frames;
    }
    EXPECT_EQ(frames, 7 * 4 + 4);
  }

  std::string folder_;
};

TEST_F(RunProgram, ResumedIsUninterruptedHoweverItWasStopped) {
  ASSERT_EQ(run(out("straight")), 0) << err();
  EXPECT_FALSE(fs::exists(folder_ + "straight/checkpoint/000000.h5"));
  EXPECT_TRUE(fs::exists(folder_ + "straight/checkpoint/000002.h5"));  // keep = 3: 2, 4, 6

  // between two frames, then from there
  ASSERT_EQ(run(out("until") + " --until 0.2"), 75) << err();
  EXPECT_FALSE(fs::exists(folder_ + "until/done.stamp"));
  EXPECT_TRUE(fs::exists(folder_ + "until/checkpoint/stopped.h5"));
  const Manifest stopped = read_manifest(folder_ + "until/manifest.json");
  ASSERT_EQ(run(out("until")), 0) << err();
  const Manifest resumed = read_manifest(folder_ + "until/manifest.json");
  EXPECT_GT(resumed.wall_seconds, stopped.wall_seconds);
  for (const auto& [phase, seconds] : stopped.phase_seconds)
    EXPECT_GE(resumed.phase_seconds.at(phase), seconds) << phase;
  expect_same_runs("straight", "until");

  // after so many frames, which is no whole run; frames beyond the end are those of the scene
  ASSERT_EQ(run(out("frames") + " --frames 3"), 0) << err();
  EXPECT_FALSE(fs::exists(folder_ + "frames/done.stamp"));
  EXPECT_EQ(read_manifest(folder_ + "frames/manifest.json").frames, 4);
  ASSERT_EQ(run(out("frames") + " --frames 99"), 0) << err();
  EXPECT_TRUE(fs::exists(folder_ + "frames/done.stamp"));
  expect_same_runs("straight", "frames");
  EXPECT_EQ(run(out("none") + " --frames 0"), 2);
  expect_err("0 not in range 1 to 100000000");

  // by a signal, at whatever step it comes
  const pid_t child = start(words(out("signal")));
  while (!fs::exists(folder_ + "signal/frames/bodies.000001.vtp"))
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  ::kill(child, SIGTERM);
  ASSERT_EQ(wait(child), 75) << err();
  ASSERT_EQ(run(out("signal") + " --resume auto --replace"), 0) << err();
  expect_same_runs("straight", "signal");

  // again from an earlier frame: later rows, frames and the end are cut off
  ASSERT_EQ(run(out("straight") + " --resume 4"), 0) << err();
  expect_same_runs("until", "straight");

  // into another folder
  ASSERT_EQ(run(out("fork") + " --resume " + folder_ + "until/checkpoint/000002.h5"), 0) << err();
  EXPECT_EQ(read_whole_file(folder_ + "fork/frames/bodies.000006.vtp"),
            read_whole_file(folder_ + "until/frames/bodies.000006.vtp"));
  EXPECT_FALSE(fs::exists(folder_ + "fork/frames/bodies.000002.vtp"));
}

TEST_F(RunProgram, WhatCannotGoOnSaysWhy) {
  ASSERT_EQ(run(out("a") + " --until 0.2"), 75) << err();
  const std::string checkpoint = folder_ + "a/checkpoint/stopped.h5";
  EXPECT_EQ(run(out("a") + " --resume never"), 2);
  expect_err("holds a run already");
  EXPECT_EQ(run(out("a") + " --resume 5"), 4);
  expect_err("there are frames 2");
  fs::remove(folder_ + "a/checkpoint/000002.h5");
  EXPECT_EQ(run(out("a") + " --resume 5"), 4);
  expect_err("there is only stopped.h5");
  EXPECT_EQ(run(out("a") + " --resume backwards"), 2);

  write_scene(std::string(kScene) + "iterations = 99\n");
  EXPECT_EQ(run(out("a")), 4);
  expect_err("the scene is not the one of this run");
  write_scene(kScene);

  const std::string whole = read_whole_file(checkpoint);
  fs::resize_file(checkpoint, whole.size() / 2);
  EXPECT_EQ(run(out("a")), 4);
  expect_err("stopped.h5");
  std::string flipped = whole;
  flipped[whole.size() / 2] ^= 1;
  std::ofstream(checkpoint, std::ios::binary) << flipped;
  EXPECT_EQ(run(out("a")), 4);
  expect_err("do not match their hash");
  std::ofstream(checkpoint, std::ios::binary) << "not a checkpoint";
  EXPECT_EQ(run(out("a")), 4);
  expect_err("not an HDF5 file");
  fs::remove(checkpoint);
  EXPECT_EQ(run(out("a")), 4);
  expect_err("names no checkpoint that is there");

  // nothing of the run was touched by all that
  std::ofstream(checkpoint, std::ios::binary) << whole;
  EXPECT_EQ(run(out("a")), 0) << err();
}

// The replay command of a failure, run as it stands but for the program's place.
class FailedRun : public RunProgram {
 protected:
  nlohmann::json diagnosis(const std::string& run_folder) const {
    return nlohmann::json::parse(read_whole_file(folder_ + run_folder + "/failure/diagnosis.json"));
  }
  void expect_replay_fails_alike(const std::string& run_folder) const {
    const nlohmann::json first = diagnosis(run_folder);
    std::string command = first["replay"];
    ASSERT_TRUE(command.starts_with("archetide-sim "));
    command = std::string(ARCHETIDE_SIM_BIN) + command.substr(13) + " -q 2>" + folder_ + "err";
    EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 3) << command << "\n" << err();
    nlohmann::json again = diagnosis(run_folder + "/failure/replay");
    again["replay"] = first["replay"];
    EXPECT_EQ(again.dump(), first.dump());
  }
};

TEST_F(FailedRun, AStepThatDoesNotConvergeIsHalvedThenReported) {
  // H40: one iteration, an impossible tolerance; still water would need none. The fields end below
  // the top of the tank.
  EXPECT_EQ(run(out("a") + " --set coupling.max_iterations=1 --set coupling.tolerance=1e-14" +
                " --set fluid.grid=[12,12,48]"),
            3);
  expect_err("did not converge");
  const nlohmann::json j = diagnosis("a");
  EXPECT_EQ(j["quantity"], "convergence");
  EXPECT_EQ(j["cell"].size(), 3u);
  EXPECT_TRUE(j["body"].is_number());
  for (const char* name : {"scene.toml", "state.h5", "body.vtp", "surface.ply", "diagnosis.txt"})
    EXPECT_TRUE(fs::exists(folder_ + "a/failure/" + name)) << name;
  EXPECT_FALSE(fs::exists(folder_ + "a/done.stamp"));
  expect_replay_fails_alike("a");
}

TEST_F(FailedRun, LimitsNameTheCulpritAndReplayFromTheLastCheckpoint) {
  EXPECT_EQ(run(out("d") + " --set limits.deformation=1e-3"), 3);
  expect_err("a body deforms by");
  const nlohmann::json j = diagnosis("d");
  EXPECT_EQ(j["quantity"], "limits.deformation");
  EXPECT_TRUE(j["mode"].is_number() && j["body"].is_number());

  // a speed that is reached some frames after the first checkpoint
  ASSERT_EQ(run(out("s")), 0) << err();
  const CsvTable stats = read_csv(folder_ + "s/stats.csv");
  double early = 0.0, late = 0.0;
  for (std::size_t n = 0; n < stats.rows(); ++n) {
    double& fastest = stats.column("t")[n] < 0.1 ? early : late;
    fastest = std::max(fastest, stats.column("max_speed")[n]);
  }
  ASSERT_GT(late, 1.02 * early);
  const std::string limit = std::to_string(0.5 * (early + late));
  EXPECT_EQ(run(out("s") +
                " --replace --set output.checkpoint.every_frames=1 --set limits.speed=" + limit),
            3);
  expect_err("water or a body moves at");
  EXPECT_TRUE(fs::exists(folder_ + "s/failure/start.h5"));
  expect_replay_fails_alike("s");

  for (const char* small : {"limits.step=0.1", "limits.iterations=1", "limits.volume_drift=1e-9"})
    EXPECT_EQ(run(out("other") + " --replace --set " + small), 3) << small << err();
  EXPECT_EQ(run(out("fine") + " --set limits.speed=100 --set limits.energy=0.5 --set "
                              "limits.step=1e-6 --set limits.iterations=100"),
            0)
      << err();
}

// Two bodies at a hinge in vacuum; one of them spins.
const char* const kSpinning = R"(schema = 1
name = "spinning"
gravity = [0, 0, 0]
time = { end = 1, fps = 12 }
step = { max = 0.005 }
[[body]]
name = "left"
archetype = "limp"
position = [0, 0, 0]
angular_velocity = [12, 8, 6]
[[body]]
name = "right"
archetype = "limp"
position = [0.25, 0, 0]
[[joint]]
bodies = ["left", "right"]
points = [[0.125, 0.05, 0], [0.125, -0.05, 0]]
[output]
frames = []
checkpoint = { every_frames = 1, keep = 2 }
)";

class SpinningRun : public FailedRun {
 protected:
  SpinningRun() {
    SyntheticOptions limp;
    limp.r = 3, limp.density = 600.0, limp.first_omega = 30.0;
    const SyntheticBody box =
        deformable_archetype(box_tets(Vec3(0.2, 0.2, 0.15), Vec3i(2, 2, 2)), limp);
    box.archetype->name = "limp";
    write_archetype(folder_ + "limp.h5", *box.archetype);
    write_scene(kSpinning);
  }
};

// A body that spins and bends has its energy up to the step's error, of second order: up to 3e-5 of
// it from nothing at 5 ms, 1/25 of that at 1 ms.
TEST_F(SpinningRun, EnergyFromNothingCrossesItsLimit) {
  const std::string limited = " --set joint=absent --set limits.energy=2e-5 --set step.max=";
  EXPECT_EQ(run(out("short") + limited + "0.001"), 0) << err();
  EXPECT_EQ(run(out("long") + limited + "0.005"), 3);
  expect_err("energy has grown from nothing by");
  const nlohmann::json j = diagnosis("long");
  EXPECT_EQ(j["quantity"], "limits.energy");
  EXPECT_EQ(j["body_name"], "left");
  EXPECT_TRUE(fs::exists(folder_ + "long/failure/start.h5"));
  expect_replay_fails_alike("long");
}

// In steps that turn the body by several radians no joint can be closed.
TEST_F(SpinningRun, AJointThatCannotBeClosedIsNamedWithItsBodies) {
  EXPECT_EQ(run(out("a") + " --set body[0].angular_velocity=[0,0,1000] --set step.max=0.04 --set "
                           "coupling.on_fail=\"stop\""),
            3);
  expect_err("a joint could not be closed");
  expect_err("joint 0 is [[joint]] 1, body 0 is left, body 1 is right");
  const nlohmann::json j = diagnosis("a");
  EXPECT_EQ(j["quantity"], "joint");
  EXPECT_EQ(j["joint_name"], "[[joint]] 1");
  EXPECT_EQ(j["body_name"], "left");
  EXPECT_EQ(j["other_body_name"], "right");
  EXPECT_TRUE(fs::exists(folder_ + "a/failure/body.vtp"));
  expect_replay_fails_alike("a");
}

TEST_F(RunProgram, AFullDiskIsExitFive) {
  const pid_t child = start(words(out("a")), 200000);  // no file above 200 kB
  EXPECT_EQ(wait(child), 5) << err();
  EXPECT_FALSE(fs::exists(folder_ + "a/checkpoint/LATEST"));
  EXPECT_FALSE(fs::exists(folder_ + "a/done.stamp"));
  for (const auto& entry : fs::recursive_directory_iterator(folder_ + "a"))
    EXPECT_NE(entry.path().extension(), ".part") << entry.path();
}

}  // namespace
}  // namespace archetide
