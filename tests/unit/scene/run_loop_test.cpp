#include "runtime/scene/run_loop.h"

#include <gtest/gtest.h>

#include "runtime/scene/expectations.h"
#include "runtime/scene/scene_builder.h"
#include "scene_test_support.h"

namespace archetide {
namespace {

// One tetrahedron falling in vacuum, steps of at most 0.03 s.
Simulation falling_body() {
  BodySpec spec;
  spec.modes = 0;
  const auto archetype = std::make_shared<const Archetype>(tetrahedron_archetype("tetra"));
  SimulationOptions options;
  options.max_dt = 0.03;
  options.wall_contact = false;
  return Simulation(options, FluidState(), {instantiate(spec, archetype)}, {});
}

struct Recorder {
  std::vector<double> frames;
  std::vector<StepReport> steps;
  bool stop = false;

  RunEvents events(Simulation& simulation) {
    return {[this](const StepReport& r) { steps.push_back(r); },
            [this, &simulation] { frames.push_back(simulation.time()); }, [this] { return stop; }};
  }
};

TEST(RunLoop, CountsTheFramesThatItWrites) {
  EXPECT_EQ(frame_count(1.0, 24), 25);
  EXPECT_EQ(frame_count(1.0, 49), 50);
  EXPECT_EQ(frame_count(0.51, 10), 7);  // the last one is short
  EXPECT_EQ(frame_count(0.0, 24), 1);
}

TEST(RunLoop, StepsLandOnFramesEvenly) {
  Simulation simulation = falling_body();
  Recorder record;
  EXPECT_EQ(run_frames(simulation, {.end_time = 0.5, .fps = 10}, record.events(simulation)),
            RunEnd::kDone);
  ASSERT_EQ(record.frames.size(), 6u);  // the initial state and five frames
  for (int n = 0; n < 6; ++n) EXPECT_NEAR(record.frames[n], 0.1 * n, 1e-12);
  ASSERT_EQ(record.steps.size(), 20u);  // 0.1 s at 0.03 s: four steps of 0.025 s
  for (const StepReport& r : record.steps) EXPECT_NEAR(r.dt, 0.025, 1e-12);
}

TEST(RunLoop, LastFrameIsTheEndEvenWhenShorter) {
  Simulation simulation = falling_body();
  Recorder record;
  run_frames(simulation, {.end_time = 0.25, .fps = 10}, record.events(simulation));
  ASSERT_EQ(record.frames.size(), 4u);
  EXPECT_NEAR(record.frames.back(), 0.25, 1e-12);
}

// Not at 0.23 exactly: the steps must be those of the run that is not stopped.
TEST(RunLoop, UntilStopsAfterTheFirstStepThatReachesIt) {
  Simulation simulation = falling_body();
  Recorder record;
  EXPECT_EQ(run_frames(simulation, {.end_time = 0.5, .fps = 10, .until = 0.23},
                       record.events(simulation)),
            RunEnd::kStopped);
  EXPECT_NEAR(simulation.time(), 0.25, 1e-12);
  EXPECT_EQ(record.frames.size(), 3u);
}

TEST(RunLoop, StopRequestEndsBeforeTheNextStep) {
  Simulation simulation = falling_body();
  Recorder record;
  record.stop = true;
  EXPECT_EQ(run_frames(simulation, {.end_time = 0.5, .fps = 10}, record.events(simulation)),
            RunEnd::kStopped);
  EXPECT_TRUE(record.steps.empty());
}

TEST(NextStep, SplitsEvenlyAndHardlyExceedsTheStableStep) {
  EXPECT_DOUBLE_EQ(next_step(1.0, 2.0, 9.0), 1.0);
  EXPECT_DOUBLE_EQ(next_step(1.0, 0.4, 9.0), 1.0 / 3.0);
  EXPECT_DOUBLE_EQ(next_step(1.0, 1.0 / 3.0, 9.0), 1.0 / 3.0);
  EXPECT_DOUBLE_EQ(next_step(1.0, 0.96, 9.0), 1.0);  // one step where two would be much shorter
  EXPECT_DOUBLE_EQ(next_step(1.0, 0.95, 9.0), 0.5);
  EXPECT_DOUBLE_EQ(next_step(1.0, 0.99, 0.99), 0.5);                    // but no more than step.max
  EXPECT_DOUBLE_EQ(next_step(1.0 / 24.0, 0.0416, 0.0416), 1.0 / 24.0);  // which is rounded
  EXPECT_DOUBLE_EQ(next_step(1.0, 1.0 / 3.0, 1.0 / 3.0),
                   1.0 / 3.0);  // round-off makes no fourth step
}

TEST(Expectations, JudgeTheMeansOverTheWindow) {
  Simulation simulation = falling_body();
  ExpectSpec spec;
  spec.iterations = 0;
  spec.volume_drift = 0.0;
  spec.deformation_min = 0.1;
  BodyExpectation body;
  body.window = 0.5;
  body.z_min = -5.0, body.z_max = -4.9;
  body.speed_min = 7.0, body.speed_max = 7.1;
  spec.bodies = {body};
  Expectations expectations(spec, 1.0);
  Recorder record;
  RunEvents events = record.events(simulation);
  events.on_step = [&](const StepReport& r) { expectations.observe(r, simulation); };
  run_frames(simulation, {.end_time = 1.0, .fps = 10}, events);
  std::vector<std::string> texts;
  for (const ExpectationResult& result : expectations.evaluate()) texts.push_back(result.text);
  ASSERT_EQ(texts.size(), 7u);
  expect_contains(texts[0], "PASS expect.volume_drift");
  expect_contains(texts[1], "PASS expect.iterations: 0, at most 0");
  expect_contains(texts[2], "FAIL expect.deformation_min: 0, at least 0.1");
  // Free fall over the last half second: mean z = -g (1 - 1/8) / 3 = -2.861 m, mean speed 3/4 g
  // = 7.36 m/s; a step of 0.025 s adds the mean of its end instead of its middle, g 0.0125 s = 0.12
  // m/s.
  expect_contains(texts[3], "PASS expect.body[0] (body 0) mean z: -2.95");
  expect_contains(texts[4], "FAIL expect.body[0] (body 0) mean z: -2.95");
  expect_contains(texts[5], "PASS expect.body[0] (body 0) mean speed: 7.48");
  expect_contains(texts[6], "FAIL expect.body[0] (body 0) mean speed: 7.48");
}

TEST(VolumeDrift, IsRelativeToTheFirstStep) {
  VolumeDrift drift;
  StepReport report;
  report.water_volume = 2.0;
  EXPECT_EQ(drift.observe(report), 0.0);
  report.water_volume = 1.5;
  EXPECT_EQ(drift.observe(report), -0.25);
}

TEST(Expectations, DraftIsFromTheLowestPointToTheCalmLevel) {
  BodySpec spec;
  spec.modes = 0;
  spec.position = Vec3(0.5, 0.5, 0.6);
  const auto archetype = std::make_shared<const Archetype>(tetrahedron_archetype("tetra"));
  SimulationOptions options;
  options.grid = {10, 10, 10, 0.1, Vec3::Zero()};
  options.has_water = true;
  FluidState water;
  water.phi.resize(10, 10, 10, 1.0);
  const Simulation simulation(options, std::move(water), {instantiate(spec, archetype)}, {});
  StepReport report;
  report.t = report.dt = 1.0, report.water_volume = 0.3;
  // 0.3 m^3 of water and 400/1000 of 1/6 m^3 under water on 1 m^2; the lowest corner is 0.25 m
  // under the centre of mass.
  const double level = 0.3 + 0.4 / 6.0, draft = level - (0.6 - 0.25);
  EXPECT_NEAR(calm_level(options, 0.3, simulation.bodies()), level, 1e-12);
  ExpectSpec expect;
  BodyExpectation wanted;
  wanted.window = 1.0, wanted.draft = draft + 0.02, wanted.margin = 0.01;
  expect.bodies = {wanted};
  Expectations expectations(expect, 1.0);
  expectations.observe(report, simulation);
  const std::vector<ClosedForm> forms = expectations.closed_forms();
  ASSERT_EQ(forms.size(), 1u);
  EXPECT_NEAR(forms[0].value, draft, 1e-12);
  EXPECT_NEAR(forms[0].size, std::cbrt(1.0 / 6.0), 1e-12);
  const std::vector<ExpectationResult> judged = expectations.evaluate();
  ASSERT_EQ(judged.size(), 1u);
  EXPECT_FALSE(judged[0].pass);  // 0.02 off, 0.01 allowed
  expect_contains(judged[0].text, "draft off its closed form: 0.02");
}

}  // namespace
}  // namespace archetide
