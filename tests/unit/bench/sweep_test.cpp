#include "runtime/bench/sweep.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/base/input_error.h"

namespace archetide {
namespace {

using Words = std::vector<std::string>;

SceneSpec tank(const Vec3i& cells, double cell) {
  SceneSpec scene;
  scene.fluid.emplace();
  scene.fluid->cells = cells, scene.fluid->cell = cell;
  return scene;
}

TEST(Sweep, CommasInBracketsAndQuotesBelongToTheValue) {
  const Sweep grid = parse_sweep("fluid.grid=[8, 8, 8], [16,16,16]");
  EXPECT_EQ(grid.key, "fluid.grid");
  EXPECT_EQ(grid.values, (Words{"[8, 8, 8]", "[16,16,16]"}));
  EXPECT_EQ(parse_sweep("name=\"a,b\",c").values, (Words{"\"a,b\"", "c"}));
  EXPECT_EQ(parse_sweep("body={ modes = 1, density = 2 },{}").values.size(), 2u);
}

TEST(Sweep, RefusesWhatIsNoSweep) {
  for (const char* text : {"fluid.cell", "=1,2", "a=1,,2", "a=", "a=1,1"})
    EXPECT_THROW(parse_sweep(text), InputError) << text;
}

TEST(Sweep, PointsAreTheProductWithTheFirstKeySlowest) {
  const auto points = sweep_points({{"a", {"1", "2"}}, {"b", {"x", "y", "z"}}}, SceneSpec(), false);
  ASSERT_EQ(points.size(), 6u);
  EXPECT_EQ(points[1].values, (Words{"1", "y"}));
  EXPECT_EQ(points[3].overrides, (Words{"a=2", "b=x"}));
  EXPECT_EQ(points[3].name, "a=2__b=x");
}

TEST(Sweep, FoldersHaveDifferentNamesEvenWhenLettersAreReplaced) {
  const auto points = sweep_points({{"a", {"1/2", "1_2", "1:2"}}}, SceneSpec(), false);
  EXPECT_NE(points[0].name, points[1].name);
  EXPECT_NE(points[1].name, points[2].name);
  EXPECT_EQ(points[0].name.find('/'), std::string::npos);
}

TEST(Sweep, AFinerCellKeepsTheTank) {
  const SceneSpec scene = tank(Vec3i(8, 1, 12), 0.25);
  const auto point = sweep_point({{"fluid.cell", {}}}, {"\"1/12\""}, scene, false);
  EXPECT_EQ(point.overrides, (Words{"fluid.cell=\"1/12\"", "fluid.grid=[24, 1, 36]"}));
  EXPECT_THROW(sweep_point({{"fluid.cell", {}}}, {"0.3"}, scene, false), InputError);
  // Whoever says the grid gets that.
  EXPECT_EQ(sweep_point({{"fluid.cell", {}}}, {"0.3"}, scene, true).overrides.size(), 1u);
  const auto both =
      sweep_point({{"fluid.cell", {}}, {"fluid.grid", {}}}, {"0.3", "[1,1,1]"}, scene, false);
  EXPECT_EQ(both.overrides, (Words{"fluid.cell=0.3", "fluid.grid=[1,1,1]"}));
}

TEST(Sweep, NumbersOfValues) {
  EXPECT_EQ(sweep_number("0.25"), 0.25);
  EXPECT_EQ(sweep_number("1/64"), 1.0 / 64);
  EXPECT_EQ(sweep_number("\"1/64\""), 1.0 / 64);
  EXPECT_EQ(sweep_number("[16, 8, 8]"), 1.0 / 16);
  EXPECT_EQ(sweep_number("1_000"), 1000.0);
  for (const char* word : {"voxel", "1/x", "true", "", "[a]", "2x"})
    EXPECT_TRUE(std::isnan(sweep_number(word))) << word;
}

}  // namespace
}  // namespace archetide
