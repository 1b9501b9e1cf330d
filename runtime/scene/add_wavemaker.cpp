#include "runtime/scene/add_wavemaker.h"

#include <fmt/core.h>

#include <cmath>

#include "runtime/scene/add_moving_obstacle.h"

namespace archetide {
namespace {

constexpr double kBeyond = 4.0;  // cells that the block reaches out of the tank at least

// Where a wave maker stands and how far it goes.
struct Board {
  Vec3 inward = Vec3::Zero();  // horizontal, of length 1, from its side
  Vec3 foot = Vec3::Zero();    // of its front on the floor at rest, in the middle of the tank, m
  double front = 0.0;          // from the side, m
  double stroke = 0.0;         // at the level of the water, m
  double depth = 0.0, ramp = 0.0;  // m, s
  double omega = 0.0;              // rad/s
};

// From outside of the side up to the front, through the whole width, from below the floor, so deep
// that no gap opens when it tilts, to above the tank.
TriMesh block_of(const Board& board, const FluidSpec& fluid) {
  const double beyond = kBeyond * fluid.cell, length = 2.0 * board.front + board.stroke + beyond;
  const Vec3 back = board.foot - length * board.inward;
  Vec3 low = fluid.origin - Vec3::Constant(beyond), high = fluid.high() + Vec3::Constant(beyond);
  low[2] -= length * board.stroke / (2.0 * board.depth);
  const int axis = board.inward[0] != 0.0 ? 0 : 1;
  low[axis] = std::min(board.foot[axis], back[axis]);
  high[axis] = std::max(board.foot[axis], back[axis]);
  return box_between(low, high);
}

// A sine that reaches its stroke with the ramp.
MotionPath path_of(const Board& board, bool flap, double until) {
  constexpr int kKeys = 64;  // a period: the cubics between them are then within 2e-6 of the stroke
  const double step = 2.0 * M_PI / board.omega / kKeys;
  const Vec3 tilt = Vec3::UnitZ().cross(board.inward);
  MotionPath path;
  for (int n = 0; n == 0 || path.keys.back().t < until; ++n) {
    const double t = n * step;
    const double ease = t < board.ramp ? 0.5 - 0.5 * std::cos(M_PI * t / board.ramp) : 1.0;
    const double way = 0.5 * board.stroke * ease * std::sin(board.omega * t);
    MotionPath::Key key{t};
    if (flap)
      key.turn = Quat(Eigen::AngleAxisd(std::atan(way / board.depth), tilt));
    else
      key.shift = way * board.inward;
    path.keys.push_back(key);
  }
  return path;
}

void demand_calm_water(const WavemakerSpec& spec, const SceneSpec& scene) {
  if (!scene.fluid || scene.fluid->water.level.value_or(0.0) <= 0.0)
    throw InputError(
        {{spec.where, "a wave maker needs water of a known depth", "give fluid.water.level"}});
  const Vec3& g = scene.gravity;
  if (g[0] != 0.0 || g[1] != 0.0 || !(g[2] < 0.0))
    throw InputError({{spec.where, "waves need gravity along -z",
                       "leave gravity out, or move an obstacle of your own ([[static]], motion)"}});
}

}  // namespace

double wave_number(double omega, double depth, double g) {
  const double deep = omega * omega / g;  // times depth
  double kh = deep * depth / std::sqrt(std::tanh(deep * depth));
  for (int n = 0; n < 20; ++n) {  // Newton; within 5 % at the start
    const double t = std::tanh(kh);
    kh -= (kh * t - deep * depth) / (t + kh * (1.0 - t * t));
  }
  return kh / depth;
}

double height_over_stroke(bool flap, double kh) {
  // over cosh^2 kh, which is large in deep water
  const double t = std::tanh(kh), one = 1.0 / std::cosh(kh), both = 2.0 * (t + kh * one * one);
  if (flap) return 4.0 * t / kh * (kh * t - 1.0 + one) / both;
  return 4.0 * t * t / both;
}

void add_wavemaker(const WavemakerSpec& spec, const SceneSpec& scene, BuiltScene& built) {
  demand_calm_water(spec, scene);
  const FluidSpec& fluid = *scene.fluid;
  const int axis = spec.side / 2;
  Board board;
  board.depth = *fluid.water.level;
  board.omega = 2.0 * M_PI / spec.period;
  const double k = wave_number(board.omega, board.depth, -scene.gravity[2]);
  const double ratio = height_over_stroke(spec.flap, k * board.depth);
  board.stroke = spec.stroke ? *spec.stroke : *spec.height / ratio;
  board.ramp = spec.ramp.value_or(2.0 * spec.period);
  board.front = spec.front.value_or(board.stroke + 2.0 * fluid.cell);
  const double tank = fluid.high()[axis] - fluid.origin[axis];
  if (2.0 * board.front < board.stroke || board.front + 0.5 * board.stroke > 0.5 * tank)
    throw InputError(
        {{spec.where,
          fmt::format("its front, {:.4g} m from the side, cannot go to and fro by {:.4g} m",
                      board.front, board.stroke),
          "lower waves, shorter ones in a longer tank, or another front"}});
  board.inward[axis] = spec.side % 2 == 0 ? 1.0 : -1.0;
  board.foot = 0.5 * (fluid.origin + fluid.high());
  board.foot[2] = fluid.origin[2];
  board.foot[axis] =
      (spec.side % 2 == 0 ? fluid.origin : fluid.high())[axis] + board.front * board.inward[axis];
  StaticSpec obstacle;
  obstacle.where = obstacle.motion_where = spec.where;
  obstacle.mesh = "wavemaker";
  obstacle.position = board.foot;
  obstacle.motion = path_of(board, spec.flap, scene.end_time);
  add_moving_obstacle(obstacle, block_of(board, fluid), std::nullopt, built);

  const double height = ratio * board.stroke, length = 2.0 * M_PI / k;
  built.wavemakers.push_back(fmt::format(
      "{} of stroke {:.4g} m: waves of {:.4g} m in height and {:.4g} m in length, kh {:.3g}",
      spec.flap ? "flap" : "piston", board.stroke, height, length, k * board.depth));
  constexpr double kSteepest = 0.14;  // of the length in deep water [DD91]
  if (height > kSteepest * length * std::tanh(k * board.depth))
    built.notes.push_back(fmt::format(
        "waves: {:.4g} m is higher than waves of {:.4g} m in length can be; they break at the wave "
        "maker",
        height, length));
  constexpr double kCells = 12.0;
  if (length < kCells * fluid.cell)
    built.notes.push_back(fmt::format("waves: {:.4g} m long, {:.1f} cells: the grid damps them",
                                      length, length / fluid.cell));
}

}  // namespace archetide
