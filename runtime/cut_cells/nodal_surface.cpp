#include "runtime/cut_cells/nodal_surface.h"

namespace archetide {

NodalSurface::NodalSurface(const ReducedBody& body, const ConfigurationTerms& terms,
                           const std::vector<Vec3>& points)
    : space_(body.nodes),
      R_(body.rotation.toRotationMatrix()),
      shape_(terms.shape),
      spin_(terms.spin_of_modes) {
  for (const Vec3& x : points) arms_.emplace_back(x - body.position);
  const Eigen::Index r = reduced_dofs() - 6;
  MatX unit = MatX::Zero(6 + space_->size(), 6 + r);
  unit.topLeftCorner<6, 6>().setIdentity();
  if (r > 0) unit.bottomRightCorner(space_->size(), r) = space_->modes();
  reduced_jacobian_ = velocity(unit);
  spin_of_modes_ = MatX::Zero(3, r);
  if (r > 0) spin_of_modes_ = spin_ * space_->modes();
}

// v + ω × a + B u̇, B u̇ = R (s u̇ + d_rate u̇) + (d ln s · u̇) a − (I⁻¹ D u̇) × a.
MatX NodalSurface::velocity(const MatX& y) const {
  MatX out(3L * vertices(), y.cols());
  const auto u_dot = y.bottomRows(space_->size());
  const MatX v = y.topRows<3>() + R_ * (shape_.shift_rate * u_dot),
             w = y.middleRows<3>(3) - spin_ * u_dot, swell = shape_.slope.transpose() * u_dot;
  const Mat3 sR = shape_.s * R_;
  for (Eigen::Index k = 0; k < y.cols(); ++k) {
    const Vec3 v_k = v.col(k), w_k = w.col(k);
    for (int n = 0; n < vertices(); ++n)
      out.block<3, 1>(3L * n, k) = v_k + w_k.cross(arms_[n]) + swell(0, k) * arms_[n] +
                                   sR * u_dot.block<3, 1>(space_->first_dof(n), k);
  }
  return out;
}

MatX NodalSurface::force(const MatX& g) const {
  MatX f = MatX::Zero(6 + space_->size(), g.cols());
  const Mat3 sR = shape_.s * R_.transpose();
  for (Eigen::Index k = 0; k < g.cols(); ++k) {
    Vec3 sum = Vec3::Zero(), torque = Vec3::Zero();
    double spread = 0.0;
    for (int n = 0; n < vertices(); ++n) {
      const Vec3 g_n = g.block<3, 1>(3L * n, k);
      sum += g_n, torque += arms_[n].cross(g_n), spread += arms_[n].dot(g_n);
      f.block<3, 1>(6 + space_->first_dof(n), k) += sR * g_n;
    }
    f.block<3, 1>(0, k) = sum;
    f.block<3, 1>(3, k) = torque;
    const Vec3 sum_body = R_.transpose() * sum;
    f.col(k).tail(space_->size()).noalias() += shape_.shift_rate.transpose() * sum_body;
    f.col(k).tail(space_->size()) += spread * shape_.slope;
    f.col(k).tail(space_->size()).noalias() -= spin_.transpose() * torque;
  }
  return f;
}

MatX NodalSurface::to_solve(const MatX& y) const {
  MatX out(rows(), y.cols());
  out.topRows(reduced_dofs()) = space_->reduced_velocity(y);
  MatX rest = MatX::Zero(y.rows(), y.cols());
  rest.bottomRows(space_->size()) = y.bottomRows(space_->size());
  const Eigen::Index r = reduced_dofs() - 6;
  if (r > 0) rest.bottomRows(space_->size()).noalias() -= space_->modes() * out.middleRows(6, r);
  out.bottomRows(3L * vertices()) = velocity(rest);
  return out;
}

MatX NodalSurface::to_body(const MatX& f) const {
  MatX out = force(f.bottomRows(3L * vertices()));
  const Eigen::Index r = reduced_dofs() - 6;
  out.topRows<6>() = f.topRows<6>();
  if (r > 0)
    out.bottomRows(space_->size()).noalias() +=
        space_->mode_moments() *
        (f.middleRows(6, r) - space_->modes().transpose() * out.bottomRows(space_->size()));
  return out;
}

}  // namespace archetide
