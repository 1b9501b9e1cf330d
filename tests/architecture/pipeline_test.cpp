// pipeline.mk makes no command of a file's name: with programs that only print their words.

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "source_tree.h"

namespace {

namespace fs = std::filesystem;

/// A folder with a body, a scene and stand-ins for the two programs.
class Pipeline : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("make --version >/dev/null 2>&1") != 0) GTEST_SKIP() << "make is not there";
    fs::create_directories(top_ / "bin");
    for (const char* name : {"bin/archetide-sim", "bin/archetide-precompute"}) {
      write(name, "#!/bin/sh\nfor w; do printf '<%s>' \"$w\"; done; echo\n");
      fs::permissions(top_ / name, fs::perms::owner_all);
    }
    write("a/bodies/duck.body.toml");
    write("a/scenes/pond.scene.toml");
  }
  void TearDown() override { fs::remove_all(top_); }

  void write(const std::string& name, const std::string& text = "") const {
    fs::create_directories((top_ / name).parent_path());
    std::ofstream(top_ / name) << text;
  }

  /// What make prints, both streams; `code_` becomes its exit code.
  std::string make(const std::string& words) {
    const std::string command = "cd '" + top_.string() + "' && make -f '" +
                                (source_tree::root() / "pipeline.mk").string() +
                                "' ASSETS=a OUT=out BUILD=. " + words + " 2>&1 </dev/null";
    std::FILE* pipe = ::popen(command.c_str(), "r");
    std::string text;
    for (int c; (c = std::fgetc(pipe)) != EOF;) text += static_cast<char>(c);
    code_ = WEXITSTATUS(::pclose(pipe));
    return text;
  }

  bool ran() const { return fs::exists(top_ / "ran"); }

  fs::path top_ = fs::temp_directory_path() / fmt::format("archetide_pipeline_{}", ::getpid());
  int code_ = -1;
};

TEST_F(Pipeline, PlainNamesReachThePrograms) {
  write("a/bodies/B\xC3\xA4r-1.2_x+y@z,w.body.toml");
  const std::string text = make("");
  EXPECT_EQ(code_, 0) << text;
  EXPECT_TRUE(source_tree::holds(
      text, "<build><a/bodies/B\xC3\xA4r-1.2_x+y@z,w.body.toml><-o><out/archetypes/"))
      << text;
  EXPECT_TRUE(source_tree::holds(text, "<run><a/scenes/pond.scene.toml><-o><out/runs/pond>"))
      << text;
}

TEST_F(Pipeline, NamesThatAreNoWordsAreRefusedByName) {
  for (const std::string name :
       {"bodies/my duck.body.toml", "bodies/`touch ran`.body.toml",
        "scenes/$(touch ran).scene.toml", "scenes/a;touch ran;.scene.toml", "bodies/a'b.body.toml",
        "bodies/a\"b.body.toml", "scenes/x=1.scene.toml", "scenes/50%.scene.toml",
        "scenes/a:b.scene.toml", "bodies/a#b.body.toml", "bodies/a\\b.body.toml"}) {
    write("a/" + name);
    for (const char* goal : {"", "run/pond"}) {
      const std::string text = make(goal);
      EXPECT_EQ(code_, 2) << name << " " << goal;
      EXPECT_TRUE(source_tree::holds(
          text, "\"a/" + name + "\": make cannot handle this file name; rename it"))
          << text;
    }
    make("help");
    EXPECT_EQ(code_, 0) << name;
    EXPECT_FALSE(ran()) << name;
    fs::remove(top_ / "a" / name);
  }
  write("a/scenes/two\nlines.scene.toml");
  EXPECT_TRUE(
      source_tree::holds(make("list"), "\"a/scenes/two?lines.scene.toml\": make cannot handle"));
  EXPECT_EQ(code_, 2);
}

TEST_F(Pipeline, FoldersThatAreNoWordsAreRefusedByName) {
  EXPECT_TRUE(source_tree::holds(make("list OUT='my films'"),
                                 "OUT=my films: make cannot handle this folder"));
  EXPECT_EQ(code_, 2);
  EXPECT_TRUE(
      source_tree::holds(make("list \"OUT=it's\""), "OUT=it's: make cannot handle this folder"));
}

TEST_F(Pipeline, ReportHandsRunFoldersOverWhateverTheyAreCalled) {
  write("out/runs/`touch ran` b/done.stamp");
  EXPECT_TRUE(
      source_tree::holds(make("report"), "<report><out/runs/`touch ran` b><-o><out/report.html>"));
  EXPECT_FALSE(ran());
}

TEST_F(Pipeline, NewBodyMakesOnlyWhatBodiesCanBuild) {
  for (const char* name : {"ein tier.obj", "x`touch ran`.obj", "x\"y.obj"}) {
    write(name);
    const std::string text = make("new-body M='" + std::string(name) + "'");
    EXPECT_EQ(code_, 2) << name;
    EXPECT_TRUE(source_tree::holds(
        text, std::string(name) + ": make cannot handle this file name; rename it"))
        << text;
  }
  write("tier.obj");
  EXPECT_TRUE(source_tree::holds(make("new-body M=tier.obj NAME='a b'"),
                                 "new-body: a b: make cannot handle"));
  EXPECT_EQ(code_, 2);
  EXPECT_FALSE(ran());
  const std::string text = make("new-body M=tier.obj NAME=cow SCALE='`touch ran`'");
  EXPECT_EQ(code_, 0) << text;
  EXPECT_TRUE(source_tree::holds(text,
                                 "<propose><-o><a/bodies/cow.body.toml><--mesh-name=tier.obj>"
                                 "<--scale=`touch ran`><-t><1><--><tier.obj>"))
      << text;
  EXPECT_FALSE(ran());
  EXPECT_TRUE(fs::exists(top_ / "a/bodies/tier.obj"));
}

TEST_F(Pipeline, NewBodyLeavesNoMeshWithoutABodyFile) {
  write("tier.obj", "one");
  write("bin/archetide-precompute", "#!/bin/sh\nexit 3\n");
  make("new-body M=tier.obj");
  EXPECT_EQ(code_, 2);
  EXPECT_FALSE(fs::exists(top_ / "a/bodies/tier.obj"));
  write("a/bodies/tier.obj", "another");
  EXPECT_TRUE(source_tree::holds(make("new-body M=tier.obj"),
                                 "new-body: a/bodies/tier.obj is another mesh"));
  EXPECT_EQ(code_, 2);
  write("a/bodies/tier.obj", "one");
  make("new-body M=a/bodies/tier.obj");
  EXPECT_EQ(code_, 2);
  EXPECT_TRUE(fs::exists(top_ / "a/bodies/tier.obj"));  // it was there before
}

}  // namespace
