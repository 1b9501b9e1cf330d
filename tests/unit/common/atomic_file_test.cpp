#include "common/atomic_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/byte_stream.h"
#include "common/input_error.h"

namespace archetide {
namespace {

std::string scratch() {
  return testing::TempDir() + "atomic_" + std::to_string(::getpid()) + ".txt";
}

TEST(AtomicFile, ReplacesTheOldFileOnlyAtTheCommit) {
  const std::string path = scratch();
  write_file_atomically(path, "old");
  {
    AtomicFile file(path);
    std::ofstream(file.part()) << "new";
    EXPECT_EQ(read_whole_file(path), "old");
    file.commit();
    EXPECT_EQ(read_whole_file(path), "new");
  }
  EXPECT_EQ(read_whole_file(path), "new");
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  std::filesystem::remove(path);
}

TEST(AtomicFile, LeavesTheOldFileAndNoPartWhenAbandoned) {
  const std::string path = scratch();
  write_file_atomically(path, "old");
  {
    AtomicFile file(path);
    std::ofstream(file.part()) << "half";
  }
  EXPECT_EQ(read_whole_file(path), "old");
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  std::filesystem::remove(path);
}

TEST(AtomicFile, SaysAtOnceThatItCannotBeWritten) {
  EXPECT_THROW(AtomicFile("/nonexistent/folder/file"), MachineError);
  EXPECT_THROW(AtomicFile(std::filesystem::temp_directory_path().string()), MachineError);
}

}  // namespace
}  // namespace archetide
