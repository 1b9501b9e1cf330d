#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include "runtime/contact/solids.h"
#include "runtime/grid/grid.h"

namespace archetide {

/// One point where a surface sample of body `a` touches, or may touch within the step, a solid.
struct BodyContact {
  int a = -1;
  int b = -1;       // the other body, or -1 - s: obstacle or wall s of the surroundings
  int sample = -1;  // of a's shape; -1: two bodies in one another along the line of their centres
  Vec3 point = Vec3::Zero();   // common to both, world, m
  Vec3 normal = Vec3::Zero();  // unit, from b into a
  Vec3 rest_b = Vec3::Zero();  // the place in b's rest shape
  double gap = 0.0;            // m, negative where they overlap
  /// m, how much more than the speed at the point tells is left of the gap after the step, if both
  /// move on as they do: round surfaces that slide or roll turn away from each other.
  double clearance = 0.0;
  std::optional<ContactMaterial> material = std::nullopt;  // of the pair; absent: the scene's
};

/// Impulse over time of one contact in the last step, in space, N: what the next step starts from.
struct ContactForce {
  int a = -1, b = -1, sample = -1;
  Vec3 force = Vec3::Zero();
};
/// Sorted by (a, b, sample).
using ContactForces = std::vector<ContactForce>;
/// Rows n, t1, t2: the unit vector n and two across it.
Mat3 contact_frame(const Vec3& n);

const ContactForce* find_force(const ContactForces& forces, int a, int b, int sample);

/// What bodies can touch besides each other: closed sides of the tank and obstacles.
class Surroundings {
 public:
  Surroundings() = default;
  /// Walls of the box [low, high] on the closed sides; `spacing` of the obstacles' distances, m.
  Surroundings(const Vec3& low, const Vec3& high, const Sides& closed,
               const std::vector<TriMesh>& obstacles, double spacing);
  struct Item {
    std::unique_ptr<TouchedSolid> solid;
    Vec3 low, high;  // where it may be touched
  };
  const std::vector<Item>& items() const { return items_; }

 private:
  std::vector<Item> items_;
};

/// Shapes of the bodies, one per archetype, rung and kind: of modes, of nodes.
class ShapeLibrary {
 public:
  const ContactShape& of(const ReducedBody& body);
  std::size_t bytes() const;

 private:
  std::map<std::tuple<const Archetype*, const SurfaceRung*, bool>,
           std::shared_ptr<const ContactShape>>
      shapes_;
};

/// A cover of a scene.
struct ContactCover {
  std::vector<int> bodies;  // under it
  std::shared_ptr<const CoverShape> shape;
  /// Where its vertices are with the bodies as they stand, world, m.
  std::function<void(const std::vector<ReducedBody>&, std::vector<Vec3>&)> points;
};

struct SearchOptions {
  bool each_other = true;               // false: the surroundings alone
  std::set<std::pair<int, int>> apart;  // pairs (i < j) that are not looked at
  std::vector<ContactCover> covers;
};

/// Contacts whose gap is below the pair's margin, thinned out to the support of every patch
/// where surfaces face each other, and to points that carried load in the last step. In a fixed
/// order.
/// `margin`: one per body, m: what it may move until the contacts are looked for again; `dt`, s:
/// how long that is, for the clearances. `near`: becomes all that is within the margin of nonlinear
/// bodies, without clearances and not thinned out; null: not wanted.
std::vector<BodyContact> find_contacts(const std::vector<ReducedBody>& bodies,
                                       const std::vector<const ContactShape*>& shapes,
                                       const Surroundings& surroundings,
                                       const std::vector<double>& margin,
                                       const ContactForces& before,
                                       const SearchOptions& options = {}, double dt = 0.0,
                                       std::vector<BodyContact>* near = nullptr);
inline constexpr int kMaxContacts = 40;       // of an ordered pair; ..
inline constexpr int kMaxSoftContacts = 160;  // .. of a body that gives way between its contacts

}  // namespace archetide
