#include "runtime/articulation/skinning.h"

#include <limits>

#include "common/mesh/closest_point.h"

namespace archetide {
namespace {

SkinShare bind(const Skin& skin, int part, const Archetype& archetype) {
  SkinShare share;
  const TriMesh& surface = archetype.surface;
  const ClosestPoint nearest(surface);
  share.row.assign(skin.surface.vertices.size(), -1);
  for (std::size_t v = 0; v < share.row.size(); ++v) {
    const double weight = skin.weight(v, part);
    if (!(weight > 0.0)) continue;
    share.row[v] = static_cast<int>(share.vertices.size());
    share.vertices.push_back(static_cast<int>(v));
    share.weights.push_back(weight);
    const Vec3 x = skin.surface.vertices[v] - archetype.centre;
    share.rest.push_back(x);
    const auto hit = nearest.find(x, std::numeric_limits<double>::infinity());
    share.corners.push_back(surface.triangles[hit.triangle]);
    share.bary.push_back(nearest.weights(hit));
  }
  share.modes.resize(3 * static_cast<long>(share.rest.size()), archetype.r());
  for (std::size_t k = 0; k < share.rest.size(); ++k) {
    auto rows = share.modes.middleRows<3>(3 * static_cast<long>(k));
    rows.setZero();
    for (int c = 0; c < 3; ++c)
      rows += share.bary[k][c] * archetype.surface_modes.middleRows<3>(3L * share.corners[k][c]);
  }
  return share;
}

}  // namespace

std::shared_ptr<const BoundSkin> bind_skin(
    std::shared_ptr<const Skin> skin, const std::vector<std::shared_ptr<const Archetype>>& parts) {
  auto bound = std::make_shared<BoundSkin>();
  for (std::size_t p = 0; p < parts.size(); ++p)
    bound->shares.push_back(bind(*skin, static_cast<int>(p), *parts[p]));
  bound->skin = std::move(skin);
  return bound;
}

std::vector<char> skinned_bodies(std::size_t count, const std::vector<SkinnedBodies>& skins) {
  std::vector<char> skinned(count, 0);
  for (const SkinnedBodies& skin : skins)
    for (const int b : skin.bodies) skinned[b] = 1;
  return skinned;
}

void skin_arms(const SkinShare& share, const ReducedBody& body, std::vector<Vec3>& arms) {
  deformed_places(body, share.rest, share.modes, Vec3::Zero(), arms);
}

std::vector<Joint> skin_joints(const SkinnedBodies& skin, const std::vector<ReducedBody>& bodies) {
  std::vector<Joint> joints;
  for (const SkinJoint& joint : skin.shape->skin->joints) {
    const int a = skin.bodies[joint.a], b = skin.bodies[joint.b];
    std::vector<Vec3> rest;
    for (const Vec3& x : joint.points) rest.push_back(x - bodies[a].archetype->centre);
    joints.push_back(make_joint(bodies, a, b, rest));
  }
  return joints;
}

void place_in_skin(const Vec3& origin, const Quat& rotation, const Vec3& velocity, const Vec3& spin,
                   ReducedBody& body) {
  const Vec3 arm = rotation * body.archetype->centre;
  body.position = origin + arm;
  body.rotation = rotation;
  set_velocity(velocity + spin.cross(arm), spin, body);
}

}  // namespace archetide
