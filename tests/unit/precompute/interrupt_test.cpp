// The program is stopped or killed in the middle: an older archetype stays as it was.

#include <fcntl.h>
#include <fmt/core.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <thread>

#include "common/archetype/archetype.h"
#include "precompute/base/defects.h"
#include "precompute_test_meshes.h"

namespace archetide {
namespace {

using testing_meshes::ScratchFolder;

/// The program at work, its log on a pipe.
class Child {
 public:
  explicit Child(const std::vector<std::string>& words) {
    int ends[2];
    EXPECT_EQ(::pipe(ends), 0);
    pid_ = ::fork();
    if (pid_ == 0) {
      ::dup2(ends[1], STDERR_FILENO);
      ::close(ends[0]);
      std::vector<char*> argv;
      for (const std::string& word : words) argv.push_back(const_cast<char*>(word.c_str()));
      argv.push_back(nullptr);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    ::close(ends[1]);
    log_ = ends[0];
  }
  ~Child() { ::close(log_); }

  /// Reads the log until it holds `text`; false at its end.
  bool wait_for(const std::string& text) {
    char buffer[256];
    while (read_.find(text) == std::string::npos) {
      const ssize_t n = ::read(log_, buffer, sizeof buffer);
      if (n <= 0) return false;
      read_.append(buffer, static_cast<std::size_t>(n));
    }
    return true;
  }
  /// The process that it started; 0 when there is none within ten seconds.
  pid_t wait_for_child() const {
    const std::string pid = std::to_string(pid_);
    for (int tenth = 0; tenth < 100; ++tenth) {
      pid_t child = 0;
      if (std::ifstream("/proc/" + pid + "/task/" + pid + "/children") >> child) return child;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return 0;
  }
  /// The exit code, or minus the signal that ended it.
  int stop(int signal) {
    ::kill(pid_, signal);
    int status = 0;
    ::waitpid(pid_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  int wait() { return stop(0); }

 private:
  pid_t pid_ = -1;
  int log_ = -1;
  std::string read_;
};

/// Whether a process is gone (or waits to be reaped) within ten seconds.
bool ends_soon(pid_t pid) {
  for (int tenth = 0; tenth < 100; ++tenth) {
    std::string number, name, state;
    std::ifstream(fmt::format("/proc/{}/stat", pid)) >> number >> name >> state;
    if (state.empty() || state == "Z") return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  return false;
}

TEST(Interrupt, LeavesTheOldArchetype) {
  const ScratchFolder folder;
  write_ply(folder.file("ball.ply"), shapes::sphere(1.0, 3));
  const auto body = [&](int target) {
    return folder.write("ball.body.toml",
                        fmt::format("schema = 1\nmesh = \"ball.ply\"\ntet = {{ target = {} }}\n"
                                    "material = {{ density = 800.0, young = 1e5, poisson = 0.3 }}\n"
                                    "modes = {{ count = 2 }}\n",
                                    target));
  };
  const std::string out = folder.file("ball.h5");
  const std::vector<std::string> command = {ARCHETIDE_PRECOMPUTE_BIN, "build", body(100), "-o",
                                            out};
  ASSERT_EQ(Child(command).wait(), 0);
  const std::string old = read_whole_file(out),
                    record = read_whole_file(folder.file("ball.build.json"));
  ASSERT_FALSE(old.empty());
  body(3000);
  // "surface": it is about to mesh; "tets": about to sample the surface and factor; "modes": about
  // to write (which may be over before the signal arrives, so that one is only killed below).
  for (const std::string phase : {"surface: ", "tets: "}) {
    for (const int signal : {SIGKILL, SIGINT, SIGTERM}) {
      Child child(command);
      ASSERT_TRUE(child.wait_for(phase));
      EXPECT_EQ(child.stop(signal), signal == SIGKILL ? -SIGKILL : 75) << phase;
      EXPECT_EQ(read_whole_file(out), old) << phase << signal;
      EXPECT_EQ(read_whole_file(folder.file("ball.build.json")), record);
      if (signal != SIGKILL) {
        EXPECT_FALSE(std::filesystem::exists(out + ".part"));
      }
    }
  }
  Child child(command);
  ASSERT_TRUE(child.wait_for("modes: "));
  child.stop(SIGKILL);
  EXPECT_NO_THROW(read_archetype(out));  // the old one or the new one, whole
}

TEST(Program, GmshGivesTheSameArchetypeEachTime) {
  const ScratchFolder folder;
  write_ply(folder.file("torus.ply"), shapes::torus(0.25, 0.1, 40, 20));
  const std::string body = folder.write(
      "torus.body.toml",
      "schema = 1\nmesh = \"torus.ply\"\ntet = { mesher = \"gmsh\", target = 4000 }\n"
      "material = { density = 8.0, young = 1e5, poisson = 0.3 }\nmodes = { count = 2 }\n");
  for (const std::string name : {"a.h5", "b.h5"})
    ASSERT_EQ(Child({ARCHETIDE_PRECOMPUTE_BIN, "build", body, "-o", folder.file(name)}).wait(), 0);
  EXPECT_EQ(read_whole_file(folder.file("a.h5")), read_whole_file(folder.file("b.h5")));
}

// What the process did with memory before must not matter: gmsh's HXT made 1714 to 1746 tets of one
// surface.
TEST(Program, TetsAreTheSameWhateverTheBodyFileSaysBesides) {
  const ScratchFolder folder;
  write_ply(folder.file("torus.ply"), shapes::torus(0.25, 0.1, 80, 40));
  for (const std::string mesher : {"gmsh", "cgal"}) {
    TetMesh first;
    for (const std::size_t comment : {0, 33, 500, 20'000}) {
      const std::string body = folder.write(
          "torus.body.toml",
          "schema = 1\nmesh = \"torus.ply\"\ntet = { mesher = \"" + mesher +
              "\", target = 1000 }\nmaterial = { density = 8.0, young = 1e5, poisson = 0.3 }\n"
              "modes = { count = 2 }\n# " +
              std::string(comment, 'x') + "\n");
      const std::string out = folder.file("torus.h5");
      ASSERT_EQ(Child({ARCHETIDE_PRECOMPUTE_BIN, "build", body, "-o", out}).wait(), 0);
      const TetMesh tets = read_archetype(out).tets;
      if (comment == 0) first = tets;
      EXPECT_TRUE(tets.tets == first.tets && tets.nodes == first.nodes) << mesher << comment;
    }
  }
}

TEST(Program, OffendingElementsAreNamedBesideTheOutput) {
  const ScratchFolder folder;
  TriMesh open = shapes::sphere(1.0, 2);
  open.triangles.pop_back();
  write_ply(folder.file("open.ply"), open);
  const std::string body = folder.write("open.body.toml",
                                        "schema = 1\nmesh = \"open.ply\"\nmaterial = { density = "
                                        "8.0, young = 1e5, poisson = 0.3 }\n");
  Child child({ARCHETIDE_PRECOMPUTE_BIN, "build", body, "-o", folder.file("out.h5")});
  EXPECT_TRUE(child.wait_for("the elements in question: " + folder.file("out.defects.ply")));
  EXPECT_EQ(child.wait(), 2);
  EXPECT_EQ(read_surface(folder.file("out.defects.ply")).mesh.triangles.size(), 3u);
  EXPECT_FALSE(std::filesystem::exists(folder.file("out.h5")));
}

/// A body file whose repair takes minutes.
std::string slow_body(const ScratchFolder& folder) {
  write_ply(folder.file("row.ply"), testing_meshes::row_of_cubes(1500));
  return folder.write("row.body.toml",
                      "schema = 1\nmesh = \"row.ply\"\nrepair = \"union\"\nmaterial = { density = "
                      "8.0, young = 1e5, poisson = 0.3 }\n");
}

TEST(Program, RefusesARepairThatTakesTooLong) {
  const ScratchFolder folder;
  const std::string out = folder.file("row.h5");
  Child child(
      {ARCHETIDE_PRECOMPUTE_BIN, "build", slow_body(folder), "-o", out, "--time-limit", "1"});
  EXPECT_TRUE(child.wait_for("of 18000 faces was stopped after 1 CPU seconds"));
  EXPECT_TRUE(child.wait_for("the elements in question: " + folder.file("row.defects.ply")));
  EXPECT_EQ(child.wait(), 2);
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_FALSE(std::filesystem::exists(out + ".part"));
}

TEST(Interrupt, EndsARepairAndItsProcess) {
  for (const int signal : {SIGINT, SIGKILL}) {
    const ScratchFolder folder;
    const std::string out = folder.file("row.h5");
    Child child({ARCHETIDE_PRECOMPUTE_BIN, "build", slow_body(folder), "-o", out});
    const pid_t repair = child.wait_for_child();
    ASSERT_GT(repair, 0);
    EXPECT_EQ(child.stop(signal), signal == SIGKILL ? -SIGKILL : 75);
    EXPECT_TRUE(ends_soon(repair));
    EXPECT_FALSE(std::filesystem::exists(out));
  }
}

}  // namespace
}  // namespace archetide
