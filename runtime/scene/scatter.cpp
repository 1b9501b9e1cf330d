#include "runtime/scene/scatter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runtime/scene/random.h"

namespace archetide {
namespace {

constexpr int kTriesPerInstance = 2000;

// Uniform over all rotations [Sho92].
Quat random_rotation(std::mt19937_64& random) {
  const double u = uniform(random);
  const double a = 2.0 * std::numbers::pi * uniform(random);
  const double b = 2.0 * std::numbers::pi * uniform(random);
  const double s = std::sqrt(1.0 - u), c = std::sqrt(u);
  return Quat(c * std::cos(b), s * std::sin(a), s * std::cos(a), c * std::sin(b));
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
      place.position = uniform_point(scatter.box, random);
    } while (!is_free(place.position, bounding_radius + scatter.gap, occupied));
    if (scatter.random_rotation) place.rotation = random_rotation(random);
    occupied.push_back({place.position, bounding_radius});
    places.push_back(place);
  }
  return places;
}

}  // namespace archetide
