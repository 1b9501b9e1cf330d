#include "runtime/contact/contact_system.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/base/exception_carrier.h"

namespace archetide {
namespace {

/// 3 x (6 + r) of a body at a place that carries the modes `phi` (3 x r, body frame).
MatX place_jacobian(const ContactBody& b, const Vec3& place, const MatX& phi) {
  return arm_jacobian(*b.body, *b.terms, place - b.body->position, phi);
}

MatX response(const ContactBody& b, const MatX& J, int unit) {
  if (unit >= 0)
    return (b.inverse_mass ? *b.inverse_mass : b.nodes->inverse_mass()).middleCols<3>(unit);
  if (b.inverse_mass) return *b.inverse_mass * J.transpose();
  MatX W(J.cols(), 3);
  for (int axis = 0; axis < 3; ++axis) W.col(axis) = b.H->solve(J.row(axis).transpose());
  return W;
}

double tangent_compliance(const Mat3& D) {
  return 0.5 * (D(1, 1) + D(2, 2) + std::hypot(D(1, 1) - D(2, 2), D(1, 2) + D(2, 1)));
}

// J_a and J_b of contact k: the velocity of its sample, less that of the other body where it
// touches.
void add_sample(int k, const BodyContact& c, const ContactBody& a, ContactRows& rows) {
  if (a.nodes) {
    rows.J_a = a.nodes->rows_of(k), rows.unit_a = a.nodes->first_row(k);
  } else {
    const MatX phi =
        c.sample >= 0 ? modes_at_sample(*a.shape, c.sample, a.body->r) : MatX::Zero(3, a.body->r);
    rows.J_a = rows.frame * place_jacobian(a, c.point, phi);
  }
  rows.W_a = response(a, rows.J_a, rows.unit_a);
}
void add_touched(int k, const BodyContact& c, const ContactBody& b, ContactRows& rows) {
  if (b.nodes) {
    rows.J_b = b.nodes->rows_of(k), rows.unit_b = b.nodes->first_row(k);
  } else {
    const MatX phi = c.sample >= 0 ? modes_at_rest_place(*b.shape, c.rest_b, b.body->r)
                                   : MatX::Zero(3, b.body->r);
    rows.J_b = -rows.frame * place_jacobian(b, c.point, phi);
  }
  rows.W_b = response(b, rows.J_b, rows.unit_b);
}

ContactRows contact_rows(int k, const BodyContact& c, const std::vector<ContactBody>& bodies) {
  ContactRows rows;
  rows.a = c.a, rows.b = c.b;
  if (c.material) rows.friction = c.material->friction;
  rows.frame = contact_frame(c.normal);
  add_sample(k, c, bodies[c.a], rows);
  rows.D = rows.J_a * rows.W_a;
  if (c.b >= 0) {
    add_touched(k, c, bodies[c.b], rows);
    rows.D += rows.J_b * rows.W_b;
  }
  rows.rho = tangent_compliance(rows.D);
  return rows;
}

}  // namespace

void add_rows(const std::vector<BodyContact>& contacts, const std::vector<ContactBody>& bodies) {
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const BodyContact& c = contacts[k];
    const Mat3 frame = contact_frame(c.normal);
    const auto add = [&](int b, double sign, bool touched) {
      if (b < 0 || !bodies[b].nodes) return;
      const ContactShape& shape = *bodies[b].shape;
      bodies[b].nodes->add(static_cast<int>(k), sign * frame, c.point - bodies[b].body->position,
                           c.sample < 0 ? VertexShares()
                           : touched    ? shares_at_rest_place(shape, c.rest_b)
                                        : shares_of_sample(shape, c.sample));
    };
    add(c.a, 1.0, false);
    add(c.b, -1.0, true);
  }
}

void add_rows(int k, int a, const ContactPoint& point, const std::vector<ContactBody>& bodies) {
  const ContactBody& b = bodies[a];
  if (!b.nodes) return;
  b.nodes->add(k, contact_frame(point.normal),
               surface_point(*b.body, point.vertex) - b.body->position, {{point.vertex, 1.0}});
}

ContactSystem::ContactSystem(const std::vector<BodyContact>& contacts,
                             const std::vector<ContactBody>& bodies)
    : rows_(contacts.size()) {
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(static) if (contacts.size() > 64)
  for (std::size_t k = 0; k < contacts.size(); ++k)
    carrier.run([&] { rows_[k] = contact_rows(static_cast<int>(k), contacts[k], bodies); });
  carrier.rethrow();
}

void ContactSystem::add(int a, const ContactPoint& point, double friction,
                        const std::vector<ContactBody>& bodies) {
  ContactRows rows;
  rows.friction = friction;
  rows.a = a;
  rows.frame = contact_frame(point.normal);
  const int k = static_cast<int>(rows_.size());
  if (bodies[a].nodes)
    rows.J_a = bodies[a].nodes->rows_of(k), rows.unit_a = bodies[a].nodes->first_row(k);
  else
    rows.J_a = rows.frame * point_jacobian(*bodies[a].body, *bodies[a].terms, point.vertex);
  rows.W_a = response(bodies[a], rows.J_a, rows.unit_a);
  rows.D = rows.J_a * rows.W_a;
  rows.rho = tangent_compliance(rows.D);
  rows_.push_back(std::move(rows));
}

namespace {

// Rows are short: three inner products, where a general product would first look for the best way.
Vec3 velocity_of(const ContactRows::Rows& J, int unit, const VecX& y) {
  if (unit >= 0) return y.segment<3>(unit);
  return {J.row(0).dot(y), J.row(1).dot(y), J.row(2).dot(y)};
}

void add_response(const ContactRows::Columns& W, const Vec3& impulse, VecX& y) {
  y += impulse[0] * W.col(0) + impulse[1] * W.col(1) + impulse[2] * W.col(2);
}

}  // namespace

Vec3 ContactSystem::velocity(std::size_t k, const std::vector<VecX>& y) const {
  const ContactRows& c = rows_[k];
  Vec3 v = velocity_of(c.J_a, c.unit_a, y[c.a]);
  if (c.b >= 0) v += velocity_of(c.J_b, c.unit_b, y[c.b]);
  return v;
}

void ContactSystem::apply(std::size_t k, const Vec3& impulse, std::vector<VecX>& y) const {
  const ContactRows& c = rows_[k];
  add_response(c.W_a, impulse, y[c.a]);
  if (c.b >= 0) add_response(c.W_b, impulse, y[c.b]);
}

void ContactSystem::add_impulse(std::size_t k, const Vec3& impulse, std::vector<VecX>& f) const {
  const ContactRows& c = rows_[k];
  f[c.a] += c.J_a.transpose() * impulse;
  if (c.b >= 0) f[c.b] += c.J_b.transpose() * impulse;
}

// λ_n ← max(0, λ_n − (v_n − target) / D_nn), then λ_t ← λ_t − v_t / ρ cut to the cone. Returns the
// change of speed at the contact (K3).
double ContactSystem::sweep_contact(std::size_t k, double target, double friction, Vec3& lambda,
                                    std::vector<VecX>& y) const {
  const ContactRows& c = rows_[k];
  const Vec3 v = velocity(k, y);
  Vec3 change = Vec3::Zero();
  change[0] = std::max(0.0, lambda[0] + (target - v[0]) / c.D(0, 0)) - lambda[0];
  const double bound = friction * (lambda[0] + change[0]);
  if (bound > 0.0 || lambda.tail<2>() != Eigen::Vector2d::Zero()) {
    const Eigen::Vector2d slip = v.tail<2>() + change[0] * c.D.col(0).tail<2>();
    Eigen::Vector2d next = lambda.tail<2>() - slip / c.rho;
    const double length = next.norm();
    if (length > bound) next *= bound / length;
    change.tail<2>() = next - lambda.tail<2>();
  }
  if (change == Vec3::Zero()) return 0.0;
  lambda += change;
  apply(k, change, y);
  return std::max(c.D(0, 0) * std::abs(change[0]), c.rho * change.tail<2>().norm());
}

ContactSolveReport ContactSystem::solve(const VecX& target, const ContactSolveOptions& options,
                                        std::vector<Vec3>& lambda, std::vector<VecX>& y) const {
  std::vector<std::size_t> all(rows_.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  return solve(target, options, all, lambda, y);
}

ContactSolveReport ContactSystem::solve(const VecX& target, const ContactSolveOptions& options,
                                        const std::vector<std::size_t>& only,
                                        std::vector<Vec3>& lambda, std::vector<VecX>& y) const {
  ContactSolveReport report;
  double speed = 0.0;
  for (const std::size_t k : only)
    speed = std::max({speed, velocity(k, y).cwiseAbs().maxCoeff(), std::abs(target[k])});
  for (const std::size_t k : only)
    if (lambda[k] != Vec3::Zero()) apply(k, lambda[k], y);
  if (tied_) tied_->constrain(y);
  const auto n = static_cast<long>(only.size());
  const long sweeps =
      std::min<long>(options.max_sweeps, std::max(20L, options.max_updates / std::max(n, 1L)));
  for (; report.sweeps < sweeps; ++report.sweeps) {
    report.change = 0.0;
    // up and down: a stack passes its load on in either direction
    const bool up = report.sweeps % 2 == 0;
    for (long i = 0; i < n; ++i) {
      const std::size_t k = only[static_cast<std::size_t>(up ? i : n - 1 - i)];
      report.change = std::max(
          report.change, sweep_contact(k, target[static_cast<long>(k)],
                                       rows_[k].friction.value_or(options.friction), lambda[k], y));
    }
    if (tied_) tied_->constrain(y);
    if (report.change <= std::max(options.tolerance * speed, options.still)) break;
  }
  return report;
}

void ContactSystem::add_momenta(const std::vector<Vec3>& lambda,
                                const std::vector<BodyContact>& contacts,
                                const std::vector<ContactBody>& bodies, std::vector<Vec3>& delta_P,
                                std::vector<Vec3>& delta_L) const {
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Vec3 impulse = rows_[k].frame.transpose() * lambda[k];
    const auto give = [&](int b, const Vec3& f) {
      delta_P[b] += f;
      delta_L[b] += (contacts[k].point - bodies[b].body->position).cross(f);
    };
    give(rows_[k].a, impulse);
    if (rows_[k].b >= 0) give(rows_[k].b, -impulse);
  }
}

}  // namespace archetide
