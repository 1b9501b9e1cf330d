#include "runtime/solid/nodal_rows.h"

#include <algorithm>

#include "common/base/check.h"

namespace archetide {

Vec3 displacement_of(const ReducedBody& body, const VertexShares& moved) {
  return displacement_of(body, moved, body.q);
}

Vec3 displacement_of(const ReducedBody& body, const VertexShares& moved, const VecX& u) {
  Vec3 sum = Vec3::Zero();
  for (const VertexShare& m : moved)
    sum += m.weight * u.segment<3>(body.nodes->first_dof(m.vertex));
  return sum;
}

Vec3 deformed_arm(const ReducedBody& body, const Vec3& rest, const VertexShares& moved) {
  const ShapeCorrection shape = shape_correction(body, body.q);
  return body.rotation * (shape.s * (rest + displacement_of(body, moved)) + shape.shift);
}

NodalRows::NodalRows(const ReducedBody& body, const ConfigurationTerms& terms)
    : body_(&body), terms_(&terms), R_(body.rotation.toRotationMatrix()) {
  ARCHETIDE_CHECK(body.nodes != nullptr);
}

void NodalRows::add(int item, const Mat3& frame, const Vec3& arm, VertexShares moved) {
  ARCHETIDE_CHECK(points_.empty() || points_.back().item <= item);
  points_.push_back({item, frame, arm, std::move(moved)});
}

int NodalRows::first_row(int item) const {
  const auto first = std::lower_bound(points_.begin(), points_.end(), item,
                                      [](const Point& p, int wanted) { return p.item < wanted; });
  return 3 * static_cast<int>(first - points_.begin());
}

MatX NodalRows::rows_of(int item) const {
  const int first = first_row(item), count = first_row(item + 1) - first;
  MatX rows = MatX::Zero(count, size());
  rows.middleCols(first, count).setIdentity();
  return rows;
}

// Eq. S3: v + ω × a + B u̇, B u̇ = R (s u̇ + d_rate u̇) + (d ln s · u̇) a − (I⁻¹ D u̇) × a.
MatX NodalRows::velocity(const MatX& y) const {
  const NodalSpace& space = *body_->nodes;
  const ShapeCorrection& shape = terms_->shape;
  const auto u_dot = y.bottomRows(space.size());
  const MatX v = y.topRows<3>() + R_ * (shape.shift_rate * u_dot),
             w = y.middleRows<3>(3) - terms_->spin_of_modes * u_dot,
             swell = shape.slope.transpose() * u_dot;
  MatX z(size(), y.cols());
  for (Eigen::Index k = 0; k < y.cols(); ++k) {
    const Vec3 v_k = v.col(k), w_k = w.col(k);
    for (std::size_t p = 0; p < points_.size(); ++p) {
      const Point& at = points_[p];
      Vec3 own = Vec3::Zero();
      for (const VertexShare& m : at.moved)
        own += m.weight * u_dot.block<3, 1>(space.first_dof(m.vertex), k);
      z.block<3, 1>(3 * static_cast<Eigen::Index>(p), k) =
          at.frame * (v_k + w_k.cross(at.arm) + swell(0, k) * at.arm + shape.s * (R_ * own));
    }
  }
  return z;
}

MatX NodalRows::force(const MatX& g) const {
  const NodalSpace& space = *body_->nodes;
  const ShapeCorrection& shape = terms_->shape;
  MatX f = MatX::Zero(6 + space.size(), g.cols());
  MatX spread(1, g.cols());
  for (Eigen::Index k = 0; k < g.cols(); ++k) {
    Vec3 sum = Vec3::Zero(), torque = Vec3::Zero();
    spread(0, k) = 0.0;
    for (std::size_t p = 0; p < points_.size(); ++p) {
      const Point& at = points_[p];
      const Vec3 in_frame = g.block<3, 1>(3 * static_cast<Eigen::Index>(p), k);
      if (in_frame.isZero(0.0)) continue;
      const Vec3 push = at.frame.transpose() * in_frame;
      sum += push, torque += at.arm.cross(push), spread(0, k) += at.arm.dot(push);
      const Vec3 own = shape.s * (R_.transpose() * push);
      for (const VertexShare& m : at.moved)
        f.block<3, 1>(6 + space.first_dof(m.vertex), k) += m.weight * own;
    }
    f.block<3, 1>(0, k) = sum;
    f.block<3, 1>(3, k) = torque;
  }
  auto nodal = f.bottomRows(space.size());
  nodal.noalias() += shape.shift_rate.transpose() * (R_.transpose() * f.topRows<3>()).eval();
  nodal.noalias() += shape.slope * spread;
  nodal.noalias() -= terms_->spin_of_modes.transpose() * f.middleRows<3>(3);
  return f;
}

// Eq. C17b.
void NodalRows::set_answers(MatX answers) {
  const MatX A = velocity(answers);
  inverse_mass_ = 0.5 * (A + A.transpose());
  answers_ = std::make_shared<const MatX>(std::move(answers));
}

void set_answers(const std::vector<const NodalInverse*>& inverses, const RowsOfNodes& rows) {
  std::vector<const NodalInverse*> used;
  std::vector<NodalRows*> given;
  std::vector<MatX> f;
  for (std::size_t b = 0; b < rows.size(); ++b) {
    if (!rows[b]) continue;
    if (rows[b]->size() == 0)
      rows[b]->set_answers(rows[b]->forces());
    else
      used.push_back(inverses[b]), given.push_back(rows[b].get()), f.push_back(rows[b]->forces());
  }
  NodalInverse::solve(used, f);
  for (std::size_t n = 0; n < given.size(); ++n) given[n]->set_answers(std::move(f[n]));
}

void set_answers(const std::vector<const GeneralisedMass*>& H, const RowsOfNodes& rows) {
  std::vector<std::unique_ptr<NodalInverse>> inverses(rows.size());
  std::vector<const NodalInverse*> all(rows.size(), nullptr);
  for (std::size_t b = 0; b < rows.size(); ++b)
    if (rows[b] && rows[b]->size() > 0) {
      inverses[b] = std::make_unique<NodalInverse>(*H[b]);
      all[b] = inverses[b].get();
    }
  set_answers(all, rows);
}

}  // namespace archetide
