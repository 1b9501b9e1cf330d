// The verb `run` from outside: what it refuses, and what it leaves when it is stopped.
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <thread>

#include "common/base/byte_stream.h"
#include "tests/unit/scene/scene_test_support.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

const char* const kStone = R"(schema = 1
time = { end = 0.2, fps = 10 }
step = { max = 0.01 }
[[body]]
archetype = "stone.h5"
position = [0, 0, 1]
modes = 0
)";

const char* const kTank = R"(schema = 1
time = { end = 50.0, fps = 100 }
[fluid]
grid = [16, 16, 16]
cell = "1/16"
water = { level = 0.5 }
)";

class RunVerb : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_.write("stone.scene.toml", kStone);
    folder_.write("tank.scene.toml", kTank);
    write_archetype(folder_ / "stone.h5", tetrahedron_archetype("stone"));
  }

  // Starts the program in the folder, behind `before` in the new process.
  pid_t start(
      const std::vector<std::string>& words, const std::function<void()>& before = [] {}) const {
    const pid_t child = ::fork();
    if (child != 0) return child;
    if (::chdir(folder_.path().c_str()) != 0 || !std::freopen("err", "w", stderr) ||
        !std::freopen("out.txt", "w", stdout))
      ::_exit(126);
    std::vector<char*> arguments = {const_cast<char*>(ARCHETIDE_SIM_BIN)};
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    before();
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  static int wait(pid_t child) {
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  int run(
      const std::vector<std::string>& words, const std::function<void()>& before = [] {}) const {
    return wait(start(words, before));
  }
  void expect_err(const std::string& part) const {
    expect_contains(read_whole_file(folder_ / "err"), part);
  }
  // Until a run has written this file.
  bool appears(const std::string& name) const {
    for (int n = 0; n < 3000 && !fs::exists(folder_ / name); ++n)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return fs::exists(folder_ / name);
  }

  const ScratchFolder folder_;
};

TEST_F(RunVerb, AnEmptyNameOfAFolderIsRefused) {
  EXPECT_EQ(run({"run", "stone.scene.toml", "-o", ""}), kExitInput);
  expect_err("the name of the run folder is empty");
}

TEST_F(RunVerb, NamesThatNoFileSystemTakesAreNoBugs) {
  const std::string endless(300, 'x');
  EXPECT_EQ(run({"run", "stone.scene.toml", "-o", endless}), kExitMachine);
  EXPECT_EQ(run({"run", endless + ".scene.toml", "-o", "r"}), kExitFile);
  EXPECT_EQ(run({"check", "stone.scene.toml", "--set", "body.archetype=" + endless}), kExitFile);
  fs::create_symlink("loop", folder_ / "loop");
  EXPECT_EQ(run({"run", "stone.scene.toml", "-o", "loop"}), kExitMachine);
  EXPECT_EQ(run({"check", "loop"}), kExitFile);
  EXPECT_EQ(run({"render", "loop"}), kExitFile);
}

TEST_F(RunVerb, NamesOfFoldersNeedNotBeUtf8) {
  EXPECT_EQ(run({"run", "stone.scene.toml", "-q", "-o", "r\xff"}), kExitDone);
  EXPECT_EQ(run({"run", "stone.scene.toml", "-q", "-o", "s", "--set", "name=\xff\xfe"}),
            kExitInput);
}

// Two modes of 1 Hz that a fall of 4 m drives far beyond what linear modes can tell.
TEST_F(RunVerb, CheckAndTheHeaderOfARunWarnOfDeformationBeyondTheModes) {
  Archetype soft = tetrahedron_archetype("soft");
  soft.K_r *= 1e-4, soft.omega2 *= 1e-4;
  write_archetype(folder_ / "soft.h5", soft);
  folder_.write("soft.scene.toml",
                "schema = 1\ntime = { end = 0.01, fps = 100 }\n[fluid]\ngrid = [16, 16, 20]\n"
                "cell = 0.25\nwater = { level = 0 }\n[[body]]\narchetype = \"soft.h5\"\n"
                "position = [2, 2, 4]\n");
  const std::string warning = "deformation: soft may deform by up to";
  EXPECT_EQ(run({"check", "soft.scene.toml"}), kExitDone);
  const std::string listed = read_whole_file(folder_ / "out.txt");
  expect_contains(listed, "deformation   soft: ");
  expect_contains(listed, "note          " + warning);
  EXPECT_EQ(run({"run", "soft.scene.toml", "-q", "-t", "1", "-o", "r"}), kExitDone);
  expect_contains(read_whole_file(folder_ / "r/run.log"), "note       " + warning);
}

TEST_F(RunVerb, CheckForetellsNoDeformationOfRigidBodies) {
  EXPECT_EQ(run({"check", "stone.scene.toml"}), kExitDone);
  EXPECT_EQ(read_whole_file(folder_ / "out.txt").find("deformation"), std::string::npos);
}

TEST_F(RunVerb, AFolderBelongsToOneRunAtATime) {
  const pid_t first = start({"run", "tank.scene.toml", "-q", "-t", "1", "-o", "r"});
  ASSERT_TRUE(appears("r/manifest.json"));
  EXPECT_EQ(run({"run", "tank.scene.toml", "-o", "r", "--replace"}), kExitInput);
  expect_err("another run writes into this folder");
  ::kill(first, SIGTERM);
  EXPECT_EQ(wait(first), kExitStopped);
  EXPECT_EQ(run({"run", "tank.scene.toml", "-q", "-o", "r", "--replace", "--frames", "1"}),
            kExitDone);
}

TEST_F(RunVerb, AHangUpStopsItWithACheckpointUnlessItIsIgnored) {
  const pid_t heard = start({"run", "tank.scene.toml", "-q", "-t", "1", "-o", "r"});
  ASSERT_TRUE(appears("r/frames/surface.pvd") || appears("r/frames/bodies.pvd"));
  ::kill(heard, SIGHUP);
  EXPECT_EQ(wait(heard), kExitStopped);
  EXPECT_TRUE(fs::exists(folder_ / "r/checkpoint/LATEST"));
  const pid_t deaf = start({"run", "tank.scene.toml", "-q", "-t", "1", "-o", "s"},
                           [] { std::signal(SIGHUP, SIG_IGN); });
  ASSERT_TRUE(appears("s/frames/surface.pvd") || appears("s/frames/bodies.pvd"));
  ::kill(deaf, SIGHUP);
  ::kill(deaf, SIGTERM);
  EXPECT_EQ(wait(deaf), kExitStopped);
}

TEST_F(RunVerb, ARunGoesOnWhenNobodyReadsItsLog) {
  const auto unread = [] {
    int ends[2];
    if (::pipe(ends) != 0) ::_exit(126);
    ::close(ends[0]);
    ::dup2(ends[1], 1), ::dup2(ends[1], 2);
  };
  EXPECT_EQ(run({"run", "stone.scene.toml", "-o", "r"}, unread), kExitDone);
  EXPECT_TRUE(fs::exists(folder_ / "r/done.stamp"));
  EXPECT_EQ(run({"schema"}, unread), kExitMachine);
}

TEST_F(RunVerb, ARunThatWasKilledBeforeItsManifestStandsInNobodysWay) {
  folder_.write("r/manifest.json.part", "{");
  EXPECT_EQ(run({"run", "stone.scene.toml", "-q", "-o", "r"}), kExitDone);
  folder_.write("s/notes.txt", "mine");
  EXPECT_EQ(run({"run", "stone.scene.toml", "-q", "-o", "s", "--replace"}), kExitInput);
  EXPECT_EQ(read_whole_file(folder_ / "s/notes.txt"), "mine");
}

TEST_F(RunVerb, TheManifestIsTheFirstFileOfARun) {
  // Killed again and again, a little later each time: the next run always knows what it finds.
  for (int n = 0; n < 12; ++n) {
    const pid_t child =
        start({"run", "stone.scene.toml", "-q", "-o", "r", "--resume", "auto", "--replace"});
    std::this_thread::sleep_for(std::chrono::milliseconds(2 + 3 * n));
    ::kill(child, SIGKILL);
    const int code = wait(child);
    EXPECT_TRUE(code == -SIGKILL || code == kExitDone) << code;
  }
  EXPECT_EQ(run({"run", "stone.scene.toml", "-q", "-o", "r", "--resume", "auto", "--replace"}),
            kExitDone);
}

TEST_F(RunVerb, ARunThatWasKilledWhileItClearedItsFolderStandsInNobodysWay) {
  const std::vector<std::string> again = {"run", "stone.scene.toml", "-q",   "-o",
                                          "r",   "--resume",         "auto", "--replace"};
  ASSERT_EQ(run(again), kExitDone);
  // As far as it comes: no stamp, no word of a checkpoint; those files themselves still there.
  fs::remove(folder_ / "r/done.stamp");
  fs::remove(folder_ / "r/checkpoint/LATEST");
  EXPECT_EQ(run({"run", "stone.scene.toml", "-q", "-o", "r"}), kExitInput);
  expect_err("without a checkpoint");
  EXPECT_EQ(run(again), kExitDone);
  // Parts of files go before the manifest does.
  folder_.write("r/scene.toml.part", "schema");
  folder_.write("r/done.stamp.part", "2026");
  EXPECT_EQ(run({"run", "stone.scene.toml", "-q", "-o", "r", "--replace"}), kExitDone);
  EXPECT_FALSE(fs::exists(folder_ / "r/scene.toml.part"));
  EXPECT_FALSE(fs::exists(folder_ / "r/done.stamp.part"));
  // A word of a checkpoint that is gone: refused with advice, unless --replace allows a new start.
  fs::remove(folder_ / "r/done.stamp");
  folder_.write("r/checkpoint/LATEST", "000077.h5\n");
  EXPECT_EQ(run({"run", "stone.scene.toml", "-q", "-o", "r"}), kExitFile);
  expect_err("--resume never --replace");
  EXPECT_EQ(run(again), kExitDone);
}

TEST_F(RunVerb, WaterThatDoesNotFitIsRefusedBeforeItIsFilled) {
  const std::vector<std::string> small = {"run", "tank.scene.toml", "-q", "-o",
                                          "r",   "--frames",        "1"};
  const auto limit = [](const char* bytes) {
    return [bytes] { ::setenv("ARCHETIDE_MEMORY_LIMIT", bytes, 1); };
  };
  EXPECT_EQ(run(small, limit("4G")), kExitDone);
  std::vector<std::string> large = small;
  large[4] = "s";
  large.insert(large.end(), {"--set", "fluid.grid=[400,400,400]", "--set", "fluid.cell=1/400"});
  EXPECT_EQ(run(large, limit("4G")), kExitMachine);
  expect_err("of memory");
  EXPECT_FALSE(fs::exists(folder_ / "s"));
  EXPECT_EQ(run(small, limit("plenty")), kExitInput);
}

TEST_F(RunVerb, MemoryThatRunsOutAmongThreadsIsExitFive) {
#ifdef ARCHETIDE_SANITIZED
  GTEST_SKIP() << "a program that checks itself takes terabytes of address space";
#endif
  const auto limit = [](rlim_t megabytes) {
    return [megabytes] {
      const rlimit bytes{megabytes << 20, megabytes << 20};
      ::setrlimit(RLIMIT_AS, &bytes);
    };
  };
  folder_.write("large.scene.toml",
                "schema = 1\ntime = { end = 0.02, fps = 100 }\n[fluid]\n"
                "grid = [48, 48, 48]\ncell = \"1/48\"\nwater = { level = 0.5 }\n");
  for (const rlim_t megabytes : {112, 116, 120, 126, 134}) {
    const int code = run(
        {"run", "large.scene.toml", "-q", "-t", "2", "-o", "r", "--resume", "never", "--replace"},
        limit(megabytes));
    EXPECT_TRUE(code == kExitMachine || code == kExitDone) << megabytes << ": " << code;
  }
}

TEST_F(RunVerb, OutputThatDoesNotArriveIsExitFive) {
  const auto full = [] {
    if (!std::freopen("/dev/full", "w", stdout)) ::_exit(126);
  };
  EXPECT_EQ(run({"schema"}, full), kExitMachine);
  EXPECT_EQ(run({"check", "stone.scene.toml"}, full), kExitMachine);
}

}  // namespace
}  // namespace archetide
