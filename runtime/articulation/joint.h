#pragma once

#include <vector>

#include "runtime/solid/constrained_inverse.h"
#include "runtime/solid/nodal_rows.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// A material point of a body, not only of its surface.
struct AttachedPoint {
  Vec3 rest = Vec3::Zero();  // in the rest frame, m
  MatX modes;               // 3 x r, its displacement per unit q, body frame, m; of a body of nodes
  VertexShares moved = {};  // instead: the vertices that it moves with
};

/// The point of `body` that is at `rest` in its rest frame. Its modes are those of the surface,
/// interpolated from the nearest vertices (moving least squares, exact for linear fields).
AttachedPoint attach(const ReducedBody& body, const Vec3& rest);
/// The same of the point that is at `place` in space now.
AttachedPoint attach_at(const ReducedBody& body, const Vec3& place);

/// Where an attached point is, m.
Vec3 place_of(const ReducedBody& body, const AttachedPoint& point);

/// Points of two bodies, or of a body and the world, that stay together (Section 7): one point is a
/// ball joint, two a hinge, three a weld.
struct Joint {
  int a = -1;                             // index of a body
  int b = -1;                             // another one, or -1: the world
  std::vector<AttachedPoint> at_a, at_b;  // one each per point; at_b empty for the world
  std::vector<Vec3> at_world;             // where the points are held, m; for the world
};

/// A joint of bodies as they stand now, at these places of a's rest frame.
Joint make_joint(const std::vector<ReducedBody>& bodies, int a, int b,
                 const std::vector<Vec3>& rest_a);

/// Gaps x_a - x_b of all points, 3 entries each, m.
VecX joint_gap(const Joint& joint, const std::vector<ReducedBody>& bodies);
/// Largest distance of two points that should be one, m; infinite when it is no number.
double joint_drift(const std::vector<Joint>& joints, const std::vector<ReducedBody>& bodies);

/// Rows J_a y_a - J_b y_b = 0 of Eq. 47 at the bodies' present configuration, three a point.
/// `terms` of every body that has a joint. `nodes`: the rows of the bodies of nodes, in whose
/// coordinates the joint, their `item`, is written; empty: there are none.
RowBlock joint_rows(const Joint& joint, const std::vector<const ReducedBody*>& bodies,
                    const std::vector<const ConfigurationTerms*>& terms,
                    const RowsOfNodes& nodes = {}, int item = 0);
/// Before that, the points of the joint are added to them.
void add_joint(const Joint& joint, int item, const std::vector<const ReducedBody*>& bodies,
               const RowsOfNodes& nodes);

}  // namespace archetide
