#include "precompute/inspect/report.h"
#include "common/params/cli.h"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <unistd.h>

#include <cstdlib>
#include <numeric>
#include <sstream>

#include "common/archetype/archetype_figures.h"
#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/files/hdf5_file.h"
#include "precompute/base/build_record.h"
#include "precompute/base/defects.h"
#include "precompute/build.h"
#include "precompute/inspect/histogram.h"
#include "precompute/inspect/inspect.h"
#include "precompute/inspect/picture.h"
#include "precompute/modal/memory.h"
#include "precompute/modal/shifted_cholesky.h"
#include "tests/unit/precompute/precompute_test_meshes.h"

namespace archetide {
namespace {

using testing_meshes::ScratchFolder;

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; ++at) ++n;
  return n;
}

/// A ball of radius 0.5 m with three modes, and its record.
Archetype ball(const ScratchFolder& folder, BuildRecord& record, int order = 1) {
  TriMesh mesh = shapes::sphere(1.0, 3);
  for (Vec3& x : mesh.vertices) x += Vec3(2, 4, 6);
  write_ply(folder.file("ball.ply"), mesh);
  const std::string recipe = folder.write(
      "ball.body.toml", fmt::format("schema = 1\nmesh = \"ball.ply\"\nscale = 0.5\n"
                                    "tet = {{ target = 1500, order = {} }}\n"
                                    "material = {{ density = 800.0, young = 1e5, poisson = 0.3 }}\n"
                                    "modes = {{ count = 5 }}\n",
                                    order));
  const ScopedLogLevel quiet(LogLevel::kQuiet);
  Profile profile;
  Archetype a = build_archetype(read_recipe(recipe), profile, &record);
  record.take_seconds(profile);
  record.hash = write_archetype(folder.file("ball.h5"), a);
  write_record(folder.file("ball.h5"), record);
  return a;
}

TEST(Report, IsOneSelfContainedPage) {
  const ScratchFolder folder;
  BuildRecord record;
  ball(folder, record);
  write_archetype_report(folder.file("r.html"), {folder.file("ball.h5"), folder.file("ball.h5")});
  const std::string html = read_whole_file(folder.file("r.html"));
  EXPECT_EQ(count(html, "<h2>ball</h2>"), 2u);
  EXPECT_EQ(count(html, "<svg "), 4u);  // two histograms each
  EXPECT_EQ(count(html, "src=\"data:image/png;base64,"), png_available() ? 12u : 0u);
  EXPECT_EQ(count(html, "src=\""), count(html, "src=\"data:"));  // nothing from outside
  EXPECT_EQ(count(html, "http"), 0u);
  EXPECT_NE(html.find("input surface, exact"), std::string::npos);
  EXPECT_NE(html.find("peak memory, MB"), std::string::npos);
  EXPECT_NE(html.find(record.hash), std::string::npos);
}

TEST(Report, SaysSoWhenTheMakingIsNotRecorded) {
  const ScratchFolder folder;
  BuildRecord record;
  ball(folder, record);
  EXPECT_TRUE(read_record(folder.file("ball.h5"), record.hash).has_value());
  EXPECT_FALSE(read_record(folder.file("ball.h5"), "of another build").has_value());
  folder.write("ball.build.json", "{ \"hash\": 3");
  EXPECT_FALSE(read_record(folder.file("ball.h5"), record.hash).has_value());
  write_archetype_report(folder.file("r.html"), {folder.file("ball.h5")});
  EXPECT_NE(read_whole_file(folder.file("r.html")).find("Not recorded"), std::string::npos);
}

TEST(Record, HoldsTheInputSurfaceAndReadsBack) {
  const ScratchFolder folder;
  BuildRecord made;
  const Archetype a = ball(folder, made);
  const BuildRecord read = read_record(folder.file("ball.h5"), made.hash).value();
  EXPECT_EQ(read.seconds, made.seconds);
  EXPECT_EQ(read.memory, made.memory);
  ASSERT_EQ(read.memory.size(), 3u);
  EXPECT_GT(read.memory[0].second, 1e6);
  EXPECT_LE(read.memory[0].second, read.memory[2].second);  // peaks only grow
  const TriMesh unit = shapes::sphere(0.5, 3);
  EXPECT_NEAR(read.surface_volume, enclosed_volume(unit), 1e-12);
  EXPECT_LT((read.surface_centroid - Vec3(1, 2, 3)).norm(), 1e-12);
  const Mat3 S = enclosed_second_moment(unit);
  EXPECT_LT((read.surface_inertia - (S.trace() * Mat3::Identity() - S)).norm(), 1e-12);
}

TEST(Figures, SumsOverTheTetsAgreeWithTheirSurface) {
  const ScratchFolder folder;
  BuildRecord record;
  const Archetype a = ball(folder, record);
  const SolidFigures solid = solid_of_surface(a);
  // Linear tets fill their surface, and their inertia is that of the solid whatever the mass.
  EXPECT_NEAR(solid.mass, a.integrals.mass, 1e-12 * solid.mass);
  EXPECT_LT(solid.centre.norm(), 1e-14);
  EXPECT_LT((solid.inertia - inertia(a)).norm(), 1e-12 * solid.inertia.norm());
  const Orthogonality o = orthogonality(a);
  EXPECT_LT(o.mass, 1e-12);
  EXPECT_LT(o.translation, 1e-12);
  EXPECT_LT(o.rotation, 1e-12);
}

TEST(Figures, OrthogonalitySeesWhatIsNotOrthogonal) {
  Archetype a;
  a.omega2 = VecX::Ones(1);
  a.M_r = MatX::Constant(1, 1, 1.25);
  a.integrals.mass = 4.0;
  a.integrals.Sxx = Mat3::Identity();  // inertia 2, 2, 2
  a.integrals.I3 = {Vec3(0, 3, 4)};
  a.integrals.A = {Mat3::Zero()};
  a.integrals.A[0](0, 1) = 6.0;  // sum m x_x phi_y: spin about z
  const Orthogonality o = orthogonality(a);
  EXPECT_DOUBLE_EQ(o.mass, 0.25);
  EXPECT_DOUBLE_EQ(o.translation, 2.5);
  EXPECT_DOUBLE_EQ(o.rotation, 6.0 / std::sqrt(6.0));
}

TEST(Picture, ABallIsARoundSpotOfTheRightSize) {
  const TriMesh mesh = shapes::sphere(1.0, 4);
  const Image image = draw_surface(mesh, std::vector<double>(mesh.vertices.size(), 0.5),
                                   mesh.vertices, 0.25, 200, 200);
  int inked = 0;
  double sum_x = 0.0, sum_y = 0.0;
  for (int y = 0; y < 200; ++y) {
    for (int x = 0; x < 200; ++x) {
      const std::uint8_t* p = &image.rgb[3 * (200 * static_cast<std::size_t>(y) + x)];
      if (p[0] + p[1] + p[2] > 750) continue;
      ++inked, sum_x += x + 0.5, sum_y += y + 0.5;
    }
  }
  EXPECT_NEAR(sum_x / inked, 100.0, 0.5);
  EXPECT_NEAR(sum_y / inked, 100.0, 0.5);
  // The diameter and the margins, 2 + 2 x 0.25, fill 92 % of the picture.
  const double radius = 0.92 * 200 / 2.5;
  EXPECT_NEAR(inked, std::numbers::pi * radius * radius, 0.03 * std::numbers::pi * radius * radius);
}

TEST(Picture, TheNearerTriangleHidesTheOther) {
  // Two squares facing the camera, one behind the other (along +y), of different value.
  TriMesh mesh;
  std::vector<double> value;
  for (const double y : {1.0, -1.0}) {
    const int n = static_cast<int>(mesh.vertices.size());
    for (const auto& [x, z] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}})
      mesh.vertices.emplace_back(x, y, z), value.push_back(y > 0 ? 1.0 : 0.0);
    mesh.triangles.emplace_back(n, n + 1, n + 2);
    mesh.triangles.emplace_back(n, n + 2, n + 3);
  }
  for (int order = 0; order < 2; ++order) {
    const Image image = draw_surface(mesh, value, mesh.vertices, 0.0, 100, 100);
    const std::uint8_t* p = &image.rgb[3 * (100 * std::size_t(52) + 50)];
    EXPECT_GT(p[2], p[0]);  // the near one is blue, not yellow
    std::reverse(mesh.triangles.begin(), mesh.triangles.end());
  }
}

TEST(Histogram, CountsEveryValueOnce) {
  const std::string svg = svg_histogram("a < b", {0.1, 0.2, 0.9, -3.0, 7.0}, 0.0, 1.0, 2);
  EXPECT_NE(svg.find("a &lt; b"), std::string::npos);
  EXPECT_NE(svg.find("0 to 0.5: 3<"), std::string::npos) << svg;
  EXPECT_NE(svg.find("0.5 to 1: 2<"), std::string::npos) << svg;
}

// ---- VTKHDF -------------------------------------------------------------------------------------

/// Our reader refuses views in files of strangers.
VecX view_of_mode(const std::string& path, int k) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const std::string name = fmt::format("VTKHDF/PointData/mode_{}", k + 1);
  const hid_t set = H5Dopen2(file, name.c_str(), H5P_DEFAULT), space = H5Dget_space(set);
  VecX values(std::max<hssize_t>(H5Sget_simple_extent_npoints(space), 0));
  EXPECT_GE(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  H5Sclose(space), H5Dclose(set), H5Fclose(file);
  return values;
}

TEST(VtkHdf, HoldsTetsAndEveryModeAsAView) {
  const ScratchFolder folder;
  BuildRecord record;
  const Archetype a = ball(folder, record);
  write_vtkhdf(folder.file("ball.hdf"), a);
  const std::size_t n = a.tets.nodes.size(), nt = a.tets.tets.size();
  const Hdf5Reader file(folder.file("ball.hdf"), "");
  const DataArray points = file.read("VTKHDF/Points");
  EXPECT_EQ(points.shape, (std::vector<std::size_t>{n, 3}));
  EXPECT_EQ(std::memcmp(points.bytes.data(), a.tets.nodes.data(), points.bytes.size()), 0);
  EXPECT_EQ(file.read("VTKHDF/Connectivity").shape, (std::vector<std::size_t>{4 * nt}));
  EXPECT_EQ(file.read("VTKHDF/Offsets").shape, (std::vector<std::size_t>{nt + 1}));
  EXPECT_EQ(file.read("VTKHDF/Types").bytes, std::vector<char>(nt, 10));
  const DataArray modes = file.read("modes");
  EXPECT_EQ(modes.shape, (std::vector<std::size_t>{static_cast<std::size_t>(a.r()), n, 3}));
  EXPECT_EQ(std::memcmp(modes.bytes.data(), a.node_modes.data(), modes.bytes.size()), 0);
  for (int k = 0; k < a.r(); ++k) {
    const VecX mode = view_of_mode(folder.file("ball.hdf"), k);
    ASSERT_EQ(mode.size(), 3 * static_cast<Eigen::Index>(n));
    EXPECT_EQ(mode, a.node_modes.col(k));
  }
  // The modes stand in the file once.
  EXPECT_LT(std::filesystem::file_size(folder.file("ball.hdf")),
            8 * (3 * n * (a.r() + 1) + 5 * nt) + nt + 20000);
  write_vtkhdf(folder.file("again.hdf"), a);
  EXPECT_EQ(read_whole_file(folder.file("ball.hdf")), read_whole_file(folder.file("again.hdf")));
}

TEST(VtkHdf, QuadraticTetsKeepTheirCurvedEdges) {
  const ScratchFolder folder;
  BuildRecord record;
  const Archetype a = ball(folder, record, 2);
  write_vtkhdf(folder.file("ball.hdf"), a);
  const std::size_t nt = a.tets.tets.size();
  const Hdf5Reader file(folder.file("ball.hdf"), "");
  EXPECT_EQ(file.read("VTKHDF/Types").bytes, std::vector<char>(nt, 24));
  const DataArray nodes = file.read("VTKHDF/Connectivity");
  ASSERT_EQ(nodes.shape, (std::vector<std::size_t>{10 * nt}));
  std::vector<std::int64_t> list(10 * nt);
  std::memcpy(list.data(), nodes.bytes.data(), nodes.bytes.size());
  // VTK's order of a quadratic tet: corners, then the middles of 01, 12, 20, 03, 13, 23.
  constexpr int kEnds[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
  for (std::size_t t = 0; t < nt; ++t)
    for (int e = 0; e < 6; ++e) {
      const Vec3 &p = a.tets.nodes[list[10 * t + kEnds[e][0]]],
                 &q = a.tets.nodes[list[10 * t + kEnds[e][1]]],
                 &middle = a.tets.nodes[list[10 * t + 4 + e]];
      EXPECT_LT((middle - 0.5 * (p + q)).norm(), 0.3 * (p - q).norm());
    }
}

TEST(VtkHdf, OpensInParaViewAndWarps) {
  if (std::system("pvpython --version >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "pvpython is not installed";
  const ScratchFolder folder;
  BuildRecord record;
  const Archetype a = ball(folder, record, 2);
  write_vtkhdf(folder.file("ball.hdf"), a);
  const std::string script = folder.write(
      "look.py",
      "import sys\n"
      "from paraview.simple import OpenDataFile, WarpByVector, servermanager\n"
      "r = OpenDataFile(sys.argv[1])\n"
      "w = WarpByVector(Input=r)\n"
      "w.Vectors = ['POINTS', 'mode_2']\n"
      "w.ScaleFactor = 2.0\n"
      "d = servermanager.Fetch(w)\n"
      "print(d.GetNumberOfPoints(), d.GetNumberOfCells(), d.GetPointData().GetNumberOfArrays(),\n"
      "      '%.9e' % d.GetPoint(7)[1], d.GetCellType(0))\n");
  const std::string command = "pvpython --force-offscreen-rendering " + script + " " +
                              folder.file("ball.hdf") + " >" + folder.file("out") + " 2>/dev/null";
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::istringstream out(read_whole_file(folder.file("out")));
  std::size_t points = 0, cells = 0;
  int arrays = 0;
  double y = 0.0;
  int type = 0;
  out >> points >> cells >> arrays >> y >> type;
  EXPECT_EQ(type, 24);
  EXPECT_EQ(points, a.tets.nodes.size());
  EXPECT_EQ(cells, a.tets.tets.size());
  EXPECT_EQ(arrays, a.r());
  EXPECT_NEAR(y, a.tets.nodes[7][1] + 2.0 * a.node_modes(3 * 7 + 1, 1), 1e-6);
}

// ---- memory and interruption --------------------------------------------------------------------

struct Variable {
  explicit Variable(const char* value) { ::setenv("ARCHETIDE_MEMORY_LIMIT", value, 1); }
  ~Variable() { ::unsetenv("ARCHETIDE_MEMORY_LIMIT"); }
};

TEST(Memory, ABodyThatDoesNotFitIsRefusedBeforeMeshing) {
  const ScratchFolder folder;
  write_ply(folder.file("ball.ply"), shapes::sphere(1.0, 2));
  const Recipe recipe = read_recipe(folder.write(
      "big.body.toml",
      "schema = 1\nmesh = \"ball.ply\"\ntet = { target = 5_000_000 }\n"
      "material = { density = 800.0, young = 1e5, poisson = 0.3 }\nmodes = { count = 50 }\n"));
  const Variable limit("2G");
  const ScopedLogLevel quiet(LogLevel::kQuiet);
  Profile profile;
  try {
    build_archetype(recipe, profile);
    FAIL();
  } catch (const MachineError& error) {
    EXPECT_NE(std::string(error.what()).find("big: 5000000 tets with 50 modes needs"),
              std::string::npos)
        << error.what();
  }
  EXPECT_EQ(profile.seconds("mesh"), 0.0);
}

/// Bytes that this process uses now.
double resident() {
  double pages = 0.0;
  std::ifstream in("/proc/self/statm");
  in >> pages >> pages;
  return pages * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

TEST(Memory, AFactorThatDoesNotFitIsRefusedBeforeItIsMade) {
  // Every row is joined to the last 3000: a factor of 100 MB (4000 x 3000 doubles).
  constexpr int kRows = 4000, kDense = 3000;
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < kRows; ++i) {
    entries.emplace_back(i, i, 2.0 * kRows);
    for (int j = std::max(i + 1, kRows - kDense); j < kRows; ++j) {
      entries.emplace_back(i, j, 1.0);
      entries.emplace_back(j, i, 1.0);
    }
  }
  SparseMatrix matrix(kRows, kRows);
  matrix.setFromTriplets(entries.begin(), entries.end());
  std::vector<int> ordering(kRows);
  std::iota(ordering.begin(), ordering.end(), 0);
  const Variable limit(std::to_string(static_cast<long>(resident() + 100e6)).c_str());
  try {
    ShiftedCholesky factor(matrix, ordering);
    FAIL();
  } catch (const MachineError& error) {
    EXPECT_NE(std::string(error.what()).find("computing modes with 4000 unknowns needs"),
              std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace archetide
