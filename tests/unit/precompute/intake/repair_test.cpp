// What happens to a surface with a defect: as it is, and after each repair that fits.

#include "precompute/intake/repair.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <cstdlib>

#include "precompute/base/defects.h"
#include "precompute/intake/intake.h"
#include "precompute/meshing/tetrahedralize.h"
#include "tests/unit/precompute/precompute_test_meshes.h"

namespace archetide {
namespace {

using testing_meshes::as_file;
using testing_meshes::cube;
using testing_meshes::joined;
using testing_meshes::turned;

RepairOptions with(Repair kind) {
  RepairOptions options;
  options.kind = kind;
  return options;
}

constexpr double kPlenty = 40.0;  // CPU seconds

struct Outcome {
  std::string refusal;  // "" when it was accepted
  IntakeReport report;
  TriMesh mesh;
};

Outcome take(const TriMesh& mesh, Repair kind, double scale = 1.0) {
  Outcome out;
  try {
    double cpu_seconds = kPlenty;
    out.mesh = accept_surface(as_file(mesh), scale, with(kind), cpu_seconds, out.report);
  } catch (const InputError& error) {
    out.refusal = error.what();
  }
  return out;
}

void expect_refused(const TriMesh& mesh, Repair kind, const std::string& part) {
  const Outcome out = take(mesh, kind);
  EXPECT_NE(out.refusal.find(part), std::string::npos) << name_of(kind) << ": " << out.refusal;
}

/// Accepted with a volume within [low, high] of `expected` (relative), and tets of that volume.
IntakeReport expect_volume(const TriMesh& mesh, Repair kind, double expected, double low,
                           double high) {
  const Outcome out = take(mesh, kind);
  EXPECT_EQ(out.refusal, "") << name_of(kind);
  if (!out.refusal.empty()) return out.report;
  EXPECT_GE(out.report.volume, (1 + low) * expected) << name_of(kind);
  EXPECT_LE(out.report.volume, (1 + high) * expected) << name_of(kind);
  TetrahedralizeOptions options;
  options.target = 1000;
  const TetrahedralizeResult tets = tetrahedralize(out.mesh, options);
  EXPECT_LE(std::abs(tets.quality.volume_error), 0.01);
  return out.report;
}

constexpr double kExact = 1e-12;
// A wrap lies outside: its offset (1/1500 of the diagonal) all round, and concave places and sharp
// edges bridged by up to alpha (1/50 of the diagonal).
constexpr double kWrapLow = 0.002, kWrapHigh = 0.05;

TriMesh ball() { return shapes::sphere(1.0, 3); }
double ball_volume() { return enclosed_volume(ball()); }

/// Without the triangles whose middle lies within `reach` of the top.
TriMesh ball_with_hole(double reach) {
  TriMesh mesh = ball();
  std::erase_if(mesh.triangles, [&](const Vec3i& t) {
    const Vec3 middle = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3;
    return (middle - Vec3(0, 0, 1)).norm() < reach;
  });
  return mesh;
}

/// Every triangle with its own corners, each moved by up to `noise`.
TriMesh as_soup(const TriMesh& mesh, double noise) {
  TriMesh soup;
  unsigned seed = 1;
  for (const Vec3i& t : mesh.triangles) {
    for (const int v : t) {
      Vec3 x = mesh.vertices[v];
      for (double& coordinate : x) {
        seed = seed * 1664525u + 1013904223u;
        coordinate += noise * (double(seed >> 8) / double(1 << 24) - 0.5);
      }
      soup.vertices.push_back(x);
    }
    const int n = static_cast<int>(soup.vertices.size());
    soup.triangles.emplace_back(n - 3, n - 2, n - 1);
  }
  return soup;
}

TEST(Defects, Hole) {
  const TriMesh open = ball_with_hole(0.4);
  expect_refused(open, Repair::kNone, "the surface is open: ");
  expect_refused(open, Repair::kUnion, "needs parts that are closed");
  // The cap of height 0.08 has 0.48 % of the volume; a fair filling keeps most of it.
  const IntakeReport filled = expect_volume(open, Repair::kFill, ball_volume(), -0.003, 0.003);
  EXPECT_EQ(filled.repair.holes, 1);
  EXPECT_LT(filled.repair.hausdorff, 0.4);
  EXPECT_GT(filled.repair.from_input, 0.2);  // the middle of the filling is far from the rim
  EXPECT_LT(filled.repair.from_result, 1e-12);
  expect_volume(open, Repair::kWrap, ball_volume(), kWrapLow - 0.005, kWrapHigh);
}

TEST(Defects, SeveralHoles) {
  TriMesh open = ball();
  for (const int t : {100, 300, 700, 1100}) open.triangles[t] = Vec3i(0, 0, 0);
  expect_refused(open, Repair::kNone, "12 boundary edges");
  const IntakeReport filled = expect_volume(open, Repair::kFill, ball_volume(), -kExact, kExact);
  EXPECT_EQ(filled.repair.holes, 4);  // triangles: filled by themselves
}

TEST(Defects, FlippedFaces) {
  TriMesh mixed = ball();
  for (int t = 0; t < 400; t += 3) std::swap(mixed.triangles[t][0], mixed.triangles[t][1]);
  const IntakeReport report = expect_volume(mixed, Repair::kNone, ball_volume(), -kExact, kExact);
  EXPECT_EQ(report.reoriented, 134);
}

TEST(Defects, InsideOut) {
  const IntakeReport report =
      expect_volume(turned(ball()), Repair::kNone, ball_volume(), -kExact, kExact);
  EXPECT_TRUE(report.turned_inside_out);
}

TEST(Defects, Soup) {
  expect_volume(as_soup(ball(), 0.0), Repair::kNone, ball_volume(), -kExact, kExact);
}

TEST(Defects, NearlyCoincidentVertices) {
  const TriMesh soup = as_soup(ball(), 1e-6);
  expect_refused(soup, Repair::kNone, "the surface is open: 3840 boundary edges");
  const IntakeReport report = expect_volume(soup, Repair::kFill, ball_volume(), -1e-5, 1e-5);
  EXPECT_EQ(report.repair.welded, 3840 - 642);
  EXPECT_EQ(report.repair.holes, 0);
  expect_volume(soup, Repair::kWrap, ball_volume(), kWrapLow, kWrapHigh);
}

TEST(Defects, DuplicateFaces) {
  TriMesh doubled = ball();
  for (const int t : {5, 50, 500}) doubled.triangles.push_back(doubled.triangles[t].reverse());
  expect_refused(doubled, Repair::kNone, "3 duplicate faces: face 1281");
  const IntakeReport report = expect_volume(doubled, Repair::kFill, ball_volume(), -kExact, kExact);
  EXPECT_EQ(report.repair.dropped, 3);
}

TEST(Defects, DegenerateFaceAndTJunction) {
  // The middle of the edge (0, 1) of the cube, joined on one side only: a gap without area, which a
  // degenerate face may close.
  TriMesh gap = cube();
  gap.vertices.push_back(Vec3(0.5, 0, 0));
  gap.triangles[4] = Vec3i(0, 8, 4);
  gap.triangles.push_back(Vec3i(8, 1, 4));
  // Its other face is (0, 2, 1).
  ASSERT_EQ(gap.triangles[0], Vec3i(0, 2, 1));
  expect_refused(gap, Repair::kNone, "the surface is open: 3 boundary edges");
  const IntakeReport split = expect_volume(gap, Repair::kFill, 1.0, -kExact, kExact);
  EXPECT_EQ(split.repair.split, 1);
  EXPECT_EQ(split.repair.holes, 0);

  TriMesh closed = gap;
  closed.triangles.push_back(Vec3i(0, 1, 8));
  expect_refused(closed, Repair::kNone, "1 degenerate face");
  const IntakeReport report = expect_volume(closed, Repair::kFill, 1.0, -kExact, kExact);
  EXPECT_EQ(report.repair.dropped, 1);
}

TEST(Defects, OverlappingShells) {
  const TriMesh two = joined(cube(), cube(Vec3(0.5, 0.3, 0.2)));
  expect_refused(two, Repair::kNone, "shells of the surface overlap: ");
  // 1 + 1 - 0.5 0.7 0.8; a shell that faces inward is turned round first.
  for (const TriMesh& input : {two, joined(cube(), turned(cube(Vec3(0.5, 0.3, 0.2))))}) {
    const IntakeReport report = expect_volume(input, Repair::kUnion, 1.72, -kExact, kExact);
    EXPECT_NEAR(report.repair.volume_before, 2.0, kExact);  // overlaps counted twice
  }
  expect_volume(two, Repair::kWrap, 1.72, kWrapLow, kWrapHigh);
}

TEST(Defects, TouchingShells) {
  const TriMesh two = joined(cube(), cube(Vec3(1, 0, 0)));
  expect_refused(two, Repair::kNone, "2 duplicate faces");
  expect_volume(two, Repair::kUnion, 2.0, -kExact, kExact);
  expect_volume(two, Repair::kWrap, 2.0, kWrapLow, kWrapHigh);
}

TEST(Defects, NestedShells) {
  const TriMesh inner = cube(Vec3(0.25, 0.25, 0.25), 0.5);
  const IntakeReport cavity =
      expect_volume(joined(cube(), turned(inner)), Repair::kNone, 0.875, -kExact, kExact);
  EXPECT_EQ(cavity.cavities, 1);
  expect_refused(joined(cube(), inner), Repair::kNone, "face the same way");
  expect_volume(joined(cube(), inner), Repair::kUnion, 1.0, -kExact, kExact);
  // A cavity that another part reaches into loses that part: 0.25 of x in 0.5 x 0.5.
  const TriMesh plugged =
      joined(joined(cube(), turned(inner)), cube(Vec3(0.5, 0.25 - 1, 0.25), 1.0));
  expect_refused(plugged, Repair::kNone, "shells of the surface overlap");
}

TEST(Defects, SeparateShells) {
  const TriMesh two = joined(cube(), cube(Vec3(1.5, 0, 0)));
  expect_refused(two, Repair::kNone, "2 separate shells");
  expect_refused(two, Repair::kUnion, "repair = \"union\" left this");
  expect_refused(two, Repair::kWrap, "repair = \"wrap\" left this; try another wrap.alpha");
}

TEST(Defects, NonManifoldEdge) {
  const TriMesh two = joined(cube(), cube(Vec3(1, 1, 0)));
  expect_refused(two, Repair::kNone, "1 non-manifold edge");
  expect_refused(two, Repair::kUnion, "not manifold");
  // Bridged along the edge: a wedge of about alpha^2 = 0.06^2 on both sides.
  expect_volume(two, Repair::kWrap, 2.0, kWrapLow, kWrapHigh);
}

TEST(Defects, InternalWall) {
  TriMesh walled = cube();
  walled.triangles.push_back(Vec3i(0, 1, 7));
  walled.triangles.push_back(Vec3i(0, 7, 6));
  expect_refused(walled, Repair::kNone, "non-manifold edges with more than two faces");
  expect_volume(walled, Repair::kWrap, 1.0, kWrapLow, kWrapHigh);
}

TEST(Defects, NonManifoldVertex) {
  const TriMesh two = joined(cube(), cube(Vec3(1, 1, 1)));
  expect_refused(two, Repair::kNone, "1 non-manifold vertex");
  expect_volume(two, Repair::kWrap, 2.0, kWrapLow, kWrapHigh);
}

TEST(Defects, Needle) {
  TriMesh mesh = ball();
  const Vec3i t = mesh.triangles[100];
  mesh.vertices[t[0]] = (0.03 * mesh.vertices[t[0]] + 0.97 * mesh.vertices[t[1]]).normalized();
  expect_volume(mesh, Repair::kNone, ball_volume(), -0.01, 0.01);
}

TEST(Defects, SelfIntersection) {
  TriMesh mesh = ball();
  mesh.vertices[4] *= -1.5;
  expect_refused(mesh, Repair::kNone, "the surface intersects itself");
  expect_refused(mesh, Repair::kUnion, "repair = \"union\" left this; set repair = \"wrap\"");
  // The cone that sticks out of the other side, at most 0.5 long and 0.2 wide, adds below 1 %.
  expect_volume(mesh, Repair::kWrap, ball_volume(), kWrapLow, kWrapHigh + 0.01);
}

TEST(Defects, ZeroVolume) {
  TriMesh sheet;
  sheet.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  expect_refused(sheet, Repair::kNone, "the surface is open: 4 boundary edges");
  TriMesh flat = cube();
  for (Vec3& x : flat.vertices) x[2] *= 1e-9;
  expect_refused(flat, Repair::kNone, "encloses no volume");
  expect_refused(flat, Repair::kFill, "encloses no volume");
}

TEST(Defects, OneSided) {
  TriMesh band;  // a Moebius band of 12 quads
  for (int i = 0; i < 12; ++i) {
    const double u = 2 * std::numbers::pi * i / 12;
    for (const double w : {-0.3, 0.3}) {
      band.vertices.emplace_back((1 + w * std::cos(u / 2)) * std::cos(u),
                                 (1 + w * std::cos(u / 2)) * std::sin(u), w * std::sin(u / 2));
    }
    const int a = 2 * i, b = a + 1, c = i == 11 ? 1 : a + 2, d = i == 11 ? 0 : a + 3;
    band.triangles.emplace_back(a, b, c);
    band.triangles.emplace_back(b, d, c);
  }
  expect_refused(band, Repair::kNone, "the surface is open");
}

TEST(Repair, ReportsWhatAWrapDidInFileUnitsAndScalesItsAlpha) {
  RepairOptions options = with(Repair::kWrap);
  options.alpha = 0.2;  // m, 0.1 in the file
  options.offset = 0.02;
  RepairReport report;
  const SurfaceFile file = as_file(ball());
  const SurfaceFile result = repair_surface(file, 2.0, options, report);
  EXPECT_DOUBLE_EQ(report.alpha, 0.1);
  EXPECT_DOUBLE_EQ(report.offset, 0.01);
  EXPECT_NEAR(report.volume_before, ball_volume(), kExact);
  EXPECT_NEAR(report.volume_after, enclosed_volume(result.mesh), kExact);
  // Every point of the wrap is within the offset, up to a facet's sag: alpha^2 / 2.
  EXPECT_GE(report.hausdorff, 0.01 - 1e-3);
  EXPECT_LE(report.hausdorff, 0.01 + 0.01);
  EXPECT_NE(report.note().find("alpha 0.1, offset 0.01; volume"), std::string::npos);
}

TEST(Repair, AWrapThatEntersThroughAHoleIsRefused) {
  RepairOptions options = with(Repair::kWrap);
  options.alpha = 0.2;  // the hole is 0.7 wide
  RepairReport report;
  EXPECT_THROW(repair_surface(as_file(ball_with_hole(0.4)), 1.0, options, report), InputError);
}

TEST(Repair, LeavesAGoodSurfaceAlone) {
  for (const Repair kind : {Repair::kFill, Repair::kUnion}) {
    const Outcome out = take(cube(), kind);
    EXPECT_EQ(out.mesh.triangles, cube().triangles);
    EXPECT_TRUE(out.report.notes().empty());
  }
}

// ---- scans and models, where they stand beside the project ------------------------------------

/// Volume after the repair, in file units, and of the tets.
void expect_model(const std::string& name, Repair kind, double volume, double margin) {
  const std::string source = __FILE__;
  const std::string root = source.substr(0, source.find("tests/unit"));
  const char* folder = std::getenv("ARCHETIDE_TEST_MESHES");
  const std::string path = (folder ? std::string(folder) : root + "../shared/meshes") + "/" + name;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  IntakeReport report;
  double cpu_seconds = kPlenty;
  const TriMesh mesh = accept_surface(read_surface(path), 1.0, with(kind), cpu_seconds, report);
  EXPECT_NEAR(report.volume, volume, margin * volume);
  TetrahedralizeOptions options;
  options.target = 8000;
  EXPECT_LT(std::abs(tetrahedralize(mesh, options).quality.volume_error), 0.01);
}

// Volumes by the divergence theorem; of the bunny with its holes closed by cones (fair fillings
// differ by the sag over the holes); suzanne has none, so only that its wraps at two sizes agree.
TEST(SlowModels, Spot) { expect_model("spot.obj", Repair::kNone, 0.718259, 1e-5); }
TEST(SlowModels, Fandisk) { expect_model("fandisk.obj", Repair::kNone, 20.2434, 1e-5); }
TEST(SlowModels, BunnyFilled) {
  expect_model("stanford-bunny.obj", Repair::kFill, 7.552e-4, 0.005);
}
TEST(SlowModels, BunnyWrapped) { expect_model("stanford-bunny.obj", Repair::kWrap, 7.75e-4, 0.02); }
TEST(SlowModels, SuzanneWrapped) { expect_model("suzanne.obj", Repair::kWrap, 2.24, 0.03); }

TEST(Repair, AWrapOfMillionsOfFacesIsRefusedBeforeItIsMade) {
  RepairOptions fine = with(Repair::kWrap);
  fine.alpha = 1e-4;
  IntakeReport report;
  double cpu_seconds = kPlenty;
  try {
    accept_surface(as_file(shapes::sphere(1.0, 2)), 1.0, fine, cpu_seconds, report);
    FAIL();
  } catch (const InputError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("wrap.alpha is too fine"), std::string::npos) << text;
    EXPECT_NE(text.find("raise wrap.alpha to 0.007"), std::string::npos) << text;
  }
}

double cpu_seconds_of_children() {
  rusage use{};
  ::getrusage(RUSAGE_CHILDREN, &use);
  return double(use.ru_utime.tv_sec + use.ru_stime.tv_sec) +
         1e-6 * double(use.ru_utime.tv_usec + use.ru_stime.tv_usec);
}

TEST(Repair, OneThatTakesTooLongIsRefusedWithTheDefectsItWasFor) {
  IntakeReport report;
  double cpu_seconds = 1.0;
  const double before = cpu_seconds_of_children();
  try {
    accept_surface(as_file(testing_meshes::row_of_cubes(1500)), 1.0, with(Repair::kUnion),
                   cpu_seconds, report);
    FAIL();
  } catch (const SurfaceDefects& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("shells of the surface overlap: "), std::string::npos) << text;
    EXPECT_NE(text.find("repair = \"union\" of 18000 faces was stopped after 1 CPU seconds"),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("set repair = \"wrap\", or allow more with --time-limit"),
              std::string::npos)
        << text;
    EXPECT_GT(error.offenders.triangles.size(), 9000u);  // most cross another: measured 15996
  }
  // The check, then the repair: less than the seconds given to each, and one until the limit bites.
  EXPECT_LT(cpu_seconds_of_children() - before, 1.0 + 1.0 + 1.0);
  EXPECT_EQ(::waitpid(-1, nullptr, WNOHANG), -1);  // no child is left
}

TEST(Repair, ACheckThatTakesTooLongIsRefused) {
  // So many shells that the search for who lies in whom takes half a minute.
  TriMesh dust;
  for (int k = 0; k < 60'000; ++k) {
    const int shift = static_cast<int>(dust.vertices.size());
    const Vec3 at(3.0 * (k % 40), 3.0 * (k / 40 % 40), 3.0 * (k / 1600));
    for (const Vec3& x : testing_meshes::octahedron().vertices) dust.vertices.push_back(at + x);
    for (const Vec3i& t : testing_meshes::octahedron().triangles)
      dust.triangles.push_back(t.array() + shift);
  }
  IntakeReport report;
  double cpu_seconds = 1.0;
  try {
    accept_surface(as_file(dust), 1.0, with(Repair::kNone), cpu_seconds, report);
    FAIL();
  } catch (const SurfaceDefects& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("the check of 480000 faces was stopped after 1 CPU seconds"),
              std::string::npos)
        << text;
  }
}

}  // namespace
}  // namespace archetide
