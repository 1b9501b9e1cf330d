// Coupling: what the water's pressure gives bodies beside p' of the solve.

#include "runtime/coupling/coupling.h"
#include "runtime/coupling/displaced_push.h"
#include "runtime/coupling/hydrostatic_force.h"
#include "runtime/numerics/parallel.h"

namespace archetide {

// Hydrostatic part of the water's pressure on every body.
std::vector<VecX> Coupling::hydrostatic_loads(const std::vector<StageBody>& bodies) const {
  std::vector<VecX> loads(bodies.size());
  const auto read_at = [&](std::size_t b) {
    return bodies[b].read_points.empty() ? &surfaces_[b].points : &bodies[b].read_points;
  };
  for_each_large(bodies.size(), [&](std::size_t b) {
    if (!wet())
      loads[b] = VecX::Zero(bodies[b].body->dofs());
    else if (!skinned_[b])
      loads[b] = hydrostatic_force(options_.grid, surfaces_[b], *read_at(b), system_);
  });
  if (!wet()) return loads;
  for (std::size_t s = 0; s < skins_.size(); ++s) {
    std::vector<const std::vector<Vec3>*> own;
    for (const int b : skins_[s].bodies) own.push_back(read_at(b));
    std::vector<Vec3> read = skin_points_[s];
    move_with_members(skins_[s], surfaces_, own, read);
    const std::vector<VecX> of_members = hydrostatic_forces(
        options_.grid, wet_surface(skins_[s], surfaces_, skin_points_[s]), read, own, system_);
    for (std::size_t m = 0; m < of_members.size(); ++m) loads[skins_[s].bodies[m]] = of_members[m];
  }
  return loads;
}

// Of bodies that deform far the load of a stage follows the shape as it changes [D74].
std::vector<HydrostaticStiffness> Coupling::load_stiffnesses(
    const std::vector<StageBody>& bodies) const {
  std::vector<HydrostaticStiffness> stiffnesses(bodies.size());
  if (!wet()) return stiffnesses;
  for_each_large(bodies.size(), [&](std::size_t b) {
    const ReducedBody& body = *bodies[b].body;
    if (body.is_nonlinear() && !skinned_[b])
      stiffnesses[b] = hydrostatic_stiffness(options_.grid, surfaces_[b], system_);
  });
  return stiffnesses;
}

// Where the water meets bodies and skins in the position stage.
void Coupling::remember_places() {
  half_way_.clear();
  for (const BodySurface& s : surfaces_) half_way_.push_back(s.points);
  skins_half_way_ = skin_points_;
}

// What the bodies owe to the water that they displaced since the position stage.
std::vector<VecX> Coupling::displaced_pushes(const FreeSurface& surface, double dt) const {
  const Grid& g = options_.grid;
  const double density = options_.hydrostatics.density;
  std::vector<VecX> impulses(surfaces_.size());
  for_each_large(surfaces_.size(), [&](std::size_t b) {
    impulses[b] = skinned_[b] ? VecX::Zero(surfaces_[b].body->dofs())
                              : displaced_push(g, wet_surface(surfaces_[b]), half_way_[b], surface,
                                               density, dt)[0];
  });
  for (std::size_t s = 0; s < skins_.size(); ++s) {
    const std::vector<VecX> of_members =
        displaced_push(g, wet_surface(skins_[s], surfaces_, skin_points_[s]), skins_half_way_[s],
                       surface, density, dt);
    for (std::size_t m = 0; m < of_members.size(); ++m)
      impulses[skins_[s].bodies[m]] = of_members[m];
  }
  return impulses;
}

Coupling::Loads Coupling::stage_loads(Stage stage, double dt, const FreeSurface& surface,
                                      const std::vector<StageBody>& bodies) {
  Loads loads{hydrostatic_loads(bodies), {}, load_stiffnesses(bodies)};
  if (!wet() || options_.geometry != Geometry::kCutCell) return loads;
  if (stage == Stage::kPositionHalf) remember_places();
  if (stage == Stage::kVelocityFull && surface.push)
    loads.displaced = displaced_pushes(surface, dt);
  return loads;
}

}  // namespace archetide
