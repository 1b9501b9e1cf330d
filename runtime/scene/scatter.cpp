#include "runtime/scene/scatter.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace archetide {
namespace {

constexpr int kTriesPerInstance = 2000;

// Uniform in [0, 1) from the 53 high bits: the same numbers with every standard library.
double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

// Uniform over all rotations [Shoemake 1992].
Quat random_rotation(std::mt19937_64& random) {
  const double u = uniform(random);
  const double a = 2.0 * std::numbers::pi * uniform(random);
  const double b = 2.0 * std::numbers::pi * uniform(random);
  const double s = std::sqrt(1.0 - u), c = std::sqrt(u);
  return Quat(c * std::cos(b), s * std::sin(a), s * std::cos(a), c * std::sin(b));
}

Vec3 random_point(const BoxSpec& box, std::mt19937_64& random) {
  Vec3 x;
  for (int a = 0; a < 3; ++a) x[a] = box.low[a] + (box.high[a] - box.low[a]) * uniform(random);
  return x;
}

bool is_free(const Vec3& x, double reach, const std::vector<OccupiedBall>& occupied) {
  return std::none_of(occupied.begin(), occupied.end(), [&](const OccupiedBall& ball) {
    return (x - ball.centre).norm() < reach + ball.radius;
  });
}

}  // namespace

std::vector<Placement> scatter_places(const ScatterSpec& scatter, double bounding_radius,
                                      std::vector<OccupiedBall>& occupied) {
  std::mt19937_64 random(scatter.seed);
  std::vector<Placement> places;
  while (static_cast<int>(places.size()) < scatter.count) {
    Placement place;
    int tries = 0;
    do {
      if (++tries > kTriesPerInstance) {
        throw InputError(
            {{scatter.body.where,
              "only " + std::to_string(places.size()) + " of " + std::to_string(scatter.count) +
                  " instances of " + scatter.body.archetype + " fit without overlap",
              "enlarge the box or lower count (bounding radius " + std::to_string(bounding_radius) +
                  " m, gap " + std::to_string(scatter.gap) + " m)"}});
      }
      place.position = random_point(scatter.box, random);
    } while (!is_free(place.position, bounding_radius + scatter.gap, occupied));
    if (scatter.random_rotation) place.rotation = random_rotation(random);
    occupied.push_back({place.position, bounding_radius});
    places.push_back(place);
  }
  return places;
}

}  // namespace archetide
