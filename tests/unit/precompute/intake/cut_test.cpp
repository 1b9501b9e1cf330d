#include "precompute/intake/cut.h"
#include "common/params/cli.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <numbers>

#include "common/base/input_error.h"
#include "common/files/surface_io.h"
#include "precompute/build.h"
#include "precompute/build_skin.h"
#include "tests/architecture/source_tree.h"
#include "tests/unit/precompute/precompute_test_meshes.h"

namespace archetide {
namespace {

using testing_meshes::as_file;
using testing_meshes::ScratchFolder;

std::string asset(const std::string& name) {
  return (source_tree::root() / "assets/bodies" / name).string();
}

Region box(const Vec3& low, const Vec3& high) {
  Region r;
  r.box = {low, high};
  return r;
}
Region ball(const Vec3& centre, double radius) {
  Region r;
  r.ball = {centre, radius};
  return r;
}
Region cylinder(const Vec3& from, const Vec3& to, double radius) {
  Region r;
  r.cylinder = Region::Cylinder{from, to, radius};
  return r;
}
Region half_space(const Vec3& point, const Vec3& normal) {
  Region r;
  r.half_space = Region::HalfSpace{point, normal.normalized()};
  return r;
}

/// Volume of what a cut leaves, accepted by the same intake as any surface.
double part(const TriMesh& whole, const Region& region, bool inside) {
  IntakeReport report;
  accept_surface(as_file(cut_solid(whole, {{region, inside, {}}})), 1.0, report);
  return report.volume;
}

TEST(Cut, RegionsAreClosedSolidsOfTheirVolume) {
  const double pi = std::numbers::pi;
  EXPECT_NEAR(enclosed_volume(region_surface(box(Vec3(0, 1, 2), Vec3(1, 3, 5)), 0)), 6.0, 1e-14);
  // polyhedra inside the ball (spherical triangles of 90 / 32 degrees) and the cylinder (128 sides)
  EXPECT_NEAR(enclosed_volume(region_surface(ball(Vec3(1, 2, 3), 0.5), 0)), pi / 6, 2e-3);
  const double sides = 64 * std::sin(2 * pi / 128);
  EXPECT_NEAR(enclosed_volume(region_surface(cylinder(Vec3(1, 0, 0), Vec3(1, 2, 2), 0.5), 0)),
              sides * 0.25 * std::sqrt(8.0), 1e-13);
  EXPECT_NEAR(enclosed_volume(region_surface(half_space(Vec3(1, 2, 3), Vec3(1, 1, 0)), 2)), 64.0,
              1e-12);
}

TEST(Cut, AHalfSpaceCutsACubeExactly) {
  const TriMesh cube = testing_meshes::cube();
  EXPECT_NEAR(part(cube, half_space(Vec3(0.25, 0, 0), Vec3(1, 0, 0)), true), 0.25, 1e-15);
  EXPECT_NEAR(part(cube, half_space(Vec3(0.25, 0, 0), Vec3(1, 0, 0)), false), 0.75, 1e-15);
  EXPECT_NEAR(part(cube, half_space(Vec3(0.5, 0, 0), Vec3(1, 1, 0)), true), 0.125, 1e-15);
}

TEST(Cut, PartsHaveTheVolumeOfTheWhole) {
  const TriMesh jellyfish = read_surface(asset("jellyfish.obj")).mesh;
  const double volume = enclosed_volume(jellyfish);
  for (const Region& region :
       {box(Vec3(-0.09, -0.09, -0.3), Vec3(0.01, 0.09, 0.2)), ball(Vec3(0, 0, 0.05), 0.13),
        cylinder(Vec3(0, 0, -0.3), Vec3(0, 0, 0.3), 0.08),
        half_space(Vec3(0, 0, 0.05), Vec3(0.3, 0.2, 1))}) {
    const auto volume_of = [&](bool inside) {
      return enclosed_volume(cut_solid(jellyfish, {{region, inside, {}}}));
    };
    const double sum = volume_of(true) + volume_of(false);
    EXPECT_NEAR(sum, volume, 1e-13 * volume);  // measured 2e-16 to 5e-15
  }
}

TEST(Cut, TheFivePartsOfTheJellyfishShareItOut) {
  double sum = 0.0, whole = 0.0;
  for (const char* name : {"bell", "arm1", "arm2", "arm3", "arm4"}) {
    const Recipe recipe = read_recipe(asset("jellyfish_" + std::string(name) + ".body.toml"));
    const TriMesh mesh = read_surface(recipe.mesh_path).mesh;
    whole = enclosed_volume(mesh);
    IntakeReport report;
    accept_surface(as_file(cut_solid(mesh, recipe.cuts)), 1.0, report);
    EXPECT_EQ(report.cavities, 0);
    sum += report.volume;
  }
  EXPECT_NEAR(sum, whole, 1e-13 * whole);
}

TEST(Cut, NothingLeftIsAnErrorAtTheCut) {
  try {
    cut_solid(testing_meshes::cube(),
              {{box(Vec3(2, 2, 2), Vec3(3, 3, 3)), true, {"duck.body.toml", 4, 8}}});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("duck.body.toml:4:8"), std::string::npos);
    EXPECT_NE(std::string(error.what()).find("nothing is left"), std::string::npos);
  }
}

// ---- skins --------------------------------------------------------------------------------------

constexpr char kPart[] =
    "schema = 1\nmesh = \"bar.off\"\nmaterial = { density = 1000, young = 1e5, poisson = 0.3 }\n";

/// A bar of 4 x 1 x 1 m in three parts, cut at x = -1 and at x = 1.
struct Bar {
  ScratchFolder folder;

  Bar() {
    TriMesh mesh = shapes::box(Vec3(4, 1, 1), 32);
    for (Vec3& x : mesh.vertices) x -= Vec3(2, 0.5, 0.5);
    std::string off = fmt::format("OFF {} {} 0\n", mesh.vertices.size(), mesh.triangles.size());
    for (const Vec3& x : mesh.vertices) off += fmt::format("{:f} {:f} {:f}\n", x[0], x[1], x[2]);
    for (const Vec3i& t : mesh.triangles) off += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
    folder.write("bar.off", off);
    write("left", "[{ plane = [[-1, 0, 0], [1, 0, 0]] }]");
    write("right", "[{ plane = [[1, 0, 0], [1, 0, 0]], keep = \"outside\" }]");
    write("middle", "[{ box = [[-1, -2, -2], [1, 2, 2]] }]");
  }
  void write(const std::string& name, const std::string& cut) const {
    folder.write(name + ".body.toml", kPart + ("cut = " + cut + "\n"));
  }
  Recipe skin(const std::string& more) const {
    return read_recipe(
        folder.write("skin.body.toml", "schema = 1\nmesh = \"bar.off\"\n[skin]\n" + more));
  }
  Skin built(const std::string& more) const {
    const ScopedLogLevel quiet(LogLevel::kQuiet);
    Profile profile;
    return build_skin(skin(more), profile);
  }
  std::string refusal(const std::string& more) const {
    try {
      built(more);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

constexpr char kParts[] =
    "parts = [\"left.body.toml\", \"middle.body.toml\", \"right.body.toml\"]\nblend = 0.8\n";

TEST(SkinWeights, ArePositiveSumToOneAndHandOverWithinTheBlend) {
  const Bar bar;
  const Skin skin = bar.built(kParts);
  double least = 1.0, sum_error = 0.0, last = 0.0, next = 0.0;
  for (std::size_t v = 0; v < skin.surface.vertices.size(); ++v) {
    const double x = skin.surface.vertices[v][0];
    const double left = skin.weight(v, 0), middle = skin.weight(v, 1), right = skin.weight(v, 2);
    least = std::min({least, left, middle, right});
    sum_error = std::max(sum_error, std::abs(left + middle + right - 1.0));
    // an edge is 1/8 m: hand-overs end within half the blend and an edge
    const double reach = 0.4 + 0.125;
    const bool is_left = x<-1 - reach, is_right = x> 1 + reach,
               is_middle = x > -1 + reach && x < 1 - reach;
    EXPECT_TRUE(!is_left || left == 1.0) << x;
    EXPECT_TRUE(!is_middle || middle == 1.0) << x;
    EXPECT_TRUE(!is_right || right == 1.0) << x;
    if (std::abs(x + 1) < 1e-6) last = left;
    if (std::abs(x + 0.875) < 1e-6) next = left;
  }
  EXPECT_GE(least, 0.0);
  EXPECT_LE(sum_error, 1e-15);
  // symmetric about the middle of the edges that cross over (a vertex on a cut is the first part's)
  EXPECT_NEAR(last + next, 1.0, 1e-3);
  EXPECT_GT(last, next);
}

TEST(SkinWeights, NameAtMostFourPartsAVertex) {
  // six slices narrower than the blend
  const Bar bar;
  std::string parts = "parts = [";
  for (int k = 0; k < 6; ++k) {
    const double low = k == 0 ? -3.0 : -1.5 + 0.5 * k, high = k == 5 ? 3.0 : -1.0 + 0.5 * k;
    bar.write(fmt::format("slice{}", k),
              fmt::format("[{{ box = [[{:f}, -2, -2], [{:f}, 2, 2]] }}]", low, high));
    parts += fmt::format("\"slice{}.body.toml\", ", k);
  }
  validate(bar.built(parts + "]\nblend = 4.0\n"));
}

TEST(SkinBuild, NeedsOnlyTheBodyFilesOfItsParts) {
  const Bar bar;
  const Recipe recipe =
      bar.skin(kParts + std::string("[[skin.joint]]\nparts = [\"left\", \"middle\"]\n"
                                    "points = [[-1, 0, 0], [-1, 0.2, 0]]\n"));
  ASSERT_EQ(recipe.skin->joints.size(), 1u);
  EXPECT_EQ(recipe.skin->joints[0].b, 1);
  const std::string rule = depfile_text("skin.h5", recipe);
  for (const char* file : {"skin.body.toml", "bar.off", "left.body.toml", "right.body.toml"})
    EXPECT_NE(rule.find(bar.folder.file(file)), std::string::npos) << file;
}

TEST(SkinBuild, RefusesPartsThatDoNotShareOutTheSurface) {
  const Bar bar;
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " is not in:\n" << text;
  };
  has(bar.refusal("parts = [\"left.body.toml\", \"middle.body.toml\"]\n"), "belongs to no part");
  has(bar.refusal("parts = [\"left.body.toml\", \"left.body.toml\"]\n"), "two parts are called");
  has(bar.refusal(std::string(kParts) + "[[skin.joint]]\nparts = [\"left\", \"midle\"]\n"
                                        "points = [[0, 0, 0]]\n"),
      "did you mean \"middle\"?");
  has(bar.refusal(std::string(kParts) + "[[skin.joint]]\nparts = [\"left\", \"middle\"]\n"
                                        "points = [[-1, 0, 0], [-1, 2, 0]]\n"),
      "skin.body.toml:8:10: error: the joint's point (-1, 2, 0) lies outside the body");
  bar.folder.write("whole.body.toml", kPart);
  has(bar.refusal("parts = [\"whole.body.toml\", \"left.body.toml\"]\n"),
      "left has nothing of the surface");
  bar.folder.write("other.body.toml", std::string(kPart) + "scale = 2.0\n");
  has(bar.refusal("parts = [\"other.body.toml\"]\n"), "not made of the same mesh");
  has(bar.refusal("parts = [\"skin.body.toml\"]\n"), "is a skin itself");
  try {
    read_recipe(bar.folder.write("bad.body.toml", std::string(kPart) + "[skin]\nparts = []\n"));
    FAIL();
  } catch (const InputError& error) {
    has(error.what(), "material is of no use in a skin");
  }
}

}  // namespace
}  // namespace archetide
