#include "common/base/memory.h"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/base/input_error.h"

namespace archetide {
namespace {

struct Variable {
  explicit Variable(const char* value) { ::setenv("ARCHETIDE_MEMORY_LIMIT", value, 1); }
  ~Variable() { ::unsetenv("ARCHETIDE_MEMORY_LIMIT"); }
};

TEST(Memory, TheLimitOfTheEnvironmentCounts) {
  const double free = available_memory();
  EXPECT_GT(free, 1e6);
  {
    const Variable limit("1K");  // less than is used
    EXPECT_EQ(available_memory(), 0.0);
    EXPECT_THROW(demand_memory(1.0, "a test", "hint"), MachineError);
  }
  {
    const Variable limit("100000G");
    EXPECT_NEAR(available_memory(), free, 0.5 * free);
    EXPECT_NO_THROW(demand_memory(1.0, "a test", "hint"));
  }
  const Variable wrong("much");
  EXPECT_THROW(available_memory(), InputError);
}

/// A tree of control groups as the system shows it.
class Groups {
 public:
  Groups() { std::filesystem::remove_all(top_); }
  ~Groups() { std::filesystem::remove_all(top_); }
  void write(const std::string& name, const std::string& text) const {
    const std::filesystem::path path = top_ / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
  }
  double free(const std::string& groups) const {
    write("cgroup", groups);
    return free_in_control_groups((top_ / "cgroup").string(), (top_ / "fs").string());
  }

 private:
  std::filesystem::path top_ = fmt::format("{}groups_{}", testing::TempDir(), ::getpid());
};

TEST(Memory, TheTightestGroupOfVersion2Counts) {
  const Groups groups;
  EXPECT_TRUE(std::isinf(groups.free("0::/\n")));
  groups.write("fs/a/b/memory.max", "max\n");
  groups.write("fs/a/b/memory.current", "10\n");
  EXPECT_TRUE(std::isinf(groups.free("0::/a/b\n")));
  groups.write("fs/a/memory.max", "1000\n");
  groups.write("fs/a/memory.current", "400\n");
  EXPECT_EQ(groups.free("0::/a/b\n"), 600.0);
  groups.write("fs/a/memory.stat", "anon 250\ninactive_file 100\nactive_file 50\n");
  EXPECT_EQ(groups.free("0::/a/b\n"), 750.0);
  groups.write("fs/memory.max", "700\n");  // as a container sees its own
  groups.write("fs/memory.current", "400\n");
  EXPECT_EQ(groups.free("0::/\n"), 300.0);
  EXPECT_EQ(groups.free("0::/a/b\n"), 300.0);
}

TEST(Memory, GroupsOfVersion1Count) {
  const Groups groups;
  groups.write("fs/memory/job/memory.limit_in_bytes", "5000\n");
  groups.write("fs/memory/job/memory.usage_in_bytes", "4000\n");
  groups.write("fs/memory/job/memory.stat", "inactive_file 1\ntotal_inactive_file 500\n");
  EXPECT_EQ(groups.free("4:memory:/job\n3:cpu:/job\n0::/\n"), 1500.0);
  EXPECT_TRUE(std::isinf(groups.free("3:cpu:/job\n")));
}

}  // namespace
}  // namespace archetide
