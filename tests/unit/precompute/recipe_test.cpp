#include "precompute/recipe.h"

#include <gtest/gtest.h>

#include "common/input_error.h"
#include "precompute_test_meshes.h"

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

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
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
}

TEST(Recipe, NeedsOnlyMeshAndMaterial) {
  const ScratchFolder folder;
  const Recipe r = read_recipe(folder.write("duck.body.toml", kMinimal));
  EXPECT_EQ(r.tet.mesher, Mesher::kCgal);
  EXPECT_EQ(r.modes.count, 10);
  EXPECT_EQ(r.modes.mass, MassKind::kConsistent);
  EXPECT_EQ(r.scale, 1.0);
  EXPECT_EQ(r.beta, 0.0);
}

TEST(Recipe, ReportsAllMistakesAtOnceWithTheirPlaces) {
  const std::string text = refusal(
      "schema = 1\nmesh = 3\nscael = 2.0\n"
      "material = { density = -1.0, young = 5e4, poisson = 0.5 }\nmodes = { count = 2.5 }\n");
  EXPECT_TRUE(has(text, "duck.body.toml:2:8: error: mesh")) << text;
  EXPECT_TRUE(has(text, "duck.body.toml:3:1: error: unknown key 'scael'")) << text;
  EXPECT_TRUE(has(text, "did you mean 'scale'?")) << text;
  EXPECT_TRUE(has(text, "material.density: -1 is out of range")) << text;
  EXPECT_TRUE(has(text, "material.poisson: 0.5 is out of range")) << text;
  EXPECT_TRUE(has(text, "modes.count")) << text;
}

TEST(Recipe, DemandsSchemaMeshAndMaterial) {
  const std::string text = refusal("scale = 1.0\n");
  EXPECT_TRUE(has(text, "schema")) << text;
  EXPECT_TRUE(has(text, "mesh")) << text;
  EXPECT_TRUE(has(text, "material")) << text;
}

TEST(Recipe, RefusesByNameWhatComesLater) {
  const std::string quadratic = refusal(std::string(kMinimal) + "tet = { order = 2 }\n");
  EXPECT_TRUE(has(quadratic, "not in this version: quadratic tets")) << quadratic;
  const std::string vectors =
      refusal(std::string(kMinimal) + "modes = { static = [\"pressure\"] }\n");
  EXPECT_TRUE(has(vectors, "not in this version: residual-flexibility vectors")) << vectors;
}

TEST(Recipe, AMissingBodyFileIsAFileError) {
  EXPECT_THROW(read_recipe("/nonexistent/a.body.toml"), FileError);
}

}  // namespace
}  // namespace archetide
