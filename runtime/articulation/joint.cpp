#include "runtime/articulation/joint.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace archetide {
namespace {

/// Moment arm of an attached point, world, m.
Vec3 arm_of(const ReducedBody& body, const AttachedPoint& point) {
  if (body.nodes) return deformed_arm(body, point.rest, point.moved);
  return deformed_arm(body, point.rest, point.modes);
}

/// Where a point that moves as this one does rests if it is `here` now, m; both in the body frame,
/// without the correction of the shape.
Vec3 rest_of(const ReducedBody& body, const AttachedPoint& point, const Vec3& here) {
  if (body.nodes) return here - displacement_of(body, point.moved);
  return here - point.modes * body.q;
}

MatX jacobian(const ReducedBody& body, const ConfigurationTerms& terms,
              const AttachedPoint& point) {
  return arm_jacobian(body, terms, arm_of(body, point), point.modes);
}

// Of the vertices next to a place, how much of its displacement is theirs.
VertexShares shares_at(const std::vector<Vec3>& x, const Vec3& rest) {
  constexpr std::size_t kNeighbours = 12;
  const std::size_t n = std::min(kNeighbours, x.size());
  std::vector<int> order(x.size());
  std::iota(order.begin(), order.end(), 0);
  const auto nearer = [&](int p, int q) {
    return std::pair((x[p] - rest).squaredNorm(), p) < std::pair((x[q] - rest).squaredNorm(), q);
  };
  std::partial_sort(order.begin(), order.begin() + static_cast<long>(n), order.end(), nearer);

  if ((x[order[0]] - rest).norm() <= 1e-9 * (x[order[n - 1]] - rest).norm())
    return {{order[0], 1.0}};

  // weights W P^T (P W P^T)^+ e_1 with P = (1, (x - rest) / distance) and W = 1 / (d^2 + small)
  const double far = (x[order[n - 1]] - rest).norm(), small = 1e-12 * far * far;
  MatX P(4, static_cast<long>(n));
  VecX W(static_cast<long>(n));
  for (std::size_t k = 0; k < n; ++k) {
    const Vec3 d = x[order[k]] - rest;
    P.col(static_cast<long>(k)) << 1.0, d / far;
    W[static_cast<long>(k)] = 1.0 / (d.squaredNorm() + small);
  }
  W /= W.maxCoeff();
  Eigen::CompleteOrthogonalDecomposition<MatX> fit;
  fit.setThreshold(1e-6);  // vertices of a flat side do not tell what is across it
  fit.compute(P * W.cwiseSqrt().asDiagonal());
  const VecX weights = W.cwiseSqrt().asDiagonal() * fit.solve(VecX(VecX::Unit(4, 0)));
  VertexShares shares;
  for (std::size_t k = 0; k < n; ++k) shares.push_back({order[k], weights[static_cast<long>(k)]});
  return shares;
}

}  // namespace

AttachedPoint attach(const ReducedBody& body, const Vec3& rest) {
  AttachedPoint point{rest, MatX::Zero(3, body.nodes ? 0 : body.r)};
  if (body.r == 0) return point;
  const Archetype& a = *body.archetype;
  VertexShares shares = shares_at(a.surface.vertices, rest);
  if (body.nodes)
    point.moved = std::move(shares);
  else if (shares.size() == 1)
    point.modes = a.surface_modes.block(3L * shares[0].vertex, 0, 3, body.r);
  else
    for (const VertexShare& s : shares)
      point.modes += s.weight * a.surface_modes.block(3L * s.vertex, 0, 3, body.r);
  return point;
}

// rest + phi(rest) q = (R^T (place - t) - d) / s: modes from a few turns of the fixed point (none
// where the body is not deformed), the rest place then exactly.
AttachedPoint attach_at(const ReducedBody& body, const Vec3& place) {
  constexpr int kTurns = 5;
  const auto shape = shape_correction(body, body.q);
  const Vec3 here = (body.rotation.conjugate() * (place - body.position) - shape->shift) / shape->s;
  AttachedPoint point = attach(body, here);
  for (int turn = 0; turn < kTurns && !body.q.isZero(0.0); ++turn)
    point = attach(body, rest_of(body, point, here));
  point.rest = rest_of(body, point, here);
  return point;
}

Vec3 place_of(const ReducedBody& body, const AttachedPoint& point) {
  return body.position + arm_of(body, point);
}

Joint make_joint(const std::vector<ReducedBody>& bodies, int a, int b,
                 const std::vector<Vec3>& rest_a) {
  Joint joint;
  joint.a = a, joint.b = b;
  for (const Vec3& rest : rest_a) {
    joint.at_a.push_back(attach(bodies[a], rest));
    const Vec3 place = place_of(bodies[a], joint.at_a.back());
    if (b < 0)
      joint.at_world.push_back(place);
    else
      joint.at_b.push_back(attach_at(bodies[b], place));
  }
  return joint;
}

VecX joint_gap(const Joint& joint, const std::vector<ReducedBody>& bodies) {
  VecX gap(3 * static_cast<long>(joint.at_a.size()));
  for (std::size_t p = 0; p < joint.at_a.size(); ++p) {
    const Vec3 other = joint.b < 0 ? joint.at_world[p] : place_of(bodies[joint.b], joint.at_b[p]);
    gap.segment<3>(3 * static_cast<long>(p)) = place_of(bodies[joint.a], joint.at_a[p]) - other;
  }
  return gap;
}

double joint_drift(const std::vector<Joint>& joints, const std::vector<ReducedBody>& bodies) {
  double largest = 0.0;
  for (const Joint& joint : joints) {
    const VecX gap = joint_gap(joint, bodies);
    if (!gap.allFinite()) return INFINITY;
    for (long p = 0; p < gap.size(); p += 3) largest = std::max(largest, gap.segment<3>(p).norm());
  }
  return largest;
}

void add_joint(const Joint& joint, int item, const std::vector<const ReducedBody*>& bodies,
               const RowsOfNodes& nodes) {
  const auto add = [&](int b, double sign, const std::vector<AttachedPoint>& points) {
    if (b < 0 || !nodes[b]) return;
    for (const AttachedPoint& p : points)
      nodes[b]->add(item, sign * Mat3::Identity(), arm_of(*bodies[b], p), p.moved);
  };
  add(joint.a, 1.0, joint.at_a);
  add(joint.b, -1.0, joint.at_b);
}

// Eq. 47: J_p y_p − J_c y_c = 0, three rows a point.
RowBlock joint_rows(const Joint& joint, const std::vector<const ReducedBody*>& bodies,
                    const std::vector<const ConfigurationTerms*>& terms, const RowsOfNodes& nodes,
                    int item) {
  const auto m = 3 * static_cast<long>(joint.at_a.size());
  const auto rows_of = [&](int b, double sign, const std::vector<AttachedPoint>& points) {
    if (!nodes.empty() && nodes[b]) return nodes[b]->rows_of(item);
    MatX rows(m, bodies[b]->dofs());
    for (std::size_t p = 0; p < points.size(); ++p)
      rows.middleRows<3>(3 * static_cast<long>(p)) =
          sign * jacobian(*bodies[b], *terms[b], points[p]);
    return rows;
  };
  RowBlock rows{joint.a, joint.b, rows_of(joint.a, 1.0, joint.at_a), MatX(), VecX::Zero(m)};
  if (joint.b >= 0) rows.B = rows_of(joint.b, -1.0, joint.at_b);
  return rows;
}

}  // namespace archetide
