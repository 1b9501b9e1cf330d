// What a state may hold, whatever its hash says.
#include "common/files/state_file.h"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>

#include "common/base/input_error.h"

namespace archetide {
namespace {

class StateFile : public ::testing::Test {
 protected:
  ~StateFile() override { std::filesystem::remove(path_); }
  template <class T>
  void write(const std::string& name, T value) const {
    StateWriter file(path_, "test", 1);
    file.field(name, value);
    file.commit();
  }
  /// What reading says, "" when it goes well.
  template <class T>
  std::string complaint(const std::string& name, T value) const {
    try {
      StateReader file(path_, "test", 1, "");
      file.field(name, value);
      file.demand_hash();
      return "";
    } catch (const FileError& error) {
      return error.what();
    }
  }
  const std::string path_ = fmt::format("{}state_{}.h5", testing::TempDir(), ::getpid());
};

TEST_F(StateFile, StatesAreNumbersButRecordsMayBeUnset) {
  for (const double x : {NAN, INFINITY, -INFINITY}) {
    write("bodies/P", VecX(VecX::Constant(3, x)));
    EXPECT_NE(complaint("bodies/P", VecX()).find("bodies/P holds something that is not a number"),
              std::string::npos);
    write("limits/energy_start", x);
    EXPECT_EQ(complaint("limits/energy_start", 0.0), "");
  }
}

TEST_F(StateFile, SizesOfListsAreNotNegative) {
  StateWriter file(path_, "test", 1);
  std::vector<int> sizes = {-1, 4};
  VecX all = VecX::Ones(3);
  file.field("q_sizes", sizes);
  file.field("q", all);
  file.commit();
  EXPECT_NE(complaint("q", std::vector<VecX>()).find("does not have its sizes"), std::string::npos);
}

}  // namespace
}  // namespace archetide
