#include "common/files/surface_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <sstream>

#include "common/base/input_error.h"
#include "tests/support/holds.h"
#include "tests/unit/precompute/precompute_test_meshes.h"

namespace archetide {
namespace {

using testing_meshes::cube;
using testing_meshes::ScratchFolder;

template <class T>
std::string raw(T value, bool big_endian = false) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

std::string as_obj(const TriMesh& m) {
  std::ostringstream text;
  text.precision(17);
  text << "# a comment\no cube\n";
  for (const Vec3& x : m.vertices)
    text << "v " << x[0] << ' ' << x[1] << "\t" << x[2] << " 1.0\r\n";
  text << "vn 0 0 1\nvt 0 0\ns off\n";
  for (const Vec3i& t : m.triangles) {
    text << "f " << t[0] + 1 << "//1 " << t[1] + 1 << "/1/1 " << t[2] - 8 << " # relative\n";
  }
  return text.str();
}

std::string as_off(const TriMesh& m) {
  std::ostringstream text;
  text.precision(17);
  text << "OFF\n# counts\n" << m.vertices.size() << ' ' << m.triangles.size() << " 0\n\n";
  for (const Vec3& x : m.vertices) text << x.transpose() << '\n';
  for (const Vec3i& t : m.triangles) text << "3 " << t.transpose() << " 255 0 0\n";
  return text.str();
}

enum class Ply { kText, kLittle, kBig };

std::string as_ply(const TriMesh& m, Ply kind) {
  std::ostringstream out;
  out.precision(17);
  const char* format[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  out << "ply\nformat " << format[static_cast<int>(kind)]
      << " 1.0\ncomment made by hand\nelement vertex " << m.vertices.size()
      << "\nproperty uchar red\nproperty double x\nproperty double y\nproperty float64 z\n"
      << "element face " << m.triangles.size()
      << "\nproperty list uchar int vertex_indices\nproperty list uchar float "
         "texcoord\nend_header\n";
  const bool big = kind == Ply::kBig;
  for (const Vec3& x : m.vertices) {
    if (kind == Ply::kText)
      out << "7 " << x.transpose() << '\n';
    else
      out << raw<std::uint8_t>(7) << raw(x[0], big) << raw(x[1], big) << raw(x[2], big);
  }
  for (const Vec3i& t : m.triangles) {
    if (kind == Ply::kText)
      out << "3 " << t.transpose() << " 1 0.5\n";
    else
      out << raw<std::uint8_t>(3) << raw(t[0], big) << raw(t[1], big) << raw(t[2], big)
          << raw<std::uint8_t>(1) << raw(0.5f, big);
  }
  return out.str();
}

std::string as_stl(const TriMesh& m, bool binary) {
  std::ostringstream out;
  out.precision(9);
  if (binary)
    out << "solid, but binary" << std::string(63, ' ')
        << raw(static_cast<std::uint32_t>(m.triangles.size()));
  else
    out << "solid cube\n";
  for (const Vec3i& t : m.triangles) {
    out << (binary ? std::string(12, '\0') : " facet normal 0 0 0\n  outer loop\n");
    for (const int v : t) {
      const Eigen::Vector3f x = m.vertices[v].cast<float>();
      if (binary)
        out << raw(x[0]) << raw(x[1]) << raw(x[2]);
      else
        out << "   vertex " << x.transpose() << '\n';
    }
    out << (binary ? std::string(2, '\0') : "  endloop\n endfacet\n");
  }
  if (!binary) out << "endsolid\n";
  return out.str();
}

/// Numbers that need all their digits.
TriMesh odd_cube() { return cube(Vec3(0.1, -1.0 / 3.0, 1e-7), 0.7); }

void expect_same(const SurfaceFile& file, const TriMesh& mesh) {
  EXPECT_EQ(file.mesh.vertices, mesh.vertices);
  EXPECT_EQ(file.mesh.triangles, mesh.triangles);
  EXPECT_EQ(file.face_numbers.size(), mesh.triangles.size());
  EXPECT_EQ(file.face_numbers.back(), static_cast<int>(mesh.triangles.size()));
}

std::string refusal(const std::string& path) {
  try {
    read_surface(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(SurfaceIo, ReadsIndexedFormatsToTheLastBit) {
  const ScratchFolder folder;
  const TriMesh mesh = odd_cube();
  expect_same(read_surface(folder.write("a.obj", as_obj(mesh))), mesh);
  expect_same(read_surface(folder.write("a.off", as_off(mesh))), mesh);
  expect_same(read_surface(folder.write("a.PLY", as_ply(mesh, Ply::kText))), mesh);
  expect_same(read_surface(folder.write("little.ply", as_ply(mesh, Ply::kLittle))), mesh);
  expect_same(read_surface(folder.write("big.ply", as_ply(mesh, Ply::kBig))), mesh);
}

TEST(SurfaceIo, ReadsStlAsASoupOfFloatTriangles) {
  const ScratchFolder folder;
  const TriMesh mesh = odd_cube();
  for (const bool binary : {false, true}) {
    const SurfaceFile file = read_surface(folder.write("a.stl", as_stl(mesh, binary)));
    ASSERT_EQ(file.mesh.triangles.size(), 12u);
    ASSERT_EQ(file.mesh.vertices.size(), 36u);
    for (int t = 0; t < 12; ++t) {
      for (int i = 0; i < 3; ++i) {
        // Nine decimal digits, like four bytes, give back every float.
        const Eigen::Vector3f written = mesh.vertices[mesh.triangles[t][i]].cast<float>();
        const Eigen::Vector3f read = file.mesh.vertices[file.mesh.triangles[t][i]].cast<float>();
        EXPECT_EQ(read, written);
      }
    }
  }
}

TEST(SurfaceIo, CutsPolygonsIntoFansThatKeepTheFileFaceNumber) {
  const ScratchFolder folder;
  const SurfaceFile file = read_surface(folder.write(
      "quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 .5 1\nf 1 2 5\nf -5 -4 -3 -2\n"));
  EXPECT_EQ(file.mesh.triangles, (std::vector<Vec3i>{{0, 1, 4}, {0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(file.face_numbers, (std::vector<int>{1, 2, 2}));
  EXPECT_EQ(file.polygons, 1);
}

TEST(SurfaceIo, NamesTheLineOfWhatItCannotRead) {
  const ScratchFolder folder;
  const auto text = [&](const std::string& name, const std::string& bytes) {
    return refusal(folder.write(name, bytes));
  };
  EXPECT_TRUE(holds(text("a.obj", "v 0 0 0\nv 1 0 zero\n"),
                    "a.obj:2: error: coordinate: expected a number, found \"zero\""));
  EXPECT_TRUE(holds(text("a.obj", "v 0 0 0\nv 1 0\n"), "a.obj:2: error: coordinate"));
  EXPECT_TRUE(holds(text("a.obj", "v 0 0 0\nf 1 0 1\n"), "a.obj:2: error: face corner"));
  EXPECT_TRUE(holds(text("a.obj", "v 0 0 0\nf 1 1\n"), "a.obj:2: error: a face with 2 corners"));
  EXPECT_TRUE(
      holds(text("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n"), "face 1 names vertex 4"));
  EXPECT_TRUE(holds(text("a.obj", "v 0 0 0\n"), "no faces in this file"));
  EXPECT_TRUE(holds(text("a.obj", ""), "no faces in this file"));
  EXPECT_TRUE(holds(text("a.off", "PFF\n1 1 0\n"), "a.off:1: error: not an OFF file"));
  EXPECT_TRUE(
      holds(text("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n"), "the file ends before vertex 3 of 3"));
  EXPECT_TRUE(
      holds(text("a.off", "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"), "face 1 names vertex 0"));
  EXPECT_TRUE(holds(text("a.ply", "plx\n"), "not a PLY file"));
  EXPECT_TRUE(holds(text("a.ply", "ply\nformat ascii 1.0\nelement vertex x\n"),
                    "a.ply:3: error: number of elements"));
  EXPECT_TRUE(holds(
      text("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"),
      "element vertex no x, y and z"));
  EXPECT_TRUE(holds(text("a.stl", "solid a\nfacet\nvertex 0 0 0\nendfacet\n"),
                    "a.stl:4: error: a facet with 1 corners"));
  EXPECT_TRUE(holds(text("a.xyz", "1 2 3"), "unknown kind of surface file"));
}

// Bytes of a corner or of a length may be any number.
TEST(SurfaceIo, CornersOfAPlyFileAreIntegers) {
  const ScratchFolder folder;
  for (const std::string corner : {"4e9", "1.5", "-3e9", "nan"}) {
    const std::string text =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
        "float "
        "z\nelement face 1\nproperty list uchar double vertex_indices\nend_header\n0 0 0\n1 0 0\n0 "
        "1 "
        "0\n3 0 1 " +
        corner + "\n";
    EXPECT_TRUE(
        holds(refusal(folder.write("a.ply", text)), "face 1 of 1: expected an integer below 2^31"))
        << corner;
  }
}

TEST(SurfaceIo, RefusesTruncatedBinaryFiles) {
  const ScratchFolder folder;
  const std::string stl = as_stl(cube(), true), ply = as_ply(cube(), Ply::kLittle);
  for (const std::size_t lost : {1u, 7u, 50u, 300u}) {
    EXPECT_TRUE(holds(refusal(folder.write("cut.stl", stl.substr(0, stl.size() - lost))), "STL"))
        << lost;
    EXPECT_TRUE(
        holds(refusal(folder.write("cut.ply", ply.substr(0, ply.size() - lost))), "truncated at"))
        << lost;
  }
}

TEST(SurfaceIo, AMissingFileIsAFileError) {
  EXPECT_THROW(read_surface("/nonexistent/a.obj"), FileError);
  EXPECT_TRUE(is_surface_file("a.Obj"));
  EXPECT_FALSE(is_surface_file("a.msh"));
}

}  // namespace
}  // namespace archetide
