// The script of `make -f pipeline.mk nightly`: which parts it does, with a make that only says what it was asked.

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "source_tree.h"

namespace {

namespace fs = std::filesystem;

class Nightly : public testing::Test {
 protected:
  void SetUp() override {
    fs::create_directories(top_ / "out/hard");
    write("make",
          "#!/bin/sh\necho \"$*\" >>said\n"
          "[ \"$1\" != check ] || echo '100% tests passed, 0 tests failed out of 7'\n"
          "! grep -qx \"$1\" fails 2>/dev/null\n");
    fs::permissions(top_ / "make", fs::perms::owner_all);
    write("out/hard/H03.log",
          "[       OK ] SlowDam.Breaks/2 (9 ms)\n[       OK ] Dam.Breaks (9 ms)\n"
          "[  FAILED  ] SlowDam.Leaks (9 ms)\n");
  }
  void TearDown() override { fs::remove_all(top_); }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(top_ / name) << text;
  }
  std::string read(const std::string& name) const {
    std::ifstream file(top_ / name);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  /// What make was asked, one a line; `code_` becomes the script's exit code.
  std::string asked(const std::string& commit, const std::string& variables = "") {
    fs::remove(top_ / "said");
    const std::string script = (source_tree::root() / "tests/nightly/run_nightly.sh").string();
    const std::string command = "cd '" + top_.string() + "' && PARTS= " + variables + " sh '" +
                                script + "' out " + commit + " ./make >printed 2>&1";
    code_ = WEXITSTATUS(std::system(command.c_str()));
    return read("said");
  }

  fs::path top_ = fs::temp_directory_path() / fmt::format("archetide_nightly_{}", ::getpid());
  int code_ = -1;
};

TEST_F(Nightly, DoesWhatHasNotPassedAtThisCommit) {
  write("fails", "fuzz\n");
  const std::string first = asked("one");
  EXPECT_EQ(code_, 1);
  EXPECT_EQ(
      first,
      "check\nhard\nslow NOT=^(SlowDam\\.Breaks/2)$$\nscorecard\npaper QUICK=1\nfaults\nmutate\n"
      "fuzz\nsanitize-address\nsanitize-thread\nlong\n");
  EXPECT_EQ(asked("one"), "fuzz\n");
  EXPECT_EQ(code_, 1);
  write("fails", "");
  EXPECT_EQ(asked("one"), "fuzz\n");
  EXPECT_EQ(code_, 0);
  EXPECT_EQ(asked("one"), "");
  EXPECT_EQ(asked("two", "PARTS='faults mutate'"), "faults\nmutate\n");
  EXPECT_EQ(asked("two", "PARTS=slow"), "slow\n");  // the logs of hard are of other programs
  asked("two-dirty", "PARTS=faults");
  EXPECT_EQ(asked("two-dirty", "PARTS=faults"), "faults\n");
}

TEST_F(Nightly, TellsHowPartsWent) {
  write("fails", "fuzz\n");
  asked("one");
  const std::string trend = read("out/nightly/trend.csv"), page = read("out/nightly/index.html");
  EXPECT_TRUE(source_tree::holds(trend, ",one,fast,passed,")) << trend;
  EXPECT_TRUE(source_tree::holds(trend, ",tests passed; 0 tests failed out of 7\n")) << trend;
  EXPECT_TRUE(source_tree::holds(trend, ",one,fuzz,FAILED,")) << trend;
  EXPECT_TRUE(source_tree::holds(page, "<td>tests passed; 0 tests failed out of 7</td>")) << page;
  EXPECT_TRUE(source_tree::holds(page, "<td class=bad>FAILED</td>")) << page;
  EXPECT_TRUE(source_tree::holds(page, "<a href=\"fuzz.log\">")) << page;
  asked("two");  // the parts that have passed are still told, and the night before
  const std::string later = read("out/nightly/index.html");
  EXPECT_LT(later.find("<br>two"), later.find("<br>one")) << later;
  EXPECT_TRUE(source_tree::holds(later, "<br>one")) << later;
}

}  // namespace
