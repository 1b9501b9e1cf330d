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
  const auto shape = shape_correction(body, body.q);
  return body.rotation * (shape->s * (rest + displacement_of(body, moved)) + shape->shift);
}

NodalRows::NodalRows(const ReducedBody& body, const ConfigurationTerms& terms)
    : body_(&body), terms_(&terms) {
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

// Eq. S3: v + ω × a + B u̇, B u̇ = R (s u̇ + d_rate u̇) + (d ln s · u̇) a − (I⁻¹ D u̇) × a; the sums over all
// nodes are seven: R d_rate, d ln s, I⁻¹ D.
RowForces NodalRows::forces_of_points() const {
  const NodalSpace& space = *body_->nodes;
  const ShapeCorrection& shape = terms_->shape;
  const Mat3 R = body_->rotation.toRotationMatrix();
  RowForces f{MatX(6, size()), Eigen::SparseMatrix<double>(space.size(), size()),
              MatX(space.size(), 7), MatX(7, size())};
  f.spread.leftCols<3>() = shape.shift_rate.transpose();
  f.spread.col(3) = shape.slope;
  f.spread.rightCols<3>() = terms_->spin_of_modes.transpose();
  std::vector<Eigen::Triplet<double>> few;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const Point& at = points_[p];
    for (int axis = 0; axis < 3; ++axis) {
      const int row = 3 * static_cast<int>(p) + axis;
      const Vec3 push = at.frame.row(axis), torque = at.arm.cross(push),
                 own = shape.s * (R.transpose() * push);
      f.whole.col(row) << push, torque;
      f.share.col(row) << R.transpose() * push, at.arm.dot(push), -torque;
      for (const VertexShare& m : at.moved)
        for (int k = 0; k < 3; ++k)
          few.emplace_back(space.first_dof(m.vertex) + k, row, m.weight * own[k]);
    }
  }
  f.few.setFromTriplets(few.begin(), few.end());
  return f;
}

// Eq. C17b.
void NodalRows::set_inverse(NodalInverse inverse) {
  forces_ = forces_of_points();
  inverse_mass_ = size() > 0 ? inverse.compliance(forces_) : MatX();
  inverse_ = std::move(inverse);
}

MatX NodalRows::answers(const std::vector<int>& rows) const {
  MatX units = MatX::Zero(size(), static_cast<long>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k) units(rows[k], static_cast<long>(k)) = 1.0;
  return answer(units);
}

MatX NodalRows::reduced() const {
  const int n = inverse_->space().reduced_dofs();
  return velocity(inverse_->solve_reduced(MatX::Identity(n, n))).transpose();
}

void set_inverses(const std::vector<const GeneralisedMass*>& H, const RowsOfNodes& rows) {
  for (std::size_t b = 0; b < rows.size(); ++b)
    if (rows[b]) rows[b]->set_inverse(NodalInverse(*H[b]));
}

}  // namespace archetide
