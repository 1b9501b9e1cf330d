#pragma once

#include <memory>
#include <vector>

#include "common/archetype/skin.h"
#include "runtime/articulation/joint.h"

namespace archetide {

/// What one part gives to a skin; m of the skin's n vertices move with it. Shared by all instances.
struct SkinShare {
  std::vector<int> row;         // n, which of the m the vertex is, or -1
  std::vector<int> vertices;    // m, ascending
  std::vector<double> weights;  // m, > 0
  std::vector<Vec3> rest;       // m, in the part's rest frame, m
  MatX modes;                   // 3 m x r, of the nearest point of the part's rest surface, m
  std::vector<Vec3i> corners;   // m, vertices of the part's surface around that point ..
  std::vector<Vec3> bary;       // m, .. and their weights
};

/// A skin bound to the archetypes of its parts.
struct BoundSkin {
  std::shared_ptr<const Skin> skin;
  std::vector<SkinShare> shares;  // one a part
};
/// `parts`: archetypes cut out of the skin's mesh, in the order of the skin's parts.
std::shared_ptr<const BoundSkin> bind_skin(
    std::shared_ptr<const Skin> skin, const std::vector<std::shared_ptr<const Archetype>>& parts);

/// One skin of a scene: x = sum_b w_b x_b, x_b = t_b + R_b (s_b (X_b + S_b q_b) + d_b) (Section 7,
/// with the scale s_b and the shift d_b of ShapeCorrection).
struct SkinnedBodies {
  std::shared_ptr<const BoundSkin> shape;
  std::vector<int> bodies;                          // of each part
  std::shared_ptr<const BoundSkin> rung = nullptr;  // what the water meets; null: `shape`

  const BoundSkin& wet_shape() const { return rung ? *rung : *shape; }
};

/// Of each of `count` bodies, whether it is under a skin.
std::vector<char> skinned_bodies(std::size_t count, const std::vector<SkinnedBodies>& skins);

/// R_b (s_b (X_b + S_b q_b) + d_b) of the m vertices that a part moves: moment arms about its
/// centre of mass, m.
void skin_arms(const SkinShare& share, const ReducedBody& body, std::vector<Vec3>& arms);

/// Where `shape`, that of the skin or what the water meets, is, n, m. `body_of(b)`: the body of
/// index b.
template <class BodyOf>
void skin_points(const SkinnedBodies& skin, const BoundSkin& shape, const BodyOf& body_of,
                 std::vector<Vec3>& points) {
  points.assign(shape.skin->surface.vertices.size(), Vec3::Zero());
  std::vector<Vec3> arms;
  for (std::size_t p = 0; p < skin.bodies.size(); ++p) {
    const SkinShare& share = shape.shares[p];
    const ReducedBody& body = body_of(skin.bodies[p]);
    skin_arms(share, body, arms);
    for (std::size_t k = 0; k < arms.size(); ++k)
      points[share.vertices[k]] += share.weights[k] * (body.position + arms[k]);
  }
}

/// The same of the skin's own shape.
template <class BodyOf>
void skin_points(const SkinnedBodies& skin, const BodyOf& body_of, std::vector<Vec3>& points) {
  skin_points(skin, *skin.shape, body_of, points);
}

/// Joints of the skin's parts, at these bodies as they stand.
std::vector<Joint> skin_joints(const SkinnedBodies& skin, const std::vector<ReducedBody>& bodies);

/// Puts a body of the skin where it is in the whole, whose mesh origin is at `origin` (m), turned
/// by `rotation`, and moves with `velocity` (m/s, of that origin) and `spin` (world, rad/s).
void place_in_skin(const Vec3& origin, const Quat& rotation, const Vec3& velocity, const Vec3& spin,
                   ReducedBody& body);

}  // namespace archetide
