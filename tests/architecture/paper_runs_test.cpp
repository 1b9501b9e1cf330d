// The script of `make -f pipeline.mk paper`: which runs it makes, with programs that only say how they end.

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "source_tree.h"

namespace {

namespace fs = std::filesystem;

// Ends as the file DIR.end says (0 without one), and leaves what a run leaves.
const char* const kSimulator = R"(#!/bin/sh
verb=$1; shift
for word; do [ "$before" != -o ] || folder=$word; before=$word; done
case $verb in
check) case $1 in *odd*) echo "odd.scene.toml: no such file" >&2; exit 2;; esac ;;
run)
  echo "run $*" >>said
  mkdir -p "$folder"; echo '{}' >"$folder/manifest.json"
  code=$(cat "$folder.end" 2>/dev/null || echo 0)
  [ "$code" != 0 ] || touch "$folder/done.stamp"
  exit "$code" ;;
render) echo "render $1" >>said ;;
esac
)";

class PaperRuns : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(top_);
    program("archetide-sim", kSimulator);
    program("bench_paper", "#!/bin/sh\necho \"page $3\" >>said\n");
    write("list",
          "# name | figure | scene | goal | settings | quick | shows\n"
          "one | 1 | scene | - | a=[1,2] | b=3 | x\n"
          "two | 2 | scene | - |  | b=4 | y\n"
          "odd | 3 | odd | - |  | b=4 | z\n");
    write("scenes/scene.scene.toml"), write("scenes/odd.scene.toml");
  }
  void TearDown() override { fs::remove_all(top_); }

  void write(const std::string& name, const std::string& text = "") const {
    fs::create_directories((top_ / name).parent_path());
    std::ofstream(top_ / name) << text;
  }
  void program(const std::string& name, const std::string& text) const {
    write("bin/" + name, text);
    fs::permissions(top_ / "bin" / name, fs::perms::owner_all);
  }

  /// What the programs were asked, one a line; `code_` becomes the script's exit code.
  std::string asked(const std::string& variables) {
    fs::remove(top_ / "said");
    const std::string command = "cd '" + top_.string() + "' && " + variables + " sh '" +
                                (source_tree::root() / "tests/bench/paper/run_paper.sh").string() +
                                "' list bin . archetypes out >printed 2>&1";
    code_ = WEXITSTATUS(std::system(command.c_str()));
    std::ifstream said(top_ / "said");
    return {std::istreambuf_iterator<char>(said), {}};
  }

  fs::path top_ = fs::temp_directory_path() / fmt::format("archetide_paper_{}", ::getpid());
  int code_ = -1;
};

TEST_F(PaperRuns, AFinishedRunIsNotRunAgain) {
  const std::string first = asked("SCENES='one two'");
  EXPECT_EQ(code_, 0);
  EXPECT_TRUE(source_tree::holds(first, "run ./scenes/scene.scene.toml -o out/one ")) << first;
  EXPECT_TRUE(
      source_tree::holds(first, "--set a=[1,2] --set output.checkpoint={every_frames=24,keep=1}\n"))
      << first;
  EXPECT_TRUE(source_tree::holds(first, "render out/one")) << first;
  EXPECT_EQ(asked("SCENES='one two'"), "page \npage \npage \n");
  EXPECT_TRUE(source_tree::holds(asked("SCENES=one QUICK=1"), "--set expect=absent --set b=3\n"));
  EXPECT_FALSE(source_tree::holds(asked("SCENES=two"), "one"));
}

TEST_F(PaperRuns, OtherScenesRunAfterOneThatFails) {
  write("out/one.end", "3");
  const std::string said = asked("SCENES='one two'");
  EXPECT_EQ(code_, 3);
  EXPECT_TRUE(source_tree::holds(said, "-o out/two ")) << said;
  EXPECT_TRUE(said.ends_with("page \n")) << said;
  EXPECT_FALSE(source_tree::holds(asked("SCENES='one two'"), "run "));  // the same programs
  EXPECT_EQ(code_, 3);
  write("out/one.end", "0");
  program("archetide-sim", kSimulator);
  EXPECT_TRUE(source_tree::holds(asked("SCENES='one two'"), "-o out/one "));
  EXPECT_EQ(code_, 0);
}

TEST_F(PaperRuns, ARefusedSceneKeepsItsReason) {
  asked("SCENES=odd");
  EXPECT_EQ(code_, 3);
  std::ifstream refused(top_ / "out/odd.refused");
  std::string line;
  std::getline(refused, line);
  EXPECT_EQ(line, "odd.scene.toml: no such file");
}

TEST_F(PaperRuns, AStoppedRunStopsAllAndGoesOnLater) {
  write("out/one.end", "75");
  EXPECT_FALSE(source_tree::holds(asked("SCENES='one two'"), "out/two"));
  EXPECT_EQ(code_, 75);
  fs::remove(top_ / "out/one.end");
  const std::string said = asked("SCENES='one two'");
  EXPECT_EQ(code_, 0);
  EXPECT_TRUE(source_tree::holds(said, "-o out/one --resume auto")) << said;
  EXPECT_TRUE(source_tree::holds(said, "-o out/two ")) << said;
}

TEST_F(PaperRuns, ARunThatFilledTheDiskGoesOn) {
  write("out/one.end", "5");
  asked("SCENES=one");
  EXPECT_EQ(code_, 3);
  fs::remove(top_ / "out/one.end");  // the same programs
  EXPECT_TRUE(source_tree::holds(asked("SCENES=one"), "-o out/one --resume auto"));
  EXPECT_EQ(code_, 0);
}

TEST_F(PaperRuns, AnUnknownNameIsRefused) {
  EXPECT_EQ(asked("SCENES='one three'"), "");
  EXPECT_EQ(code_, 2);
}

}  // namespace
