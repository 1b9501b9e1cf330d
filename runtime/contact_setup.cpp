#include "runtime/contact_setup.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace archetide {
namespace {

// The surface of a skin, with the weights by which its vertices follow its members.
std::shared_ptr<const CoverShape> shape_of(const SkinnedBodies& skin,
                                           const std::vector<ReducedBody>& bodies) {
  const Skin& whole = *skin.shape->skin;
  std::vector<std::shared_ptr<const Archetype>> parts;
  for (const int b : skin.bodies) parts.push_back(bodies[b].archetype);
  MatX weights(whole.surface.vertices.size(), parts.size());
  for (Eigen::Index v = 0; v < weights.rows(); ++v)
    for (Eigen::Index p = 0; p < weights.cols(); ++p)
      weights(v, p) = whole.weight(static_cast<std::size_t>(v), static_cast<int>(p));
  return cover_shape(whole.surface, weights, parts);
}

// Skins, met instead of the bodies under them; those of one kind share a shape.
std::vector<ContactCover> contact_covers(const std::vector<SkinnedBodies>& skins,
                                         const std::vector<ReducedBody>& bodies) {
  std::map<const BoundSkin*, std::shared_ptr<const CoverShape>> known;
  std::vector<ContactCover> covers;
  for (const SkinnedBodies& skin : skins) {
    std::shared_ptr<const CoverShape>& shape = known[skin.shape.get()];
    if (!shape) shape = shape_of(skin, bodies);
    covers.push_back(
        {skin.bodies, shape, [skin](const std::vector<ReducedBody>& at, std::vector<Vec3>& x) {
           skin_points(
               skin, [&](int b) -> const ReducedBody& { return at[b]; }, x);
         }});
  }
  return covers;
}

// Pairs that do not collide: jointed bodies, and members of one skin.
void keep_apart(const std::vector<Joint>& joints, const std::vector<SkinnedBodies>& skins,
                SearchOptions& search) {
  for (const Joint& joint : joints)
    if (joint.b >= 0) search.apart.insert(std::minmax({joint.a, joint.b}));
  for (const SkinnedBodies& skin : skins)
    for (const int a : skin.bodies)
      for (const int b : skin.bodies)
        if (a < b) search.apart.insert({a, b});
}

// What contact takes for the size of a cell, m; without a tank an eighth of the smallest body.
double contact_cell(const SimulationOptions& o, const std::vector<ReducedBody>& bodies) {
  if (o.grid.cells() > 0) return o.grid.dx;
  double dx = INFINITY;
  for (const ReducedBody& b : bodies) dx = std::min(dx, body_reach(*b.archetype).rest / 8.0);
  return dx;
}

}  // namespace

WallContactOptions wall_options(const SimulationOptions& o, double dt) {
  WallContactOptions w;
  w.low = o.grid.low();
  w.high = o.grid.high();
  for (int s = 0; s < 6; ++s) w.closed[s] = !o.open_side[s];
  w.restitution = o.restitution;
  w.friction = o.friction;
  w.tolerance = 1e-3 * o.grid.dx;
  // What gravity adds in two steps is a body lying on the floor, not one that bounces.
  const double g = o.gravity.norm();
  w.resting_speed = std::max(std::sqrt(2.0 * g * w.tolerance), 2.0 * g * dt);
  w.dt = dt;
  w.modal = o.modal;
  return w;
}

std::unique_ptr<BodyContacts> make_body_contacts(const SimulationOptions& o,
                                                 const std::vector<ReducedBody>& bodies,
                                                 const std::vector<TriMesh>& obstacles,
                                                 const std::vector<Joint>& joints,
                                                 const std::vector<SkinnedBodies>& skins) {
  const bool walls = o.grid.cells() > 0 && o.wall_contact;
  const bool among = o.body_contact && bodies.size() + obstacles.size() >= 2;
  if (bodies.empty() || !(among || (walls && !skins.empty()))) return nullptr;
  Sides closed{};
  for (int s = 0; walls && s < 6; ++s) closed[s] = !o.open_side[s];
  const double dx = contact_cell(o, bodies);
  BodyContactOptions c{o.restitution, o.friction, 1e-3 * dx, o.gravity.norm(), o.modal, {}};
  c.search.each_other = among;
  c.search.covers = contact_covers(skins, bodies);
  keep_apart(joints, skins, c.search);
  const std::vector<TriMesh> met = among ? obstacles : std::vector<TriMesh>();
  c.obstacles = o.obstacles;
  c.obstacles.resize(met.size());
  return std::make_unique<BodyContacts>(
      c, bodies, Surroundings(o.grid.low(), o.grid.high(), closed, met, 0.5 * dx));
}

}  // namespace archetide
