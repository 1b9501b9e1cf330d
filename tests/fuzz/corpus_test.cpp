// Every input in corpus/TARGET, seeds and what the fuzzers once found, read again.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/fuzz/fuzz_targets.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

std::vector<const FuzzTarget*> all_targets() {
  std::vector<const FuzzTarget*> all;
  for (const auto* list : {&text_targets(), &stored_targets()})
    for (const FuzzTarget& target : *list) all.push_back(&target);
  return all;
}

class Corpus : public testing::TestWithParam<const FuzzTarget*> {};

TEST_P(Corpus, EveryInputIsReadOrRefused) {
  const FuzzTarget& target = *GetParam();
  int count = 0;
  for (const auto& file : fs::directory_iterator(fs::path(ARCHETIDE_CORPUS) / target.name)) {
    SCOPED_TRACE(file.path());
    EXPECT_NO_THROW(target.run(bytes_of(file.path())));
    ++count;
  }
  EXPECT_GT(count, 0);
}

INSTANTIATE_TEST_SUITE_P(Fuzz, Corpus, testing::ValuesIn(all_targets()),
                         [](const auto& target) { return target.param->name; });

TEST(Corpus, EveryFolderHasATarget) {
  for (const auto& folder : fs::directory_iterator(ARCHETIDE_CORPUS))
    EXPECT_NE(find_fuzz_target(folder.path().filename().string()), nullptr) << folder.path();
}

}  // namespace
}  // namespace archetide
