#include "precompute/intake/intake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "precompute/base/defects.h"
#include "tests/support/holds.h"
#include "tests/unit/precompute/precompute_test_meshes.h"

namespace archetide {
namespace {

using testing_meshes::as_file;
using testing_meshes::cube;
using testing_meshes::joined;
using testing_meshes::turned;

/// The text of the refusal, or "" when the surface is accepted.
std::string refusal(const SurfaceFile& file) {
  IntakeReport report;
  try {
    accept_surface(file, 1.0, report);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Intake, AcceptsACleanCubeUnchangedButScaled) {
  IntakeReport report;
  const TriMesh mesh = accept_surface(as_file(cube()), 0.5, report);
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_EQ(mesh.triangles, cube().triangles);
  EXPECT_NEAR(report.volume, 0.125, 1e-15);
  EXPECT_NEAR(report.area, 1.5, 1e-15);
  EXPECT_EQ(report.high, Vec3(0.5, 0.5, 0.5));
  EXPECT_TRUE(report.notes().empty());
}

TEST(Intake, RefusesAnOpenSurfaceNamingFacesAndPlaces) {
  TriMesh open = cube();
  open.triangles.erase(open.triangles.begin() + 3);  // face 4: (5, 7, 6)
  const std::string text = refusal(as_file(open));
  EXPECT_TRUE(holds(text, "shape.obj: error: the surface is open: 3 boundary edges")) << text;
  EXPECT_TRUE(holds(text, "face 3")) << text;  // across (5, 6)
  EXPECT_TRUE(holds(text, "(1, 0, 1)")) << text;
  EXPECT_TRUE(holds(text, "fill the holes")) << text;
}

TEST(Intake, RefusesANonManifoldEdge) {
  // Two cubes that share the edge from (1,1,0) to (1,1,1): four faces there.
  const std::string text = refusal(as_file(joined(cube(), cube(Vec3(1, 1, 0)))));
  EXPECT_TRUE(holds(text, "1 non-manifold edge with more than two faces")) << text;
  EXPECT_TRUE(holds(text, "(1, 1, 0) - (1, 1, 1)")) << text;
}

TEST(Intake, RefusesANonManifoldVertex) {
  const std::string text = refusal(as_file(joined(cube(), cube(Vec3(1, 1, 1)))));
  EXPECT_TRUE(holds(text, "1 non-manifold vertex")) << text;
  EXPECT_TRUE(holds(text, "(1, 1, 1)")) << text;
}

TEST(Intake, RefusesASurfaceThatIntersectsItself) {
  // A sphere with one vertex pulled through the opposite side.
  TriMesh mesh = shapes::sphere(1.0, 2);
  mesh.vertices[4] *= -3.0;
  const std::string text = refusal(as_file(mesh));
  EXPECT_TRUE(holds(text, "the surface intersects itself")) << text;
  EXPECT_TRUE(holds(text, " and face ")) << text;
}

TEST(Intake, RefusesSeparateShellsAndThoseThatLieInsideFacingTheSameWay) {
  const std::string apart = refusal(as_file(joined(cube(), cube(Vec3(3, 0, 0)))));
  EXPECT_TRUE(holds(apart, "2 separate shells: ")) << apart;
  EXPECT_TRUE(holds(apart, "shell 2 of 12 triangles from face 13 at (3, 0, 0)")) << apart;
  EXPECT_FALSE(holds(apart, "inside")) << apart;
  const std::string nested = refusal(as_file(joined(cube(), cube(Vec3(0.25, 0.25, 0.25), 0.5))));
  EXPECT_TRUE(holds(nested, "1 shell lies inside another one and face the same way")) << nested;
  EXPECT_TRUE(holds(nested, "inside shell 1")) << nested;
  TriMesh three = joined(cube(), turned(cube(Vec3(0.25, 0.25, 0.25), 0.5)));
  const std::string loose = refusal(as_file(joined(three, cube(Vec3(0.4, 0.4, 0.4), 0.2))));
  EXPECT_TRUE(holds(loose, "1 shell lies inside a cavity: shell 3 of 12 triangles")) << loose;
}

TEST(Intake, KeepsCavitiesWhicheverWayTheWholeSurfaceFaces) {
  const TriMesh hollow = joined(cube(), turned(cube(Vec3(0.25, 0.25, 0.25), 0.5)));
  for (const TriMesh& input : {hollow, turned(hollow)}) {
    IntakeReport report;
    const TriMesh mesh = accept_surface(as_file(input), 2.0, report);
    EXPECT_NEAR(enclosed_volume(mesh), 8 * 0.875, 1e-13);
    EXPECT_EQ(report.cavities, 1);
    EXPECT_NEAR(report.cavity_volume, 8 * 0.125, 1e-13);
    EXPECT_NEAR(report.area, 4 * (6 + 1.5), 1e-13);
    // Solid cube less the hollow one, each a^5 / 6 about the common centre.
    EXPECT_LT((report.centroid - Vec3::Ones()).norm(), 1e-14);
    EXPECT_LT((report.inertia - (32.0 - 1.0) / 6 * Mat3::Identity()).norm(), 1e-12);
  }
}

TEST(Intake, NamesTheOffendingFacesAsAMesh) {
  TriMesh open = cube();
  open.triangles.erase(open.triangles.begin() + 3);
  IntakeReport report;
  try {
    accept_surface(as_file(open), 5.0, report);  // places are those of the file, whatever the scale
    FAIL();
  } catch (const SurfaceDefects& error) {
    // Across the three open edges stand faces 3, 8 and 12 (counted from 1).
    ASSERT_EQ(error.offenders.triangles.size(), 3u);
    for (const Vec3& x : error.offenders.vertices) EXPECT_LE(x.maxCoeff(), 1.0);
  }
}

TEST(Intake, RefusesCoordinatesThatAreNotNumbers) {
  TriMesh mesh = cube();
  mesh.vertices[6][1] = std::numeric_limits<double>::quiet_NaN();
  const std::string text = refusal(as_file(mesh));
  EXPECT_TRUE(holds(text, "1 vertex with a coordinate that is not a number: vertex 7")) << text;
}

TEST(Intake, RefusesASurfaceWithoutVolume) {
  TriMesh flat = cube();
  for (Vec3& x : flat.vertices) x[2] *= 1e-9;
  EXPECT_TRUE(holds(refusal(as_file(flat)), "encloses no volume")) << refusal(as_file(flat));
}

TEST(Intake, RefusesDegenerateAndDuplicateFaces) {
  TriMesh mesh = cube();
  mesh.vertices.push_back(Vec3(0.5, 0.5, 0.5));
  mesh.triangles.push_back({0, 8, 7});  // on the diagonal
  EXPECT_TRUE(holds(refusal(as_file(mesh)),
                    "1 degenerate face without area (three corners in a line): face 13"))
      << refusal(as_file(mesh));
  mesh.triangles.back() = mesh.triangles[4].reverse();
  EXPECT_TRUE(holds(refusal(as_file(mesh)), "1 duplicate face: face 13")) << refusal(as_file(mesh));
}

TEST(Intake, TurnsAnInwardSurfaceOutwardAndReportsIt) {
  TriMesh inward = cube();
  for (Vec3i& t : inward.triangles) std::swap(t[0], t[1]);
  IntakeReport report;
  const TriMesh mesh = accept_surface(as_file(inward), 1.0, report);
  EXPECT_NEAR(enclosed_volume(mesh), 1.0, 1e-14);
  EXPECT_TRUE(report.turned_inside_out);
  EXPECT_EQ(report.notes(),
            std::vector<std::string>{"the surface faced inward: turned inside out"});
}

TEST(Intake, TurnsSingleFacesToAgreeWithTheirNeighbours) {
  TriMesh mixed = cube();
  for (const int t : {0, 5, 7}) std::swap(mixed.triangles[t][0], mixed.triangles[t][1]);
  IntakeReport report;
  const TriMesh mesh = accept_surface(as_file(mixed), 1.0, report);
  EXPECT_NEAR(enclosed_volume(mesh), 1.0, 1e-14);
  EXPECT_EQ(report.reoriented, 3);
}

TEST(Intake, WeldsEqualVerticesAndDropsWhatHoldsNothing) {
  // A soup: every triangle with its own vertices (-0 equals 0), one vertex unused, one triangle
  // collapsed.
  TriMesh soup;
  for (const Vec3i& t : cube().triangles) {
    const int start = static_cast<int>(soup.vertices.size());
    for (const int v : t)
      soup.vertices.push_back(start % 2 ? cube().vertices[v] : Vec3(-(-cube().vertices[v])));
    soup.triangles.push_back(Vec3i(start, start + 1, start + 2));
  }
  soup.vertices.push_back(Vec3(7, 7, 7));
  soup.triangles.push_back(Vec3i(0, 0, 1));
  IntakeReport report;
  const TriMesh mesh = accept_surface(as_file(soup), 1.0, report);
  EXPECT_EQ(mesh.vertices.size(), 8u);
  EXPECT_EQ(report.welded, 36 - 8);
  EXPECT_EQ(report.unused, 1);
  EXPECT_EQ(report.collapsed, 1);
  EXPECT_NEAR(report.volume, 1.0, 1e-14);
}

TEST(Intake, NamesAtMostFiveDefectsOfAKindButCountsAll) {
  TriMesh open = shapes::sphere(1.0, 3);
  std::vector<Vec3i> kept;
  for (std::size_t t = 0; t < open.triangles.size(); ++t) {
    if (t % 4 != 3) kept.push_back(open.triangles[t]);  // every fourth is the middle of its group
  }
  open.triangles = kept;
  const std::string text = refusal(as_file(open));
  EXPECT_TRUE(holds(text, "960 boundary edges")) << text;
  EXPECT_EQ(std::count(text.begin(), text.end(), ';'), 6) << text;  // one in the hint
}

TEST(Intake, ManyFacesOnTopOfEachOtherAreRefusedWithoutCheckingEveryPair) {
  // 2000 needles through one place: 8000 faces, 32 million pairs.
  TriMesh pile;
  const TriMesh needle{{{-1, -1, -1}, {1, 1, 1.0}, {1, 1, 1.1}, {1, 1.1, 1}},
                       {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  for (int k = 0; k < 2000; ++k) {
    const int first = int(pile.vertices.size());
    for (const Vec3& x : needle.vertices) pile.vertices.push_back((1.0 + 1e-4 * k) * x);
    for (const Vec3i& t : needle.triangles) pile.triangles.push_back(t.array() + first);
  }
  const long most = most_candidates(pile.triangles.size());
  EXPECT_EQ(crowd(pile, most).pairs, most + 1);  // it stopped there
  const std::string text = refusal(as_file(pile));
  EXPECT_TRUE(holds(text, "pairs of faces may intersect, too many to check")) << text;
  EXPECT_TRUE(holds(text, "face 1 at") || holds(text, "; face ")) << text;
  EXPECT_TRUE(holds(text, "set repair = \"wrap\"")) << text;
  // A tidy mesh stays far below.
  EXPECT_LT(crowd(shapes::sphere(1.0, 4), most).pairs, 25 * 5120);
}

}  // namespace
}  // namespace archetide
