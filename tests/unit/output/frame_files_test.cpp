#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "runtime/output/ply.h"
#include "runtime/output/vtp.h"
#include "tests/unit/output/scratch_folder.h"
#include "tests/unit/output/shapes.h"

namespace archetide {
namespace {

// Frames hold float32: half a unit in the last place of numbers up to 4.
constexpr double kFloatTolerance = 2.4e-7;

void expect_same(const SurfaceMesh& a, const SurfaceMesh& b) {
  ASSERT_EQ(a.vertices.size(), b.vertices.size());
  ASSERT_EQ(a.triangles, b.triangles);
  for (std::size_t v = 0; v < a.vertices.size(); ++v) {
    EXPECT_LE((a.vertices[v] - b.vertices[v]).cwiseAbs().maxCoeff(), kFloatTolerance);
    EXPECT_LE((a.normals[v] - b.normals[v]).cwiseAbs().maxCoeff(), kFloatTolerance);
  }
}

SurfaceMesh two_balls() {
  SurfaceMesh mesh = ball(Vec3(1, 2, 3), 0.5, 4, 6);
  const SurfaceMesh other = ball(Vec3(-1, 0, 0.3), 0.25, 5, 4);
  const int first = static_cast<int>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  mesh.normals.insert(mesh.normals.end(), other.normals.begin(), other.normals.end());
  mesh.body.insert(mesh.body.end(), other.body.begin(), other.body.end());
  for (const Vec3i& t : other.triangles) mesh.triangles.push_back(t + Vec3i::Constant(first));
  return mesh;
}

void cut_last_bytes(const std::string& path, int count) {
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - count);
}

TEST(FrameFiles, PlyReadsBackWhatWasWritten) {
  const ScratchFolder folder;
  write_ply(folder / "a.ply", two_balls());
  expect_same(two_balls(), read_ply(folder / "a.ply"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.ply.part"));
}

TEST(FrameFiles, VtpReadsBackWhatWasWrittenWithBodiesAndRest) {
  const ScratchFolder folder;
  SurfaceMesh mesh = two_balls();
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) mesh.rest.emplace_back(0.25 * v, -1.5, v);
  write_vtp(folder / "a.vtp", mesh, 0.25);
  const SurfaceMesh back = read_vtp(folder / "a.vtp");
  expect_same(two_balls(), back);
  EXPECT_EQ(back.body, two_balls().body);
  EXPECT_EQ(back.rest, mesh.rest);
}

TEST(FrameFiles, EmptySurfacesAreFiles) {
  const ScratchFolder folder;
  write_ply(folder / "a.ply", {});
  write_vtp(folder / "a.vtp", {}, 0.0);
  EXPECT_TRUE(read_ply(folder / "a.ply").triangles.empty());
  EXPECT_TRUE(read_vtp(folder / "a.vtp").triangles.empty());
}

TEST(FrameFiles, VtpOffsetsAddUpToTheAppendedBlock) {
  const ScratchFolder folder;
  write_vtp(folder / "a.vtp", two_balls(), 0.25);
  const std::string bytes = read_whole_file(folder / "a.vtp");
  EXPECT_NE(bytes.find("header_type=\"UInt64\""), std::string::npos);
  EXPECT_NE(bytes.find(">0.25</DataArray>"), std::string::npos);
  // Walk over the blocks as VTK does: a length, then that many bytes, each where its offset says.
  const std::size_t start = bytes.find("<AppendedData encoding=\"raw\">\n_") + 31;
  std::size_t at = start, tag = 0;
  while ((tag = bytes.find("offset=\"", tag)) != std::string::npos && tag < start) {
    tag += 8;
    ASSERT_EQ(std::stoull(bytes.substr(tag)), at - start);
    at += take_number<std::uint64_t>(bytes, at);
  }
  EXPECT_EQ(bytes.substr(at), "\n</AppendedData>\n</VTKFile>\n");
}

TEST(FrameFiles, ParticlesCarryRadiusAndSign) {
  const ScratchFolder folder;
  Particles particles;
  particles.position = {Vec3(1, 2, 3), Vec3(4, 5, 6)};
  particles.radius = {0.1f, 0.2f};
  particles.sign = {1, -1};
  write_particles_vtp(folder / "p.vtp", particles, 1.0);
  const std::string bytes = read_whole_file(folder / "p.vtp");
  EXPECT_NE(bytes.find("NumberOfPoints=\"2\" NumberOfVerts=\"2\""), std::string::npos);
  EXPECT_EQ(read_vtp(folder / "p.vtp").vertices.size(), 2u);
}

TEST(FrameFiles, MarkersCarryTheirVelocity) {
  const ScratchFolder folder;
  write_markers_vtp(folder / "m.vtp", {Vec3(1, 2, 3)}, {Vec3(0.5, 0, -0.25)}, 1.0);
  const std::string bytes = read_whole_file(folder / "m.vtp");
  EXPECT_NE(bytes.find("NumberOfPoints=\"1\" NumberOfVerts=\"1\""), std::string::npos);
  EXPECT_NE(bytes.find("Name=\"velocity\" NumberOfComponents=\"3\""), std::string::npos);
  EXPECT_EQ(read_vtp(folder / "m.vtp").vertices.at(0), Vec3(1, 2, 3));
}

TEST(FrameFiles, TruncatedOrForeignFilesAreRefused) {
  const ScratchFolder folder;
  write_ply(folder / "a.ply", two_balls());
  cut_last_bytes(folder / "a.ply", 1);
  EXPECT_THROW(read_ply(folder / "a.ply"), FileError);
  write_vtp(folder / "a.vtp", two_balls(), 0.0);
  cut_last_bytes(folder / "a.vtp", 400);
  EXPECT_THROW(read_vtp(folder / "a.vtp"), FileError);
  std::ofstream(folder / "b.ply") << "ply\nformat ascii 1.0\nend_header\n";
  EXPECT_THROW(read_ply(folder / "b.ply"), FileError);
  EXPECT_THROW(read_vtp(folder / "missing.vtp"), FileError);
  SurfaceMesh torn = two_balls();
  torn.rest.resize(3, Vec3::Zero());
  write_vtp(folder / "c.vtp", torn, 0.0);
  EXPECT_THROW(read_vtp(folder / "c.vtp"), FileError);
}

TEST(FrameFiles, PvdNamesEveryFrameWithItsTime) {
  const ScratchFolder folder;
  PvdIndex index(folder / "bodies.pvd");
  index.add(0.0, "bodies.000000.vtp");
  index.add(1.0 / 24.0, "bodies.000001.vtp");
  const std::string text = read_whole_file(folder / "bodies.pvd");
  EXPECT_NE(text.find("timestep=\"0\" part=\"0\" file=\"bodies.000000.vtp\""), std::string::npos);
  EXPECT_NE(text.find("timestep=\"0.041666666666666664\" part=\"0\" file=\"bodies.000001.vtp\""),
            std::string::npos);
}

}  // namespace
}  // namespace archetide
