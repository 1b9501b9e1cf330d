// H31: a run that is stopped and resumed is the run that was not, bit for bit.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "common/base/input_error.h"
#include "common/base/sha256.h"
#include "runtime/simulation.h"
#include "tests/support/dry_body.h"
#include "tests/support/saved_states.h"
#include "tests/support/skinned_bar.h"
#include "tests/support/synthetic_archetype.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

class Resume : public ::testing::Test {
 protected:
  const SavedStates states_{"resume"};
};

struct Case {
  Scheme scheme = Scheme::kNewmark;
  bool water = true;
  bool joint = true;
  Geometry geometry = Geometry::kCutCell;
  int steps = 40;
  bool skin = false;
  int layers = 12;
};

// Two soft boxes hang together, one beats; a third falls on them, a fourth appears later;
// particles, markers, an obstacle, an open lid.
Simulation busy_tank(const Case& c) {
  SimulationOptions o;
  if (c.water) {
    o.grid.nx = o.grid.ny = 12;
    o.grid.nz = c.layers;
    o.grid.dx = 1.0 / 12;
  }
  o.has_water = c.water;
  o.open_side[kZMax] = true;
  o.particles_per_cell = c.water ? 8 : 0;
  o.spray = c.layers > 12;
  o.reference_point = Vec3(0, 0, 0.5);
  o.body_contact = true;
  o.wall_contact = c.water;
  o.restitution = 0.2, o.friction = 0.4;
  o.scheme = c.scheme;
  o.geometry = c.geometry;
  o.tolerance = 1e-6;
  FluidState fluid;
  if (c.water) {
    fluid.phi.resize(12, 12, c.layers);
    for (int k = 0; k < c.layers; ++k)
      for (int j = 0; j < 12; ++j)
        for (int i = 0; i < 12; ++i)
          fluid.phi(i, j, k) = o.grid.cell_centre(i, j, k)[2] - 0.5 - 0.1 * (i < 5);
    if (c.layers > 12)  // water thrown up: the fields' ceiling falls with it
      for (int k = 0; k < 24; ++k) fluid.phi(9, 9, k) = fluid.phi(9, 10, k) = -0.04;
    for (int n = 0; n < 30; ++n) fluid.markers.emplace_back(0.03 * n + 0.03, 0.4, 0.3);
  }
  SyntheticOptions soft;
  soft.r = 3, soft.density = 600.0, soft.first_omega = 30.0, soft.beta = 0.001;
  const auto box = deformable_archetype(box_tets(Vec3(0.2, 0.2, 0.15), Vec3i(2, 2, 2)), soft);
  std::vector<ReducedBody> bodies(4, make_body(box.archetype, 3));
  bodies[0].position = Vec3(0.35, 0.5, 0.5);
  bodies[1].position = Vec3(0.6, 0.5, 0.5);
  bodies[2].position = Vec3(0.45, 0.5, 0.72);
  bodies[2].P = Vec3(0, 0, -1.5 * box.archetype->integrals.mass);
  bodies[3].position = Vec3(0.5, 0.55, 0.93);
  TriMesh rock = icosphere(1, 0.12);
  for (Vec3& x : rock.vertices) x += Vec3(0.25, 0.3, 0.1);
  std::vector<Joint> joints;
  if (c.joint)
    joints.push_back(make_joint(bodies, 0, 1, {Vec3(0.125, 0, 0), Vec3(0.125, 0.05, 0)}));
  Simulation simulation(o, std::move(fluid), bodies, {rock}, {0.0, 0.0, 0.0, 0.08}, joints);
  simulation.set_actuators({{0,
                             std::make_shared<const ActuationPattern>(
                                 actuation_pattern(*box.archetype, {0, 2, 5, 8, 11}, {}, true)),
                             30.0, 0.2}});
  return simulation;
}

// A bar of three welded soft parts under a skin; it has water on one side, beats, and a ball falls
// on it.
Simulation skinned_tank() {
  SimulationOptions o;
  o.grid = {12, 12, 12, 1.0 / 12, Vec3::Zero()};
  o.has_water = true;
  o.open_side[kZMax] = true;
  o.reference_point = Vec3(0, 0, 0.5);
  o.body_contact = true;
  o.friction = 0.4;
  o.tolerance = 1e-6;
  const double h = 0.25 * SkinnedBar::kWidth;
  SkinnedBar bar = skinned_bar({-0.3, -0.1, 0.1, 0.3}, 0.1, 0.0, 3, 600.0, Vec3(0.5, 0.5, 0.5),
                               Quat::Identity());
  std::vector<Joint> joints;
  for (int part = 0; part < 2; ++part)
    joints.push_back(make_joint(bar.bodies, part, part + 1,
                                {Vec3(0.1, h, h), Vec3(0.1, -h, h), Vec3(0.1, 0, -h)}));
  const auto middle = bar.bodies[1].archetype;
  bar.bodies.push_back(make_body(rigid_surface_archetype(icosphere(2, 0.1), 700.0), 0));
  bar.bodies.back().position = Vec3(0.45, 0.5, 0.72);
  Simulation simulation(
      o, water_where(o.grid, [](const Vec3& x) { return x[2] - 0.5 - 0.1 * (x[0] < 0.4); }),
      bar.bodies, {}, {}, joints, {bar.skin});
  simulation.set_actuators({{1,
                             std::make_shared<const ActuationPattern>(
                                 actuation_pattern(*middle, {0, 2, 5, 8, 11}, {}, true)),
                             30.0, 0.2}});
  return simulation;
}

Simulation tank_of(const Case& c) { return c.skin ? skinned_tank() : busy_tank(c); }

// Returns the number of contacts, of all steps.
int advance(Simulation& simulation, int steps) {
  int contacts = 0;
  for (int i = 0; i < steps; ++i)
    contacts += simulation.step(std::min(0.005, simulation.stable_dt())).contacts;
  return contacts;
}

class ResumeCases : public Resume, public ::testing::WithParamInterface<Case> {};

TEST_P(ResumeCases, IsTheUninterruptedRunBitForBit) {
  const Case c = GetParam();
  Simulation straight = tank_of(c);
  EXPECT_GT(advance(straight, c.steps), 0);
  ASSERT_EQ(straight.bodies().size(), 4u);

  Simulation first = tank_of(c);
  advance(first, c.steps / 10);  // before the last body appears
  const std::string early = states_.save(first, "early.h5");
  Simulation second = tank_of(c);
  states_.load(second, early);
  EXPECT_EQ(states_.hash(second), sha256_of_file(early));
  advance(second, c.steps / 2 - c.steps / 10);
  Simulation third = tank_of(c);
  states_.load(third, states_.save(second, "late.h5"));
  advance(third, c.steps - c.steps / 2);

  EXPECT_EQ(third.time(), straight.time());
  EXPECT_EQ(states_.hash(third), states_.hash(straight));
  for (int b = 0; b < 4; ++b) {
    EXPECT_EQ(third.bodies()[b].position, straight.bodies()[b].position);
    EXPECT_EQ(third.bodies()[b].q, straight.bodies()[b].q);
    EXPECT_EQ(third.water_impulse(b), straight.water_impulse(b));
  }
}
INSTANTIATE_TEST_SUITE_P(
    All, ResumeCases,
    ::testing::Values(Case{.steps = 100}, Case{.geometry = Geometry::kVoxel},
                      Case{.scheme = Scheme::kSingle, .joint = false}, Case{.water = false},
                      Case{.skin = true}, Case{.steps = 100, .layers = 48},
                      Case{.scheme = Scheme::kSingle, .joint = false, .steps = 100, .layers = 48}));

// What a rejected attempt leaves behind is not in the file, so nothing may hang on it.
TEST_F(Resume, AfterAStepThatWasHalvedIsTheUninterruptedRun) {
  const auto spinning = [] {
    Simulation tank = busy_tank({});
    tank.bodies()[1].L = Vec3(0.0, 1.0, 8.0);
    return tank;
  };
  Simulation straight = spinning(), resumed = spinning();
  constexpr double kLong = 0.04;  // s
  int halvings = 0, steps = 0;
  for (; halvings == 0 && steps < 20; ++steps) halvings = straight.step(kLong).halvings;
  ASSERT_GT(halvings, 0);
  states_.load(resumed, states_.save(straight, "halved.h5"));
  for (int n = 0; n < 3; ++n) {
    const StepReport a = straight.step(0.01), b = resumed.step(0.01);
    EXPECT_EQ(a.velocity.iterations, b.velocity.iterations);
  }
  EXPECT_EQ(states_.hash(resumed), states_.hash(straight));
}

TEST_F(Resume, DamagedAndForeignStatesAreRefused) {
  Simulation tank = busy_tank({});
  advance(tank, 2);
  const std::string path = states_.save(tank, "a.h5");
  const auto refusal = [&](const Case& c) -> std::string {
    Simulation fresh = busy_tank(c);
    try {
      states_.load(fresh, path);
    } catch (const FileError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal({}), "");
  EXPECT_NE(refusal({.scheme = Scheme::kSingle, .joint = false}).find("u_last"), std::string::npos);

  // one flipped bit in the middle of the water
  std::FILE* file = std::fopen(path.c_str(), "r+b");
  const long middle = static_cast<long>(std::filesystem::file_size(path)) / 2;
  std::fseek(file, middle, SEEK_SET);
  const int byte = std::fgetc(file);
  std::fseek(file, middle, SEEK_SET);
  std::fputc(byte ^ 1, file);
  std::fclose(file);
  EXPECT_NE(refusal({}).find("do not match their hash"), std::string::npos) << refusal({});
  std::filesystem::resize_file(path, static_cast<std::size_t>(middle));
  EXPECT_NE(refusal({}), "");
}

}  // namespace
}  // namespace archetide
