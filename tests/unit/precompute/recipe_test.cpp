#include "precompute/recipe.h"

#include <gtest/gtest.h>

#include "common/base/input_error.h"
#include "precompute_test_meshes.h"
#include "tests/support/holds.h"

namespace archetide {
namespace {

using testing_meshes::ScratchFolder;

constexpr char kMinimal[] =
    "schema = 1\n"
    "mesh = \"../meshes/duck.obj\"\n"
    "material = { density = 400.0, young = 5e4, poisson = 0.4 }\n";

std::string refusal(const std::string& text) {
  const ScratchFolder folder;
  try {
    read_recipe(folder.write("duck.body.toml", text));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Recipe, ReadsAllKeys) {
  const ScratchFolder folder;
  const std::string path =
      folder.write("duck.body.toml",
                   "schema = 1\nmesh = \"duck.obj\"\nscale = 0.01\nseed = 7\nmass = \"lumped\"\n"
                   "tet = { mesher = \"gmsh\", target = 60_000, order = 1 }\n"
                   "material = { density = 1100, young = 2e5, poisson = 0.3 }\n"
                   "damping = { alpha = 0.5, beta = 0.01 }\n"
                   "modes = { count = 20, residual = 1e-7, static = [] }\n");
  const Recipe r = read_recipe(path);
  EXPECT_EQ(r.name, "duck");
  EXPECT_EQ(r.mesh, "duck.obj");
  EXPECT_EQ(r.mesh_path, folder.file("duck.obj"));
  EXPECT_TRUE(r.text.starts_with("schema = 1\nmesh"));
  EXPECT_EQ(r.scale, 0.01);
  EXPECT_EQ(r.tet.seed, 7u);
  EXPECT_EQ(r.tet.mesher, Mesher::kGmsh);
  EXPECT_EQ(r.tet.target, 60000);
  EXPECT_EQ(r.material.density, 1100.0);
  EXPECT_EQ(r.material.young, 2e5);
  EXPECT_EQ(r.material.poisson, 0.3);
  EXPECT_EQ(r.alpha, 0.5);
  EXPECT_EQ(r.beta, 0.01);
  EXPECT_EQ(r.modes.count, 20);
  EXPECT_EQ(r.modes.residual, 1e-7);
  EXPECT_EQ(r.modes.mass, MassKind::kLumped);
  EXPECT_EQ(r.tet.order, 1);
}

TEST(Recipe, NeedsOnlyMeshAndMaterial) {
  const ScratchFolder folder;
  const Recipe r = read_recipe(folder.write("duck.body.toml", kMinimal));
  EXPECT_EQ(r.tet.mesher, Mesher::kCgal);
  EXPECT_EQ(r.modes.count, 10);
  EXPECT_EQ(r.tet.order, 2);
  EXPECT_FALSE(r.modes.mass.has_value());  // the order decides
  EXPECT_FALSE(r.modes.loads.any());
  EXPECT_EQ(r.scale, 1.0);
  EXPECT_EQ(r.beta, 0.0);
}

TEST(Recipe, ReportsAllMistakesAtOnceWithTheirPlaces) {
  const std::string text = refusal(
      "schema = 1\nmesh = 3\nscael = 2.0\n"
      "material = { density = -1.0, young = 5e4, poisson = 0.5 }\nmodes = { count = 2.5 }\n");
  EXPECT_TRUE(holds(text, "duck.body.toml:2:8: error: mesh")) << text;
  EXPECT_TRUE(holds(text, "duck.body.toml:3:1: error: unknown key 'scael'")) << text;
  EXPECT_TRUE(holds(text, "did you mean 'scale'?")) << text;
  EXPECT_TRUE(holds(text, "material.density: -1 is out of range")) << text;
  EXPECT_TRUE(holds(text, "material.poisson: 0.5 is out of range")) << text;
  EXPECT_TRUE(holds(text, "modes.count")) << text;
}

TEST(Recipe, DemandsSchemaMeshAndMaterial) {
  const std::string text = refusal("scale = 1.0\n");
  EXPECT_TRUE(holds(text, "schema")) << text;
  EXPECT_TRUE(holds(text, "mesh")) << text;
  EXPECT_TRUE(holds(text, "material")) << text;
}

constexpr char kParts[] =
    "schema = 1\nmesh = \"a.obj\"\nmaterial = { density = 1e3, young = 1e5, poisson = 0.3 }\n";

TEST(Recipe, ReadsRegionsPointSetsFramesAndLoads) {
  const ScratchFolder folder;
  const Recipe r = read_recipe(folder.write(
      "duck.body.toml",
      std::string(kParts) +
          "modes = { static = [\"pressure\", \"gravity\", \"tip\"] }\n"
          "[[material_region]]\ncenter = [1, 2, 3]\nradius = 0.5\ndensity = 2e3\nyoung = 3e6\n"
          "poisson = 0.1\n[[points]]\nname = \"tip\"\nbox = [[1, 0, 5], [0, 2, 4]]\n"
          "[[joint_frame]]\nname = \"hip\"\npoint = [1, 1, 1]\n"));
  ASSERT_EQ(r.material_regions.size(), 1u);
  EXPECT_EQ(r.material_regions[0].material.young, 3e6);
  EXPECT_TRUE(r.material_regions[0].region.contains(Vec3(1, 2, 3.5)));
  EXPECT_FALSE(r.material_regions[0].region.contains(Vec3(1, 2, 3.6)));
  ASSERT_EQ(r.points.size(), 1u);
  EXPECT_TRUE(r.points[0].region.contains(Vec3(0.5, 0, 4.5)));  // corners in any order
  EXPECT_FALSE(r.points[0].region.contains(Vec3(0.5, 0, 5.1)));
  EXPECT_EQ(r.joint_frames.at(0).axes, Mat3::Identity());
  EXPECT_TRUE(r.modes.loads.pressure && r.modes.loads.gravity);
  EXPECT_EQ(r.point_loads, std::vector<std::string>{"tip"});
}

TEST(Recipe, RefusesWhatDoesNotGoTogether) {
  const auto with = [](const std::string& more) { return refusal(kParts + more); };
  EXPECT_TRUE(holds(with("mass = \"lumped\"\n"), "quadratic tets have no lumped mass"));
  EXPECT_TRUE(holds(with("clamped = \"foot\"\n"), "there is no point set \"foot\""));
  EXPECT_TRUE(holds(with("modes = { static = [\"presure\"] }\n"), "no point set \"presure\""));
  EXPECT_TRUE(holds(with("modes = { count = \"full\", static = [\"gravity\"] }\n"),
                    "a complete basis answers every load already"));
  EXPECT_TRUE(holds(with("clamped = \"p\"\nmodes = { count = \"full\" }\n[[points]]\n"
                         "name = \"p\"\nlist = [[0, 0, 0]]\n"),
                    "modes.count = \"full\" is of a free body"));
  EXPECT_TRUE(holds(with("clamped = \"p\"\nmodes = { static = [\"gravity\"] }\n[[points]]\n"
                         "name = \"p\"\nlist = [[0, 0, 0]]\n"),
                    "static responses are those of a free body"));
  EXPECT_TRUE(holds(with("[[points]]\nname = \"p\"\n"), "needs one of box"));
  EXPECT_TRUE(holds(with("[[points]]\nname = \"p\"\nradius = 1\n"), "both center and radius"));
  EXPECT_TRUE(holds(with("[[points]]\nname = \"p\"\nbox = [[0, 0, 0]]\n"), "two corners"));
  EXPECT_TRUE(holds(with("[[joint_frame]]\nname = \"j\"\npoint = [0, 0, 0]\nx = [0, 0, 1]\n"),
                    "two different directions"));
}

TEST(Recipe, AMissingBodyFileIsAFileError) {
  EXPECT_THROW(read_recipe("/nonexistent/a.body.toml"), FileError);
}

}  // namespace
}  // namespace archetide
