#include "runtime/state.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/overlap.h"
#include "runtime/contact_setup.h"

namespace archetide {
namespace {

CouplingOptions coupling_options(const SimulationOptions& o, const WaterStep& water) {
  CouplingOptions c;
  c.grid = water.grid();
  c.has_water = o.has_water;
  c.open_side = water.open_side();
  c.hydrostatics = {o.water_density, o.gravity, o.reference_point};
  c.geometry = o.geometry;
  c.modal = o.modal;
  c.solve = {o.tolerance, o.max_iterations};
  c.walls = wall_options(o, 0.0);
  return c;
}

// A body does not appear inside another one: contact would fling both away. It waits until the
// place is free, and those behind it in the line wait too. What stands beside those that appear
// with it is the scene's; what has come into the place is as bent as it is, and out of it when no
// more than a part of that is left.
bool place_is_free(const SimulationState& s, std::size_t n) {
  constexpr double kLeft = 0.05;
  if (!s.body_contacts || s.release[n] <= 0.0) return true;
  const double cell = s.has_tank() ? s.options.grid.dx : INFINITY;
  const ReducedBody& next = s.waiting[n];
  const auto in_the_way = [&](const ReducedBody& b) {
    return overlap_depth(b, next) > deepest_start(b, next, cell);
  };
  const auto before = s.waiting.begin() + static_cast<std::ptrdiff_t>(n);  // that appear with it
  if (std::any_of(s.bodies.begin(), s.bodies.end(), in_the_way) ||
      std::any_of(s.waiting.begin(), before, in_the_way))
    return false;
  std::vector<ReducedBody> there = s.bodies;
  there.insert(there.end(), s.waiting.begin(), before + 1);
  return s.body_contacts->depth_of_last(there, s.bodies.size()) <=
         kLeft * deepest_start(next, next, cell);
}

}  // namespace

SimulationState::SimulationState(SimulationOptions o, FluidState initial,
                                 std::vector<ReducedBody> b, std::vector<TriMesh> solids,
                                 std::vector<double> appear, std::vector<Joint> tied,
                                 std::vector<SkinnedBodies> skinned)
    : options(std::move(o)),
      waiting(std::move(b)),
      release(std::move(appear)),
      obstacles(std::move(solids)),
      joints(std::move(tied)),
      skins(std::move(skinned)),
      water(options, std::move(initial)),
      coupling(coupling_options(options, water), obstacles, joints, skins) {
  release.resize(waiting.size(), 0.0);
  body_contacts = make_body_contacts(options, waiting, obstacles, joints, skins);
  admit_bodies(*this);
}

void prepare(SimulationState& s) {
  if (!s.water.present()) return;
  update_geometry(s, s.bodies);
  s.water.prepare(s.coupling);
  s.water.place_markers(s.obstacles, s.bodies);
}

void admit_bodies(SimulationState& s) {
  constexpr double kSameTime = 1e-9;  // s
  const auto due = std::upper_bound(s.release.begin(), s.release.end(), s.time() + kSameTime);
  const auto most = static_cast<std::size_t>(due - s.release.begin());
  std::size_t n = 0;
  while (n < most && place_is_free(s, n)) {
    const ReducedBody& body = s.waiting[n++];
    s.budget.add_appearing_energy(kinetic_energy(body) + elastic_energy(body) -
                                  body_mass(body) * s.options.gravity.dot(body.position));
  }
  s.late = static_cast<int>(most - n);
  if (n > 0) admit(s, n);
}

void admit(SimulationState& s, std::size_t n) {
  const auto count = static_cast<std::ptrdiff_t>(n);
  s.bodies.insert(s.bodies.end(), s.waiting.begin(), s.waiting.begin() + count);
  s.waiting.erase(s.waiting.begin(), s.waiting.begin() + count);
  s.release.erase(s.release.begin(), s.release.begin() + count);
  for (std::size_t b = s.reach.size(); b < s.bodies.size(); ++b)
    s.reach.push_back(body_reach(*s.bodies[b].archetype));
  s.water_impulse.resize(s.bodies.size(), Vec3::Zero());
  s.water_angular_impulse.resize(s.bodies.size(), Vec3::Zero());
}

void fit_tank(SimulationState& s) {
  if (!s.water.fit_ceiling()) return;
  s.coupling.set_tank(s.water.grid(), s.water.open_side());
  update_geometry(s);
}

void update_geometry(SimulationState& s) {
  const bool single = s.options.scheme == Scheme::kSingle && !s.last_solved.empty();
  update_geometry(s, single ? s.last_solved : s.bodies);
}

void update_geometry(SimulationState& s, const std::vector<ReducedBody>& at) {
  std::vector<StageBody> stage;
  for (const ReducedBody& b : at) stage.push_back({&b, current_configuration(b), {}, false, {}});
  s.coupling.update_geometry(stage);
}

}  // namespace archetide
