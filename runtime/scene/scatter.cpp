#include "runtime/scene/scatter.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/mesh/mesh_sdf.h"
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

std::string names_of(const ScatterSpec& scatter) {
  std::string names;
  for (const BodySpec& kind : scatter.kinds) names += (names.empty() ? "" : ", ") + kind.archetype;
  return names;
}

bool is_free(const Vec3& x, double reach, const std::vector<OccupiedBall>& occupied) {
  return std::none_of(occupied.begin(), occupied.end(), [&](const OccupiedBall& ball) {
    return (x - ball.centre).norm() < reach + ball.radius;
  });
}

}  // namespace

std::vector<Placement> scatter_places(const ScatterSpec& scatter, const std::vector<double>& radii,
                                      std::size_t first, const TriMesh* within,
                                      std::vector<OccupiedBall>& occupied) {
  constexpr double kInside = 0.5;  // winding number: 1 inside, 0 outside
  std::mt19937_64 random(scatter.seed);
  std::vector<Placement> places;
  const auto fits = [&](const Vec3& x, double radius) {
    return is_free(x, radius + scatter.gap, occupied) &&
           (!within || winding_number(*within, x) > kInside);
  };
  while (static_cast<int>(places.size()) < scatter.count) {
    const std::size_t kind = (first + places.size()) % radii.size();
    const double radius = radii[kind];
    Placement place;
    int tries = 0;
    do {
      if (++tries > kTriesPerInstance) {
        throw InputError(
            {{scatter.kinds[kind].where,
              fmt::format("only {} of {} instances of {} fit without overlap", places.size(),
                          scatter.count, names_of(scatter)),
              fmt::format("enlarge the {} or lower count (bounding radius {:f} m, gap {:f} m)",
                          within ? "mesh" : "box", radius, scatter.gap)}});
      }
      place.position = uniform_point(scatter.box, random);
    } while (!fits(place.position, radius));
    if (scatter.random_rotation) place.rotation = random_rotation(random);
    occupied.push_back({place.position, radius});
    places.push_back(place);
  }
  return places;
}

}  // namespace archetide
