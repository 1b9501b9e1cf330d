#include "common/files/atomic_file.h"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"

namespace archetide {
namespace {

std::string scratch() { return fmt::format("{}atomic_{}.txt", testing::TempDir(), ::getpid()); }

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
  EXPECT_THROW(AtomicFile(""), InputError);
  EXPECT_THROW(AtomicFile(testing::TempDir() + std::string(300, 'x')), MachineError);
}

// A device would be replaced by a file, and a pipe would wait for its reader.
TEST(AtomicFile, LeavesDevicesAndPipesAlone) {
  EXPECT_THROW(AtomicFile("/dev/full"), MachineError);
  const std::string pipe = scratch() + ".pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THROW(AtomicFile{pipe}, MachineError);
  std::filesystem::rename(pipe, scratch() + ".part");
  EXPECT_THROW(write_file_atomically(scratch(), "text"), MachineError);
  std::filesystem::remove(scratch() + ".part");
}

// Neither waits for a writer nor fills the memory.
TEST(ReadWholeFile, RefusesWhatIsNoFile) {
  const auto refusal = [](const std::string& path) {
    try {
      read_whole_file(path);
    } catch (const FileError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string pipe = scratch() + ".pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_NE(refusal(pipe).find("is a pipe, not a file"), std::string::npos);
  std::filesystem::remove(pipe);
  EXPECT_NE(refusal("/dev/zero").find("is a device, not a file"), std::string::npos);
  EXPECT_NE(refusal("/dev").find("is a folder, not a file"), std::string::npos);
  EXPECT_NE(refusal(testing::TempDir() + std::string(300, 'x')), "");
  EXPECT_NE(refusal(pipe).find("cannot be opened"), std::string::npos);
}

}  // namespace
}  // namespace archetide
