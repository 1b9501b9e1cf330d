// The project stands on its own: no file names a folder of the machine it was written on.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "source_tree.h"

namespace {

const std::vector<std::string> kProject = {"CMakeLists.txt", "pipeline.mk", "README.md", ".ci",
                                           "common",         "precompute",  "runtime",   "assets",
                                           "tests",          "docs"};

bool is_text(const std::string& path) {
  for (const char* ending : {".h", ".cpp", ".cmake", ".txt", ".mk", ".md", ".toml", "/run"})
    if (path.ends_with(ending)) return true;
  return false;
}

/// Words that no file may hold; put together here so that this file does not hold them.
std::vector<std::string> forbidden(const std::string& path) {
  const std::string slash = "/";
  std::vector<std::string> words = {slash + "work" + slash, slash + "home" + slash,
                                    slash + "root" + slash, slash + "tmp/build",
                                    std::string("work") + "place"};
  // Tests may read reference values that stand beside the project, where they are there.
  if (!path.starts_with("tests/")) words.push_back("shared" + slash);
  return words;
}

std::vector<std::string> faults_of(const std::string& path, const std::string& text) {
  std::vector<std::string> faults;
  for (const std::string& word : forbidden(path))
    if (text.find(word) != std::string::npos) faults.push_back(path + " holds \"" + word + "\"");
  return faults;
}

}  // namespace

TEST(Wording, NoFileNamesAFolderOfOneMachine) {
  int read = 0;
  for (const std::string& path : source_tree::files(kProject)) {
    if (!is_text(path)) continue;
    ++read;
    const auto faults = faults_of(path, source_tree::read(path));
    EXPECT_TRUE(faults.empty()) << source_tree::joined(faults);
  }
  EXPECT_GT(read, 100);  // the tree was found
}

TEST(Wording, PlantedFolderIsFound) {
  const std::string planted = "see /ho" + std::string("me/someone/mesh.obj");
  EXPECT_EQ(faults_of("common/a.cpp", planted).size(), 1u);
  const std::string reference = "../sha" + std::string("red/reference");
  EXPECT_EQ(faults_of("common/a.cpp", reference).size(), 1u);
  EXPECT_TRUE(faults_of("tests/unit/a.cpp", reference).empty());
}
