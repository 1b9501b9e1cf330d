#include "runtime/coupling/stage_constraints.h"

#include <algorithm>

namespace archetide {
namespace {

std::vector<ContactBody> contact_bodies(const std::vector<StageBody>& bodies,
                                        const std::vector<ConfigurationTerms>& terms,
                                        const GroupContacts& contacts,
                                        const std::vector<StageResult>& results,
                                        const std::vector<MatX>& wet_inverse) {
  std::vector<ContactBody> out(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b)
    out[b] = {bodies[b].body, contacts.shapes.empty() ? nullptr : contacts.shapes[b], &terms[b],
              &results[b].motion.H, wet_inverse.empty() ? nullptr : &wet_inverse[b]};
  return out;
}

std::vector<ConfigurationTerms> present_terms(const std::vector<StageBody>& bodies,
                                              ModalMass mass) {
  std::vector<ConfigurationTerms> terms;
  for (const StageBody& b : bodies)
    terms.push_back(configuration_terms(*b.body, current_configuration(*b.body), mass));
  return terms;
}

void add(std::vector<VecX>& sum, std::size_t b, const VecX& f) {
  if (f.size() == 0) return;
  if (sum[b].size() == 0)
    sum[b] = f;
  else
    sum[b] += f;
}

}  // namespace

StageConstraints::StageConstraints(const CouplingOptions& options, double dt,
                                   const std::vector<Joint>& joints,
                                   const std::vector<StageBody>& bodies,
                                   const GroupContacts& contacts,
                                   const std::vector<CoupledBody>& coupled,
                                   const std::vector<StageResult>& results,
                                   std::vector<MatX> wet_inverse)
    : terms_(present_terms(bodies, options.modal.mass)),
      wet_inverse_(std::move(wet_inverse)),
      system_(contacts.contacts, contact_bodies(bodies, terms_, contacts, results, wet_inverse_)),
      target_(contacts.target),
      solve_(contacts.solve),
      given_(bodies.size()) {
  std::vector<const ReducedBody*> at;
  std::vector<const ConfigurationTerms*> terms;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    at.push_back(bodies[b].body);
    terms.push_back(&terms_[b]);
    inverse_mass_.push_back(&coupled[b].inverse_mass);
  }
  if (contacts.shapes.empty()) {
    const std::vector<ContactBody> masses =
        contact_bodies(bodies, terms_, contacts, results, wet_inverse_);
    solve_.friction = options.walls.friction;
    constexpr double kStill = 1e-6;  // of what gravity adds in a step
    solve_.still = kStill * options.hydrostatics.gravity.norm() * dt;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const StageContacts& walls = results[b].contacts;
      for (const ContactPoint& point : walls.points)
        system_.add(static_cast<int>(b), point, options.walls.at(*bodies[b].body).friction, masses);
      target_.conservativeResize(target_.size() + walls.target.size());
      target_.tail(walls.target.size()) = walls.target;
    }
  }
  for (const Joint& joint : joints) joint_rows_.push_back(joint_rows(joint, at, terms));
  std::vector<const MatX*> answer = inverse_mass_;
  for (std::size_t b = 0; b < wet_inverse_.size(); ++b) answer[b] = &wet_inverse_[b];
  joints_.setup(answer, joint_rows_);
  if (!joints_.empty()) system_.tie(&joints_);
  lambda_.assign(system_.size(), Vec3::Zero());
}

void StageConstraints::start_from_last_step(const GroupContacts& contacts, double h) {
  if (!contacts.shapes.empty())
    lambda_ = contact_impulses(contacts.contacts, system_, contacts.start, h);
}

std::vector<VecX> StageConstraints::expected_free(std::vector<VecX> y) const {
  std::vector<VecX> f(y.size());
  for (std::size_t b = 0; b < y.size(); ++b) f[b] = VecX::Zero(y[b].size());
  for (std::size_t k = 0; k < system_.size(); ++k) system_.add_impulse(k, lambda_[k], f);
  for (std::size_t b = 0; b < y.size(); ++b) y[b] += (*inverse_mass_[b] - wet_inverse_[b]) * f[b];
  return y;
}

std::vector<VecX> StageConstraints::free_of_rows(const std::vector<CoupledBody>& coupled,
                                                 const std::vector<StageResult>& results) const {
  std::vector<VecX> y;
  for (std::size_t b = 0; b < coupled.size(); ++b) {
    y.push_back(coupled[b].y);
    if (results[b].reaction.size() > 0) y[b] -= wet_inverse_[b] * results[b].reaction;
  }
  return y;
}

void StageConstraints::resolve(const std::vector<VecX>& y_free) {
  resolved_ = y_free;
  if (system_.size() > 0) sweeps_ += system_.solve(target_, solve_, lambda_, resolved_).sweeps;
}

// What the contact solver has found, which all rows can have at once; where it has come to its end
// that is the target and no slip, and these are taken to the last digit. Held at their targets,
// rows that are nearly dependent, on which the solver had not settled, required any speed: a pile
// of 150 starfish at rest burst with 87 J from nothing.
Vec3 StageConstraints::held_speed(std::size_t k) const {
  const Vec3 wanted(target_[static_cast<long>(k)], 0.0, 0.0),
      found = system_.velocity(k, resolved_);
  // The solver stops when a sweep changes less than `still`; what is left may be some of these.
  constexpr double kStills = 100.0, kMet = 1e-7;  // of the speed, where nothing falls
  const double met = std::max(kStills * solve_.still, kMet * found.norm());
  Vec3 speed = found;
  for (int axis = 0; axis < 3; ++axis)
    if (std::abs(found[axis] - wanted[axis]) <= met) speed[axis] = wanted[axis];
  return speed;
}

void StageConstraints::hold() {
  constexpr double kSticks = 1.0 - 1e-9;  // of Coulomb's bound
  for (VecX& f : given_) f.resize(0);
  std::vector<RowBlock> rows = joint_rows_;
  for (std::size_t k = 0; k < system_.size(); ++k) {
    if (lambda_[k][0] <= 0.0) continue;
    const ContactRows& c = system_.rows()[k];
    const double friction = c.friction.value_or(solve_.friction);
    const bool sticks = lambda_[k].tail<2>().norm() < kSticks * friction * lambda_[k][0];
    const int m = !wet() ? 0 : sticks ? 3 : 1;
    if (m > 0) {
      rows.push_back({c.a, c.b, c.J_a.topRows(m), MatX(), held_speed(k).head(m)});
      if (c.b >= 0) rows.back().B = c.J_b.topRows(m);
    }
    const Vec3 left = m == 3   ? Vec3(Vec3::Zero())
                      : m == 1 ? Vec3(0.0, lambda_[k][1], lambda_[k][2])
                               : lambda_[k];
    if (left == Vec3::Zero()) continue;
    for (const int b : {c.a, c.b})
      if (b >= 0 && given_[b].size() == 0) given_[b] = VecX::Zero(inverse_mass_[b]->rows());
    system_.add_impulse(k, left, given_);
  }
  held_.setup(inverse_mass_, std::move(rows));
}

std::vector<VecX> StageConstraints::with_given(const std::vector<VecX>& y) const {
  std::vector<VecX> out = y;
  for (std::size_t b = 0; b < out.size(); ++b)
    if (given_[b].size() > 0) out[b] += *inverse_mass_[b] * given_[b];
  return out;
}

void StageConstraints::start(const std::vector<VecX>& y_star,
                             std::vector<CoupledBody>& coupled) const {
  std::vector<VecX> y = with_given(y_star);
  const std::vector<VecX> f = held_.impulses(held_.multipliers(y));
  for (std::size_t b = 0; b < y.size(); ++b) {
    coupled[b].y_star = y[b];
    if (f[b].size() > 0) coupled[b].y_star += *inverse_mass_[b] * f[b];
  }
}

void StageConstraints::settle(const std::vector<VecX>& y_free, std::vector<CoupledBody>& coupled,
                              std::vector<StageResult>& results) const {
  const std::vector<VecX> y = with_given(y_free);
  std::vector<VecX> lambda = held_.multipliers(y);
  std::vector<VecX> reaction = held_.impulses(lambda);
  for (std::size_t b = 0; b < y.size(); ++b) {
    if (reaction[b].size() > 0) coupled[b].y = y[b] + *inverse_mass_[b] * reaction[b];
    add(reaction, b, given_[b]);
    results[b].reaction = reaction[b];
  }
  if (joint_rows_.empty()) return;
  for (std::size_t k = joint_rows_.size(); k < lambda.size(); ++k) lambda[k].setZero();
  std::vector<VecX> of_joints = held_.impulses(lambda);
  for (std::size_t b = 0; b < y.size(); ++b) results[b].joint_reaction = of_joints[b];
}

bool StageConstraints::agrees(const std::vector<CoupledBody>& coupled, double speed) const {
  std::vector<VecX> y(coupled.size());
  for (std::size_t b = 0; b < coupled.size(); ++b) y[b] = coupled[b].y;
  for (std::size_t k = 0; k < system_.size(); ++k)
    if ((system_.velocity(k, resolved_) - system_.velocity(k, y)).norm() > speed) return false;
  return true;
}

}  // namespace archetide
