#include "runtime/scene/place_markers.h"

#include "runtime/scene/random.h"

namespace archetide {
namespace {

bool in_water(const Grid& g, const Array3<double>& phi, const Vec3& x) {
  const bool in_tank =
      (x.array() >= g.low().array()).all() && (x.array() <= g.high().array()).all();
  return in_tank && interpolate(g, phi, x) < 0.0;
}

BoxSpec bounds_of(const MarkersSpec& spec) {
  if (spec.box) return *spec.box;
  const Vec3 reach = Vec3::Constant(spec.ball->radius);
  return {spec.ball->centre - reach, spec.ball->centre + reach};
}

void place(const MarkersSpec& spec, const Grid& g, const Array3<double>& phi,
           std::vector<Vec3>& points) {
  constexpr long kTriesPerPoint = 1000;
  std::mt19937_64 random(spec.seed);
  const BoxSpec box = bounds_of(spec);
  int placed = 0;
  for (long tries = 0; placed < spec.count; ++tries) {
    if (tries > kTriesPerPoint * (placed + 1))
      throw InputError({{spec.where, "there is almost no water where these markers should be",
                         "move the box or the ball into the water"}});
    const Vec3 x = uniform_point(box, random);
    if (spec.ball && (x - spec.ball->centre).norm() > spec.ball->radius) continue;
    if (!in_water(g, phi, x)) continue;
    points.push_back(x);
    ++placed;
  }
}

}  // namespace

std::vector<Vec3> place_markers(const std::vector<MarkersSpec>& specs, const Grid& g,
                                const Array3<double>& phi) {
  std::vector<Vec3> points;
  for (const MarkersSpec& spec : specs) place(spec, g, phi, points);
  return points;
}

}  // namespace archetide
