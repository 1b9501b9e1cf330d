#include "common/archetype/skin.h"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "common/archetype/archetype.h"
#include "common/base/byte_stream.h"
#include "common/base/check.h"
#include "common/base/input_error.h"
#include "common/files/atomic_file.h"

namespace archetide {
namespace {

std::string skin_scratch(const std::string& name) {
  return fmt::format("{}skin_{}_{}", testing::TempDir(), ::getpid(), name);
}

Skin sample() {
  Skin s;
  s.name = "sample", s.generator = "test 1", s.recipe = "schema = 1\n";
  s.mesh_file = "sample.obj", s.mesh_hash = "ab12", s.blend = 0.03;
  s.surface.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  s.surface.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  s.parts = {"bell", "arm"};
  s.part_of = {{0, 1}, {1, 0}, {0, 0}, {1, 0}};
  s.weights = {0.25, 0.75, 0, 0, 1, 0, 0, 0, 0.5, 0.5, 0, 0, 0.125, 0.875, 0, 0};
  s.joints = {{0, 1, {Vec3(0, 0, 1), Vec3(0, 1, 0)}}, {1, 0, {Vec3(1, 2, 3)}}};
  return s;
}

std::string failure(const std::string& path) {
  try {
    read_skin(path);
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

TEST(SkinFile, ReadsWhatWasWrittenByteForByteTheSame) {
  const std::string a = skin_scratch("a.h5"), b = skin_scratch("b.h5");
  const std::string hash = write_skin(a, sample());
  write_skin(b, sample());
  EXPECT_EQ(read_whole_file(a), read_whole_file(b));
  const Skin s = read_skin(a);
  EXPECT_EQ(s.content_hash, hash);
  EXPECT_EQ(s.name, "sample");
  EXPECT_EQ(s.parts, sample().parts);
  EXPECT_EQ(s.part_of, sample().part_of);
  EXPECT_EQ(s.weights, sample().weights);
  EXPECT_EQ(s.blend, 0.03);
  ASSERT_EQ(s.joints.size(), 2u);
  EXPECT_EQ(s.joints[0].points, sample().joints[0].points);
  EXPECT_EQ(s.joints[1].a, 1);
  EXPECT_EQ(s.surface.triangles, sample().surface.triangles);
  EXPECT_EQ(s.weight(0, 1), 0.75);
  EXPECT_TRUE(is_skin_file(a));
  std::filesystem::remove(a), std::filesystem::remove(b);
}

TEST(SkinFile, ASkinIsNoBodyAndADamagedOneNoSkin) {
  const std::string path = skin_scratch("c.h5");
  write_skin(path, sample());
  try {
    read_archetype(path);
    FAIL();
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find("a skin, not a body"), std::string::npos);
    EXPECT_EQ(std::string(error.what()).find("build"), std::string::npos) << error.what();
  }
  std::string bytes = read_whole_file(path);
  const std::size_t at = bytes.find("bell\narm");
  ASSERT_NE(at, std::string::npos);
  bytes[at] = 'B';
  std::filesystem::remove(path);
  write_file_atomically(path, bytes);
  EXPECT_NE(failure(path).find("do not match their content_hash"), std::string::npos)
      << failure(path);
  EXPECT_NE(failure(skin_scratch("none.h5")).find("none.h5"), std::string::npos);
  std::filesystem::remove(path);
}

TEST(SkinFile, WeightsMustSumToOne) {
  Skin s = sample();
  s.weights[0] += 1e-9;
  EXPECT_THROW(validate(s), AssertionError);
  s = sample();
  s.weights[0] = -0.25, s.weights[1] = 1.25;
  EXPECT_THROW(validate(s), AssertionError);
  s = sample();
  s.part_of[1][0] = 2;
  EXPECT_THROW(validate(s), AssertionError);
}

}  // namespace
}  // namespace archetide
