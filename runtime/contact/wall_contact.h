#pragma once

#include <vector>

#include "runtime/contact/contact_impulses.h"
#include "runtime/contact/contact_rows.h"
#include "runtime/grid/grid.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// The walls of the tank and how bodies meet them.
struct WallContactOptions {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();        // corners of the tank, m
  Sides closed{};                                      // sides that are walls
  double restitution = 0.0;                            // 0 .. 1
  double friction = 0.0;                               // Coulomb's coefficient, 0 .. 2
  ContactMaterial at(const ReducedBody& body) const {  // where the body meets them
    const ContactMaterial wall{restitution, friction};
    return pair_material(wall, body.contact.value_or(wall));
  }
  double tolerance = 0.0;  // m; closer points touch, e.g. 1e-3 dx
  double resting_speed =
      0.0;  // m/s; slower approaches do not bounce, e.g. max(sqrt(2 g tolerance), 2 g dt)
  /// Step that the impulses act over, s: modes respond through M_hat of the velocity stage, so that
  /// stiff modes do not ring. 0: an instantaneous impulse, M_hat = M_q.
  double dt = 0.0;
  ModalOptions modal;
  /// Whether a body beyond a wall is translated out; a jointed one is left to the position stage.
  bool push_out = true;
};

/// At most this many points on one side: eight extremes and the deepest.
inline constexpr int kMaxPointsPerSide = 9;

/// Surface vertices beyond or within the tolerance of a closed side, thinned out on every side to
/// the extreme ones along eight directions in its plane and the deepest. `points` are the deformed
/// surface points.
std::vector<ContactPoint> find_wall_contacts(const std::vector<Vec3>& points,
                                             const WallContactOptions& options);

/// Points of one stage and the separating speeds (m/s) that they must reach at least.
struct StageContacts {
  std::vector<ContactPoint> points;
  VecX target;
};

/// For the position stage: points that y* would carry beyond a wall within dt, found by trial
/// advances of the pose, each holding the points found before. target = -gap / dt lets a point come
/// up to its wall and no farther, so bodies arrive at walls and lie on them without being pushed
/// out.
StageContacts reachable_wall_contacts(const ReducedBody& body, const FreeMotion& half, double dt,
                                      const WallContactOptions& options);

struct WallContactResult {
  Vec3 wall_impulse =
      Vec3::Zero();              // given to the walls, N s; the body's P changed by its opposite
  Vec3 push_out = Vec3::Zero();  // translation that was needed, m
  int contacts = 0;              // points that touched
  std::vector<ContactPoint> resting;  // those that touch after the push-out and are not leaving
  /// For the velocity stage: the points that touch (target 0) and the others of `held` (target -gap
  /// / dt). Without the latter a soft body on the floor never settles, its points take turns
  /// (measured: for ever at about 4 g dt, against 5e-15 m/s with them).
  StageContacts velocity_stage;
};

/// Section 6: contact on positions x^{n+1} and velocities v^n. Impulses at the contact points
/// through the body's own mass stop or reflect the approach, P and L change by exactly their sums;
/// then a body that is beyond a wall by more than a tenth of the tolerance is translated out
/// (half-way where two opposite walls squeeze it), which changes no momentum. `held`: the points of
/// reachable_wall_contacts; they count as contacts while they touch, and the others stay for the
/// velocity stage (options.dt > 0; where bodies bounce, only if gap / dt is below the resting
/// speed).
WallContactResult resolve_wall_contacts(ReducedBody& body, const WallContactOptions& options,
                                        const std::vector<ContactPoint>& held = {});

/// What bounds a body's extent at any q; compute once per archetype.
struct BodyReach {
  double rest = 0.0;  // farthest surface vertex from the centre of mass, m
  VecX modes;         // r: largest |phi_i| on the surface, m per unit q
};
BodyReach body_reach(const Archetype& archetype);
/// No point of the deformed body is farther from its centre of mass, m. O(r^2).
double farthest_point(const ReducedBody& body, const BodyReach& reach);

/// True if no surface point can be within the tolerance plus `margin` (m) of a closed side: O(r),
/// no surface needed. Before reachable_wall_contacts the margin is what the body may move in the
/// step.
bool away_from_walls(const ReducedBody& body, const BodyReach& reach,
                     const WallContactOptions& options, double margin = 0.0);

}  // namespace archetide
