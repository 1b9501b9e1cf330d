#include "runtime/scene/fall.h"

#include <algorithm>
#include <cmath>

#include "runtime/scene/initial_water.h"

namespace archetide {
namespace {

constexpr double kDrag = 0.8;       // drag coefficient: between a ball (0.5) and a disc (1.1)
constexpr double kAddedMass = 0.5;  // of the water displaced: that of a ball

/// A body at rest, seen along its way down.
struct Outline {
  Vec3 lowest = Vec3::Zero();  // point of its surface, world, m
  double height = 0.0;         // along the way, m
  double area = 0.0;           // of what looks down, across the way, m^2
};

/// Projected along up, rest frame, m^2.
double area_below(const TriMesh& surface, const Vec3& up) {
  double area = 0.0;
  for (const Vec3i& t : surface.triangles) {
    const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]],
               &c = surface.vertices[t[2]];
    area += 0.5 * std::max(0.0, -up.dot((b - a).cross(c - a)));
  }
  return area;
}

Outline outline_of(const ReducedBody& body, const Vec3& up) {
  const TriMesh& surface = body.archetype->surface;
  const Vec3 n = body.rotation.conjugate() * up;
  const auto [low, high] =
      std::minmax_element(surface.vertices.begin(), surface.vertices.end(),
                          [&](const Vec3& x, const Vec3& y) { return n.dot(x) < n.dot(y); });
  return {body.position + body.rotation * *low, n.dot(*high - *low), area_below(surface, n)};
}

/// From x down to the closed side of the tank that is met first, m; infinite where there is none.
double way_to_floor(const SimulationOptions& o, const Vec3& x, const Vec3& up) {
  if (o.grid.cells() == 0) return INFINITY;
  double way = INFINITY;
  bool closed = false;
  for (int axis = 0; axis < 3; ++axis) {
    if (up[axis] == 0.0) continue;
    const bool upper = up[axis] < 0.0;
    const double side = upper ? o.grid.high()[axis] : o.grid.low()[axis];
    const double to_side = std::max(0.0, (x[axis] - side) / up[axis]);
    if (to_side < way) way = to_side, closed = !o.open_side[2 * axis + (upper ? 1 : 0)];
  }
  return closed ? way : INFINITY;
}

/// From x down to the water, m; infinite where there is none within `most`. The distance to the
/// water is a step that cannot miss it.
double way_to_water(const FluidSpec& fluid, const Vec3& x, const Vec3& up, double most) {
  constexpr int kMostSteps = 1000;
  constexpr double kNear = 1e-3;  // cells
  double way = 0.0;
  for (int n = 0; n < kMostSteps && way < most; ++n) {
    const double distance = water_distance(fluid, x - way * up);
    if (!(distance > kNear * fluid.cell)) return way;
    way += distance;
  }
  return INFINITY;
}

/// Share of a body that is under water: at the end of a way of `depth` through it, and in the mean.
struct Wet {
  double end = 1.0, mean = 1.0;
};
Wet wet_from_air(double depth, double height) {
  if (depth < height) return {depth / height, 0.5 * depth / height};
  return {1.0, 1.0 - 0.5 * height / depth};
}

/// A way through water, with a constant force and a drag that grows with the square of the speed.
struct Dive {
  double depth = 0.0;   // m
  double gain = 0.0;    // weight less buoyancy over the mass that moves, m/s^2
  double fading = 0.0;  // drag alone leaves exp(-fading) of v^2
};

/// v^2 at its end, m^2/s^2: d(v^2)/ds = 2 gain - fading v^2 / depth. Negative: the body turns back.
double square_after(const Dive& dive, double square) {
  const double left = std::exp(-dive.fading);
  const double mean = dive.fading > 0.0 ? (1.0 - left) / dive.fading : 1.0;
  return square * left + 2.0 * dive.gain * dive.depth * mean;
}

/// Water of `density` on the body's way, from v^2 = `square` above it to the floor.
void sink(const ReducedBody& body, const Outline& seen, double g, double density, double depth,
          bool from_air, double square, Fall& fall) {
  const Wet wet = from_air ? wet_from_air(depth, seen.height) : Wet{};
  const double mass = body_mass(body), displaced = density * body.archetype->volume;
  const double moving = mass + kAddedMass * wet.end * displaced;
  if (from_air) square *= std::pow(mass / moving, 2);
  const Dive dive{depth, g * (mass - wet.mean * displaced) / moving,
                  kDrag * density * seen.area * depth / moving};
  fall.onto_floor = std::sqrt(std::max(0.0, square_after(dive, square)));
  fall.pull = g * std::max(0.0, 1.0 - wet.end * displaced / mass);
}

}  // namespace

Fall fall_of(const SceneSpec& scene, const SimulationOptions& o, const ReducedBody& body) {
  const double g = o.gravity.norm();
  const Vec3 velocity = body.P / body_mass(body);
  if (g == 0.0 && velocity.isZero()) return {};
  Fall fall;
  fall.up = -(g > 0.0 ? o.gravity : velocity).normalized();
  const Outline seen = outline_of(body, fall.up);
  const double floor = way_to_floor(o, seen.lowest, fall.up);
  const double water =
      o.has_water ? way_to_water(*scene.fluid, seen.lowest, fall.up, floor) : INFINITY;
  const double air = std::min(water, floor);
  if (!std::isfinite(air)) return fall;
  const double square = velocity.squaredNorm() + 2.0 * g * air;
  if (air > 0.0) fall.in_air = std::sqrt(square);
  if (!std::isfinite(water)) {
    fall.onto_floor = std::sqrt(square), fall.pull = g;
    return fall;
  }
  if (water > 0.0) fall.into_water = std::sqrt(square);
  if (std::isfinite(floor))
    sink(body, seen, g, o.water_density, floor - water, water > 0.0, square, fall);
  return fall;
}

}  // namespace archetide
