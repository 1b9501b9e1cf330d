#include "runtime/scene/deformation_forecast.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "runtime/scene/fall.h"
#include "runtime/solid/support_response.h"

namespace archetide {
namespace {

/// For each body the heaviest of the others behind the first `alone` ones, kg; 0: there is none.
std::vector<double> heaviest_others(const std::vector<ReducedBody>& bodies, std::size_t alone) {
  std::vector<double> others(bodies.size(), 0.0);
  std::size_t heaviest = alone;
  for (std::size_t b = alone; b < bodies.size(); ++b)
    if (body_mass(bodies[b]) > body_mass(bodies[heaviest])) heaviest = b;
  for (std::size_t b = alone; b < bodies.size(); ++b) {
    if (b == heaviest) continue;
    others[b] = body_mass(bodies[heaviest]);
    others[heaviest] = std::max(others[heaviest], body_mass(bodies[b]));
  }
  return others;
}

void take_impact(double deformation, double speed, FallsOn on, DeformationForecast& worst) {
  if (!(deformation > worst.impact)) return;
  worst.impact = deformation, worst.speed = speed, worst.on = on;
}

/// `other`: mass of a body that it may fall on, kg; 0: none.
void take(const Fall& fall, const SupportResponse& support, double water_density, double other,
          DeformationForecast& worst) {
  worst.weight = std::max(worst.weight, resting_deformation(support, fall.pull));
  const auto impact = [&](double speed, double struck, FallsOn on) {
    take_impact(impact_deformation(support, speed, struck), speed, on, worst);
  };
  impact(fall.into_water, slammed_water(support, water_density), FallsOn::kWater);
  impact(fall.onto_floor, INFINITY, FallsOn::kFloor);
  impact(fall.in_air, other, FallsOn::kBody);
}

/// "24 %", "3.1 %", "0.2 %".
std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, share < 0.0995 ? "%.1f %%" : "%.0f %%", 100.0 * share);
  return text;
}

const char* on_what(FallsOn on) {
  return on == FallsOn::kWater   ? " on the water"
         : on == FallsOn::kFloor ? " on the floor"
                                 : " on another body";
}

std::string in_the_impact(const DeformationForecast& f) {
  char speed[32];
  std::snprintf(speed, sizeof speed, "%.2g m/s", f.speed);
  return std::string("in the impact at ") + speed + on_what(f.on);
}

}  // namespace

std::vector<DeformationForecast> forecast_deformation(const SceneSpec& scene,
                                                      const SimulationOptions& options,
                                                      const std::vector<ReducedBody>& bodies) {
  std::vector<DeformationForecast> kinds;
  std::map<const Archetype*, std::size_t> place;
  const std::size_t alone = options.body_contact ? scene.bodies.size() : bodies.size();
  const std::vector<double> others = heaviest_others(bodies, alone);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const ReducedBody& body = bodies[b];
    if (body.r == 0) continue;
    const Archetype& a = *body.archetype;
    const auto [at, fresh] = place.try_emplace(&a, kinds.size());
    if (fresh) kinds.push_back({.archetype = a.name, .nonlinear = a.nonlinear()});
    const Fall fall = fall_of(scene, options, body);
    take(fall, support_response(body, fall.up), options.water_density, others[b],
         kinds[at->second]);
  }
  return kinds;
}

std::string forecast_text(const DeformationForecast& f) {
  constexpr double kLeast = 5e-4;  // less is none, as it is printed
  const bool weight = f.weight >= kLeast, impact = f.impact >= kLeast;
  if (!weight && !impact) return f.archetype + ": none under its weight or in its first fall";
  std::string text = f.archetype + ": ";
  if (weight) text += percent(f.weight) + " under its weight";
  if (weight && impact) text += ", ";
  if (impact) text += percent(f.impact) + " " + in_the_impact(f);
  return text +
         (f.nonlinear ? " (nonlinear modes)" : " (modes tell to " + percent(kModesTell) + ")");
}

std::string beyond_modes(const DeformationForecast& f) {
  if (f.nonlinear || f.largest() <= kModesTell) return "";
  return "deformation: " + f.archetype + " may deform by up to " + percent(f.largest()) +
         " of its radius " + (f.impact > f.weight ? in_the_impact(f) : "under its weight") +
         ", linear modes tell to " + percent(kModesTell) +
         ": take a stiffer material, a smaller drop, modes = 0 (rigid), or modes.kind = "
         "\"nonlinear\" in its body file";
}

std::string beyond_pressure(const ReducedBody& body, const SimulationOptions& options) {
  constexpr double kNoted = 0.1;  // of the volume, in water at the lowest place of the tank
  // An arm of 16 times its thickness with nonlinear modes whips from 0.15 to 0.37 on.
  constexpr double kWhips = 0.25;
  const Archetype& a = *body.archetype;
  if (body.r == 0 || a.young <= 0.0 || !options.has_water) return "";
  const Vec3 low = options.grid.low(), high = options.grid.high();
  const Vec3 lowest = (options.gravity.array() > 0.0).select(high, low);
  const double pressure =
      options.water_density * options.gravity.dot(lowest - options.reference_point);
  const double bulk = a.young / (3.0 * (1.0 - 2.0 * a.poisson));
  const double pressed = 1.0 - std::exp(-pressure / bulk);
  const bool whips = body.is_nonlinear() && pressure > kWhips * a.young;
  if (pressed <= kNoted && !whips) return "";
  char figures[64];
  std::snprintf(figures, sizeof figures, "%.2g Pa, Young's modulus is %.2g Pa", pressure, a.young);
  return "pressure: the water presses on " + a.name + " with up to " + figures + ": it loses " +
         percent(pressed) + " of its volume and gets as much denser" +
         (whips ? ", and slender parts may whip through still water" : "") +
         "; take a stiffer material, a Poisson's ratio nearer to 0.5, less water above it, or for "
         "bodies as dense as the water no gravity";
}

}  // namespace archetide
