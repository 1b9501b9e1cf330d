// Violent scenes that nobody has chosen: boxes of water that fall, collapse and stream around
// obstacles, rigid and soft bodies, joints, skins, some through open sides, from numbers that a
// seed gives. What every one of them must obey is known.
#include <random>

#include "tests/hard/hard_case.h"
#include "tests/support/full_blob.h"
#include "tests/support/skinned_bar.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

struct Outcome {
  bool finite = true;
  double kept = 0.0, energy_rise = 0.0, speed = 0.0;  // of the water, of the first energy, of the
                                                      // fall: sqrt(2 g H)
};

// Of soft bodies: smooth random linear modes; or blobs of linear and nonlinear material, by modes and
// by nodes.
enum class Kinds { kModes, kBlobs };

class RandomScene {
 public:
  RandomScene(unsigned seed, int most_cells, Kinds kinds) : random_(seed), kinds_(kinds) {
    const auto cells = [&] { return most_cells - 4 * static_cast<int>(pick(3)); };
    options_ = unit_tank(1);
    options_.grid = {cells(), cells(), cells(), 1.0 / 24, Vec3::Zero()};
    options_.open_side[kZMax] = chance(0.3);
    const double steps[] = {0.5, 1.0, 2.0, 3.0, 4.0}, tolerances[] = {1e-4, 1e-6, 1e-8};
    options_.cfl = steps[pick(5)], options_.tolerance = tolerances[pick(3)];
    size_ = options_.grid.high();
    if (chance(0.7)) add_water(Vec3::Zero(), Vec3(size_[0], size_[1], within(0.1, 0.5) * size_[2]));
    for (int more = (boxes_.empty() ? 1 : 0) + static_cast<int>(pick(2)); more > 0; --more) {
      Vec3 low, high;
      for (int a = 0; a < 3; ++a) {
        low[a] = within(0.0, 0.6) * size_[a];
        high[a] = std::min(size_[a], low[a] + within(0.15, 0.5) * size_[a]);
      }
      add_water(low, high);
    }
    switch (pick(6)) {
      case 0:
        add_obstacle();
        break;
      case 1:
        add_partition();
        break;
      case 2:
        if (size_.minCoeff() > 0.66)
          add_skinned_bar();
        else
          add_bodies();
        break;
      default:
        add_bodies();
    }
    options_.body_contact = chance(0.5);
    if (chance(0.25))
      for (int a = 0; a < 3; ++a) stream_[a] = within(-2.0, 2.0);
    if (chance(0.15)) options_.open_side[pick(4)] = true;  // of x or y
  }

  // One or two that pour for a time.
  void add_sources() {
    for (int n = 1 + static_cast<int>(pick(2)); n > 0; --n) {
      WaterSource source;
      for (int a = 0; a < 3; ++a) {
        source.low[a] = within(0.0, 0.6) * size_[a];
        source.high[a] = source.low[a] + within(0.2, 0.4) * size_[a];
        source.velocity[a] = within(-3.0, 3.0);
      }
      source.start = within(0.0, 0.3), source.end = source.start + within(0.2, 0.6);
      top_ = std::max(top_, source.high[2]);
      poured_speed_ = std::max(poured_speed_, source.velocity.norm());
      options_.sources.push_back(source);
    }
  }

  Outcome run(double end) const {
    FluidState initial = water_where(options_.grid, [&](const Vec3& x) {
      double nearest = INFINITY;
      for (const auto& [low, high] : boxes_)
        nearest = std::min(nearest, box_distance(x, low, high));
      return nearest;
    });
    const auto& streams = boxes_.back();  // the rest is still
    const auto stream = [&](const Vec3& x) -> Vec3 {
      return box_distance(x, streams.first, streams.second) < 0.0 ? stream_ : Vec3::Zero();
    };
    set_velocity(options_.grid, stream, initial);
    Simulation s(options_, initial, bodies_, obstacles_, {}, joints_, skins_);
    Outcome result;
    double first = 0.0, energy = 0.0;
    const double fall =
        std::sqrt(2.0 * 9.81 * top_ + stream_.squaredNorm() + poured_speed_ * poured_speed_);
    while (s.time() < end) {
      const StepReport r = s.step(std::min(s.stable_dt(), 0.0416));
      const double water = r.accounted_volume() + r.volume_residual,
                   now = r.water_kinetic + r.body_kinetic + r.body_elastic + r.spray_kinetic +
                         r.potential - r.actuation_work;
      if (first == 0.0) first = water, energy = now;
      result.finite = result.finite && std::isfinite(now);
      if (first > 0.0)
        result.kept = std::max(result.kept, std::abs(water - first) / (first + r.source_volume));
      const double all = energy + std::max(r.actuation_work, 0.0);  // with what came
      result.energy_rise = std::max(result.energy_rise, (now - energy) / all);
      result.speed = std::max(result.speed, r.max_speed / fall);
    }
    return result;
  }

 private:
  double within(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / 4294967295.0;
  }
  unsigned pick(unsigned count) { return static_cast<unsigned>(random_() % count); }
  bool chance(double p) { return within(0.0, 1.0) < p; }

  void add_water(const Vec3& low, const Vec3& high) {
    boxes_.emplace_back(low, high);
    top_ = std::max(top_, high[2]);
  }
  void add_box(const Vec3& low, const Vec3& high) {
    TriMesh box = box_surface(high - low, 0);
    for (Vec3& x : box.vertices) x += 0.5 * (low + high);
    obstacles_.push_back(box);
  }
  void add_obstacle() {
    const double x = within(0.1, 0.7) * size_[0], y = within(0.1, 0.7) * size_[1];
    const double height = within(0.1, 0.6) * size_[2], depth = within(0.15, 0.3),
                 width = within(0.15, 0.3);
    add_box(Vec3(x, y, -0.1), Vec3(x + width, y + depth, height));
  }
  void add_partition() {
    const double x = within(0.3, 0.7) * size_[0], height = within(0.3, 1.1) * size_[2],
                 width = within(0.12, 0.3);
    add_box(Vec3(x, -0.1, -0.1), Vec3(x + width, size_[1] + 0.1, height));
  }
  Quat turn() {
    const double z = within(-1.0, 1.0), y = within(-1.0, 1.0), x = within(-1.0, 1.0);
    return Quat(x, y, z, 1.0).normalized();
  }
  void add_bodies() {
    const double densities[] = {50.0, 200.0, 500.0, 900.0, 2000.0};
    for (int n = static_cast<int>(pick(4)); n > 0; --n) {
      Vec3 x;
      for (int a = 0; a < 3; ++a) x[a] = within(0.2, size_[a] - 0.2);
      const auto near = [&](const ReducedBody& b) { return (b.position - x).norm() < 0.36; };
      if (std::any_of(bodies_.begin(), bodies_.end(), near)) continue;
      const double density = densities[pick(5)];
      const auto shape = pick(2);
      bodies_.push_back(shape == 0                ? rigid_ball(0.14, density, x)
                        : kinds_ == Kinds::kBlobs ? blob(density, x)
                                                  : soft_body(density, x));
      top_ = std::max(top_, x[2]);
    }
    if (bodies_.size() > 1 && chance(0.5)) tie(0, 1, {bodies_[1].position});
  }
  ReducedBody soft_body(double density, const Vec3& x) {
    SyntheticOptions soft;
    soft.seed = 1 + pick(5), soft.density = density, soft.first_omega = within(15.0, 60.0);
    const TetMesh tets = blob_tets(soft.seed, Vec3(0.26, 0.22, 0.2), Vec3i(3, 3, 3));
    ReducedBody body = make_body(deformable_archetype(tets, soft).archetype, soft.r);
    body.position = x, body.rotation = turn();
    return body;
  }
  ReducedBody blob(double density, const Vec3& x) {
    constexpr int kStored = 18;
    const TetMesh tets = blob_tets(1 + pick(5), Vec3(0.26, 0.22, 0.2), Vec3i(2, 2, 2));
    FullBlob blob(tets, density, std::pow(10.0, within(3.7, 5.3)), kStored);
    if (chance(0.6)) blob.make_nonlinear();
    ReducedBody body = chance(0.5) ? body_of_nodes(blob) : body_of_modes(blob);
    body.position = x, body.rotation = turn();
    return body;
  }
  // Two parts, rigid or soft, that are welded under one skin.
  void add_skinned_bar() {
    constexpr double kCut = 0.02, kBlend = 0.15;
    const Quat turned = turn();
    const Vec3 place = 0.5 * size_;
    const double density = within(300.0, 1500.0);
    const SkinnedBar bar =
        skinned_bar({-0.3, kCut, 0.3}, kBlend, 0.0, chance(0.5) ? 3 : 0, density, place, turned);
    bodies_ = bar.bodies, skins_ = {bar.skin};
    const double w = 0.2 * SkinnedBar::kWidth;
    const auto at = [&](double y, double z) -> Vec3 { return place + turned * Vec3(kCut, y, z); };
    tie(0, 1, {at(w, 0), at(-w, w), at(-w, -w)});
    top_ = std::max(top_, place[2]);
  }
  void tie(int a, int b, std::vector<Vec3> places) {
    const ReducedBody& body = bodies_[static_cast<std::size_t>(a)];
    for (Vec3& x : places) x = body.rotation.conjugate() * (x - body.position);
    joints_.push_back(make_joint(bodies_, a, b, places));
  }

  std::mt19937 random_;
  Kinds kinds_;
  SimulationOptions options_;
  Vec3 size_;
  double top_ = 0.0;
  Vec3 stream_ = Vec3::Zero();  // m/s
  double poured_speed_ = 0.0;   // of sources, m/s
  std::vector<std::pair<Vec3, Vec3>> boxes_;
  std::vector<TriMesh> obstacles_;
  std::vector<ReducedBody> bodies_;
  std::vector<Joint> joints_;
  std::vector<SkinnedBodies> skins_;
};

// Known misses: no rise of the energy above 0.5 % is asked for. `most` is for the largest that is
// measured, `more` for how many scenes have more than 0.5 %: light bodies that leave the water, and
// sheets below a cell.
void run_scenes(unsigned first, int count, int most_cells, double end, int more, double most,
                double most_speed = 4.0, Kinds kinds = Kinds::kModes, bool sources = false) {
  int rising = 0;
  double kept = 0.0, rise = 0.0, speed = 0.0;
  for (unsigned seed = first; seed < first + static_cast<unsigned>(count); ++seed) {
    RandomScene scene(seed, most_cells, kinds);
    if (sources) scene.add_sources();
    const Outcome o = scene.run(end);
    std::printf("seed %u: energy %+.2f %%, fastest %.2f, water %.1e\n", seed, 100 * o.energy_rise,
                o.speed, o.kept);
    EXPECT_TRUE(o.finite) << seed;
    rising += o.energy_rise > 0.005;
    kept = std::max(kept, o.kept);
    rise = std::max(rise, o.energy_rise), speed = std::max(speed, o.speed);
  }
  expect_at_most("change of all water", kept, 1e-10);
  expect_at_most("fastest water / sqrt(2 g H)", speed, most_speed);
  expect_at_most("rise of the energy", rise, most);
  expect_at_most("scenes whose energy rises by more than 0.5 %", rising, more);
}

// No miss here. Measured: 0.16 %.
TEST(RandomScenes, ObeyTheLaws) { run_scenes(1, 40, 20, 0.8, 0, 0.005); }
// Streams that strike light soft bodies at CFL 4. In 1092 the body was thrown off in the first step
// (20.5 for the speed [D58]), in 1289 the energy rose by 815 % [D63]. Measured: 1.1, 1.3 (before
// [D83] 2.9, 3.0); no rise.
TEST(RandomScenes, LightBodyInAStreamIsNotThrownOff) { run_scenes(1092, 1, 32, 0.1, 0, 0.005); }
TEST(RandomScenes, LightBodyInAStreamAtALongStep) { run_scenes(1289, 1, 32, 0.5, 0, 0.005); }
// Measured in all thousand: one rises by 0.80 % (1788), the next by 0.50 %; 3.8 for the speed (before
// eddies were damped to the walls [D22] five, 1.3 %).
class RandomScenesFrom : public testing::TestWithParam<unsigned> {};
TEST_P(RandomScenesFrom, ObeyTheLaws) { run_scenes(GetParam(), 200, 32, 1.5, 2, 0.02); }
INSTANTIATE_TEST_SUITE_P(Slow, RandomScenesFrom, testing::Values(1000, 1200, 1400, 1600, 1800),
                         testing::PrintToStringParamName());

// Blobs of 5 to 200 kPa. Measured: 0.16 %; 1.1 for the speed.
TEST(RandomScenes, NonlinearAndFullBodiesObeyTheLaws) {
  run_scenes(12, 5, 20, 0.8, 0, 0.005, 4.0, Kinds::kBlobs);
}
// Measured in 2000 to 2039: no rise, 2.3 for the speed.
class RandomScenesOfBlobs : public testing::TestWithParam<unsigned> {};
TEST_P(RandomScenesOfBlobs, ObeyTheLaws) {
  run_scenes(GetParam(), 40, 32, 1.5, 0, 0.005, 4.0, Kinds::kBlobs);
}
INSTANTIATE_TEST_SUITE_P(Slow, RandomScenesOfBlobs, testing::Values(2000, 2040),
                         testing::PrintToStringParamName());

// Water from sources on top of such scenes. Measured: 0.28 % (15 % while what
// lies beside a source, and is set in motion with it, was not booked); 1.6 for the speed.
TEST(RandomScenes, SourcesObeyTheLaws) {
  run_scenes(3000, 10, 20, 0.8, 0, 0.005, 4.0, Kinds::kModes, true);
}
// Known miss [D93]: a source that starts around a light body at CFL 4 (3094, 2.47 %); two that pour
// into one another (3115, 1.24 %). The next: 0.12 %; 2.5 for the speed.
TEST(SlowRandomScenes, SourcesObeyTheLaws) {
  run_scenes(3010, 150, 20, 0.8, 2, 0.03, 4.0, Kinds::kModes, true);
}

}  // namespace
}  // namespace archetide
