#include "runtime/scene/add_forces.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <numbers>

#include "runtime/scene/random.h"
#include "runtime/scene/timed_rows.h"

namespace archetide {
namespace {

std::vector<int> bodies_called(const std::string& name, const SourceLocation& where,
                               const BuiltScene& built) {
  std::vector<int> found;
  for (std::size_t b = 0; b < built.bodies.size(); ++b)
    if (built.body_names[b] == name) found.push_back(static_cast<int>(b));
  if (!found.empty()) return found;
  const std::string near = closest_match(name, built.body_names);
  throw InputError({{where, "no body is called \"" + name + "\"",
                     near.empty() ? "a body is called by its name, or as its archetype"
                                  : "did you mean \"" + near + "\"?"}});
}

// The forces must leave something to deform the body with.
void demand_effect(const ForceSpec& spec, const ActuationPattern& pattern,
                   const ReducedBody& body) {
  constexpr double kNothing = 1e-3;  // of the forces; what is left is the mesh's asymmetry
  constexpr double kUnmoved = 1e-6;  // of the largest displacement of a mode in the point set
  if (pattern.kept <= kNothing) {
    const std::size_t n = pattern.vertices.size();
    throw InputError(
        {{spec.direction_where,
          fmt::format("balancing takes the whole force away: at the {}{} of \"{}\" it is no more "
                      "than a push or a turn of the body",
                      n, n == 1 ? " point" : " points", spec.points),
          "give direction = \"normal\" or \"radial\", more points, or balance = \"body\""}});
  }
  if (body.nodes) return;  // they always give way
  const Archetype& a = *body.archetype;
  const int r = body.r;
  double largest = 0.0;
  for (const int v : pattern.vertices)
    largest = std::max(largest, a.surface_modes.block(3 * v, 0, 3, r).cwiseAbs().maxCoeff());
  if (pattern.modal.head(r).norm() <= kUnmoved * largest)
    throw InputError(
        {{spec.points_where,
          fmt::format("none of the {} modes of archetype {} gives way to these forces", r, a.name),
          "use more modes, another direction or other points"}});
}

std::vector<ExternalLoad::Sample> read_samples(const ExternalSpec& spec) {
  std::vector<ExternalLoad::Sample> samples;
  for (const TimedRow& row :
       read_timed_rows(spec.csv, spec.csv_where, {"fx", "fy", "fz", "tx", "ty", "tz"}))
    samples.push_back({row.t, row.values.head<3>(), row.values.tail<3>()});
  return samples;
}

}  // namespace

const std::vector<int>& point_set_of(const Archetype& a, const std::string& name,
                                     const SourceLocation& where) {
  const auto set = std::find_if(a.point_sets.begin(), a.point_sets.end(),
                                [&](const PointSet& p) { return p.name == name; });
  if (set != a.point_sets.end()) return set->vertices;
  std::vector<std::string> known;
  for (const PointSet& p : a.point_sets) known.push_back(p.name);
  const std::string near = closest_match(name, known);
  throw InputError({{where, "archetype " + a.name + " has no point set \"" + name + "\"",
                     near.empty() ? "name one in its body file ([[points]]) and build it again"
                                  : "did you mean \"" + near + "\"?"}});
}

void add_force(const ForceSpec& spec, BuiltScene& built) {
  std::mt19937_64 random(spec.seed);
  std::map<std::pair<const Archetype*, const NodalSpace*>, std::shared_ptr<const ActuationPattern>>
      patterns;
  for (const int b : bodies_called(spec.body, spec.body_where, built)) {
    const ReducedBody& body = built.bodies[b];
    const Archetype& a = *body.archetype;
    if (body.r == 0)
      throw InputError({{spec.body_where,
                         "\"" + spec.body +
                             "\" is rigid: balanced forces only "
                             "deform, and it has no modes",
                         "give it modes, or remove the force"}});
    auto& pattern = patterns[{&a, body.nodes.get()}];
    if (!pattern) {
      pattern = std::make_shared<const ActuationPattern>(
          actuation_pattern(a, point_set_of(a, spec.points, spec.points_where), spec.direction,
                            spec.balanced, body.nodes.get()));
      demand_effect(spec, *pattern, body);
    }
    const double turn = spec.random_phases ? uniform(random) : 0.0;
    built.actuators.push_back({b, pattern, spec.amplitude, spec.period,
                               spec.phase + 2.0 * std::numbers::pi * turn, spec.start,
                               spec.end.value_or(INFINITY)});
  }
}

void add_external(const ExternalSpec& spec, BuiltScene& built) {
  ExternalLoad load;
  load.samples = spec.csv.empty()
                     ? std::vector<ExternalLoad::Sample>{{0.0, spec.force, spec.torque}}
                     : read_samples(spec);
  load.start = spec.start, load.end = spec.end.value_or(INFINITY);
  for (const int b : bodies_called(spec.body, spec.body_where, built)) {
    for (const PrescribedBody& told : built.prescribed)
      if (told.body == b)
        throw InputError(
            {{spec.body_where, "\"" + spec.body + "\" is an obstacle that goes as its motion tells",
              "remove the load, or the motion"}});
    load.body = b;
    built.loads.push_back(load);
  }
}

}  // namespace archetide
