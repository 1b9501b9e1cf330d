#include "runtime/coupling/stage_constraints.h"

#include <algorithm>

namespace archetide {
namespace {

std::vector<ContactBody> contact_bodies(const std::vector<StageBody>& bodies,
                                        const std::vector<ConfigurationTerms>& terms,
                                        const RowsOfNodes& nodes, const GroupContacts& contacts,
                                        const std::vector<StageResult>& results,
                                        const std::vector<MatX>& wet_inverse) {
  std::vector<ContactBody> out(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b)
    out[b] = {bodies[b].body,
              contacts.shapes.empty() ? nullptr : contacts.shapes[b],
              &terms[b],
              &results[b].motion.H,
              wet_inverse.empty() ? nullptr : &wet_inverse[b],
              nodes[b].get()};
  return out;
}

// Points at walls, where contacts between bodies do not include them.
template <class F>
void for_wall_points(const GroupContacts& contacts, const std::vector<StageResult>& results,
                     F&& f) {
  if (!contacts.shapes.empty()) return;
  for (std::size_t b = 0; b < results.size(); ++b)
    for (const ContactPoint& point : results[b].contacts.points) f(static_cast<int>(b), point);
}

std::vector<const ReducedBody*> reduced(const std::vector<StageBody>& bodies) {
  std::vector<const ReducedBody*> out;
  for (const StageBody& b : bodies) out.push_back(b.body);
  return out;
}

// Rows of the bodies of nodes: of contacts, numbered as in the contact system, then of joints.
RowsOfNodes rows_of_nodes(const std::vector<Joint>& joints, const std::vector<StageBody>& bodies,
                          const std::vector<ConfigurationTerms>& terms,
                          const GroupContacts& contacts, const std::vector<CoupledBody>& coupled,
                          const std::vector<StageResult>& results) {
  RowsOfNodes nodes(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (coupled[b].nodes) nodes[b] = std::make_unique<NodalRows>(*bodies[b].body, terms[b]);
  const std::vector<ContactBody> masses =
      contact_bodies(bodies, terms, nodes, contacts, results, {});
  add_rows(contacts.contacts, masses);
  int item = static_cast<int>(contacts.contacts.size());
  for_wall_points(contacts, results,
                  [&](int b, const ContactPoint& point) { add_rows(item++, b, point, masses); });
  for (const Joint& joint : joints) add_joint(joint, item++, reduced(bodies), nodes);
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (nodes[b]) nodes[b]->set_inverse(coupled[b].nodes->inverse());
  return nodes;
}

// (H + added mass)^-1 at rows: of a body of nodes A - S^T N S, with S the reduced answers.
std::vector<MatX> wet_at_rows(std::vector<MatX> wet, const RowsOfNodes& nodes) {
  for (std::size_t b = 0; b < wet.size(); ++b) {
    if (!nodes[b]) continue;
    const MatX S = nodes[b]->reduced();
    wet[b] = (nodes[b]->inverse_mass() - S.transpose() * wet[b] * S).eval();
  }
  return wet;
}

std::vector<ConfigurationTerms> present_terms(const std::vector<StageBody>& bodies,
                                              ModalMass mass) {
  std::vector<ConfigurationTerms> terms;
  for (const StageBody& b : bodies)
    terms.push_back(configuration_terms(*b.body, current_configuration(*b.body), mass));
  return terms;
}

// What rows have of one body.
std::vector<MatX*> rows_on(std::size_t b, std::vector<RowBlock>& rows) {
  std::vector<MatX*> found;
  for (RowBlock& block : rows) {
    if (block.a == static_cast<int>(b)) found.push_back(&block.A);
    if (block.b == static_cast<int>(b)) found.push_back(&block.B);
  }
  return found;
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
      nodes_(rows_of_nodes(joints, bodies, terms_, contacts, coupled, results)),
      wet_inverse_(wet_at_rows(std::move(wet_inverse), nodes_)),
      system_(contacts.contacts,
              contact_bodies(bodies, terms_, nodes_, contacts, results, wet_inverse_)),
      target_(contacts.target),
      solve_(contacts.solve),
      held_answers_(bodies.size()),
      given_answers_(bodies.size()),
      given_(bodies.size()),
      reaction_(bodies.size()) {
  const std::vector<const ReducedBody*> at = reduced(bodies);
  for (const CoupledBody& body : coupled) bodies_of_nodes_.push_back(body.nodes);
  std::vector<const ConfigurationTerms*> terms;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    terms.push_back(&terms_[b]);
    inverse_mass_.push_back(nodes_[b] ? &nodes_[b]->inverse_mass() : &coupled[b].inverse_mass);
  }
  if (contacts.shapes.empty()) {
    const std::vector<ContactBody> masses =
        contact_bodies(bodies, terms_, nodes_, contacts, results, wet_inverse_);
    solve_.friction = options.walls.friction;
    constexpr double kStill = 1e-6;  // of what gravity adds in a step
    solve_.still = kStill * options.hydrostatics.gravity.norm() * dt;
    for_wall_points(contacts, results, [&](int b, const ContactPoint& point) {
      system_.add(b, point, options.walls.at(*bodies[b].body).friction, masses);
    });
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const StageContacts& walls = results[b].contacts;
      target_.conservativeResize(target_.size() + walls.target.size());
      target_.tail(walls.target.size()) = walls.target;
    }
  }
  int item = static_cast<int>(system_.size());
  for (const Joint& joint : joints)
    joint_rows_.push_back(joint_rows(joint, at, terms, nodes_, item++));
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

std::vector<VecX> StageConstraints::at_rows(const std::vector<VecX>& y) const {
  std::vector<VecX> z = y;
  for (std::size_t b = 0; b < y.size(); ++b)
    if (nodes_[b]) z[b] = nodes_[b]->velocity(y[b]);
  return z;
}

// y of a body of nodes with what it is given, and with impulses f on the rows that are held.
VecX StageConstraints::moved(std::size_t b, const VecX& y, const VecX& f) const {
  VecX out = y;
  if (given_answers_[b].size() > 0) out += given_answers_[b];
  if (f.size() > 0) out += held_answers_[b]->whole * f;
  return out;
}

// Of y at rows, what the rows that are held see of it; and the transpose.
std::vector<VecX> StageConstraints::at_held(std::vector<VecX> y) const {
  for (std::size_t b = 0; b < y.size(); ++b)
    if (nodes_[b]) y[b] = y[b](held_answers_[b]->which).eval();
  return y;
}
std::vector<VecX> StageConstraints::from_held(const std::vector<VecX>& f) const {
  std::vector<VecX> out = f;
  for (std::size_t b = 0; b < f.size(); ++b)
    if (nodes_[b] && f[b].size() > 0) {
      out[b] = VecX::Zero(nodes_[b]->size());
      out[b](held_answers_[b]->which) = f[b];
    }
  return out;
}

// The generalised force that f at rows is.
VecX StageConstraints::on_body(std::size_t b, const VecX& f) const {
  return nodes_[b] && f.size() > 0 ? VecX(nodes_[b]->force(f)) : f;
}

std::vector<VecX> StageConstraints::expected_free(const std::vector<VecX>& y_free) const {
  std::vector<VecX> y = at_rows(y_free), f(y.size());
  for (std::size_t b = 0; b < y.size(); ++b) f[b] = VecX::Zero(y[b].size());
  for (std::size_t k = 0; k < system_.size(); ++k) system_.add_impulse(k, lambda_[k], f);
  for (std::size_t b = 0; b < y.size(); ++b) y[b] += (*inverse_mass_[b] - wet_inverse_[b]) * f[b];
  return y;
}

std::vector<VecX> StageConstraints::free_of_rows(const std::vector<CoupledBody>& coupled) const {
  std::vector<VecX> y;
  for (std::size_t b = 0; b < coupled.size(); ++b) {
    y.push_back(nodes_[b] ? VecX(nodes_[b]->velocity(coupled[b].y)) : coupled[b].y);
    if (reaction_[b].size() > 0) y[b] -= wet_inverse_[b] * reaction_[b];
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
  pressed_.assign(system_.size(), false);
  for (std::size_t k = 0; k < system_.size(); ++k) {
    if (lambda_[k][0] <= 0.0) continue;
    pressed_[k] = true;
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
  held_mass_.resize(nodes_.size());
  std::vector<const MatX*> mass = inverse_mass_;
  for (std::size_t b = 0; b < nodes_.size(); ++b) {
    if (!nodes_[b]) continue;
    find_held_answers(b, rows);
    const std::vector<int>& which = held_answers_[b]->which;
    held_mass_[b] = nodes_[b]->inverse_mass()(which, which);
    mass[b] = &held_mass_[b];
    for (MatX* of_body : rows_on(b, rows)) *of_body = (*of_body)(Eigen::all, which).eval();
    given_answers_[b] = given_[b].size() > 0 ? VecX(nodes_[b]->answer(given_[b])) : VecX();
  }
  held_.setup(mass, std::move(rows));
}

std::vector<VecX> StageConstraints::with_given(std::vector<VecX> out) const {
  for (std::size_t b = 0; b < out.size(); ++b)
    if (given_[b].size() > 0) out[b] += *inverse_mass_[b] * given_[b];
  return out;
}

// What a body of nodes answers to the rows that are held; those that were held before are known.
void StageConstraints::find_held_answers(std::size_t b, std::vector<RowBlock>& rows) {
  VecX used = VecX::Zero(nodes_[b]->size());
  for (const MatX* of_body : rows_on(b, rows))
    used += of_body->cwiseAbs().colwise().sum().transpose();
  auto out = std::make_shared<RowAnswers>();
  for (int k = 0; k < nodes_[b]->size(); ++k)
    if (used[k] > 0.0) out->which.push_back(k);
  out->whole.resize(bodies_of_nodes_[b]->inverse().size(), static_cast<long>(out->which.size()));
  std::vector<int> others, places;
  for (std::size_t k = 0; k < out->which.size(); ++k) {
    const std::vector<int> none, &known = held_answers_[b] ? held_answers_[b]->which : none;
    const auto at = std::lower_bound(known.begin(), known.end(), out->which[k]);
    if (at != known.end() && *at == out->which[k])
      out->whole.col(static_cast<long>(k)) = held_answers_[b]->whole.col(at - known.begin());
    else
      others.push_back(out->which[k]), places.push_back(static_cast<int>(k));
  }
  out->whole(Eigen::all, places) = nodes_[b]->answers(others);
  const NodalBody& body = *bodies_of_nodes_[b];
  if (body.meets_water()) out->in_solve = body.surface().to_solve(out->whole);
  held_answers_[b] = std::move(out);
}

void StageConstraints::start(const std::vector<VecX>& y_star,
                             std::vector<CoupledBody>& coupled) const {
  const std::vector<VecX> y = with_given(at_rows(y_star));
  const std::vector<VecX> f = held_.impulses(held_.multipliers(at_held(y)));
  for (std::size_t b = 0; b < y.size(); ++b) {
    if (nodes_[b]) {
      coupled[b].y_star = moved(b, y_star[b], f[b]);
      coupled[b].nodes = coupled[b].nodes->with_rows(held_answers_[b]);
      continue;
    }
    coupled[b].y_star = y[b];
    if (f[b].size() > 0) coupled[b].y_star += *inverse_mass_[b] * f[b];
  }
}

void StageConstraints::settle(const std::vector<VecX>& y_free, std::vector<CoupledBody>& coupled,
                              std::vector<StageResult>& results) {
  const std::vector<VecX> y = with_given(at_rows(y_free));
  std::vector<VecX> lambda = held_.multipliers(at_held(y));
  const std::vector<VecX> f = held_.impulses(lambda);
  reaction_ = from_held(f);
  for (std::size_t b = 0; b < y.size(); ++b) {
    if (f[b].size() > 0)
      coupled[b].y = nodes_[b] ? moved(b, y_free[b], f[b]) : VecX(y[b] + *inverse_mass_[b] * f[b]);
    add(reaction_, b, given_[b]);
    results[b].reaction = on_body(b, reaction_[b]);
  }
  if (joint_rows_.empty()) return;
  for (std::size_t k = joint_rows_.size(); k < lambda.size(); ++k) lambda[k].setZero();
  const std::vector<VecX> of_joints = from_held(held_.impulses(lambda));
  for (std::size_t b = 0; b < y.size(); ++b) results[b].joint_reaction = on_body(b, of_joints[b]);
}

bool StageConstraints::agrees(const std::vector<CoupledBody>& coupled, double speed) const {
  std::vector<VecX> y(coupled.size());
  for (std::size_t b = 0; b < coupled.size(); ++b) y[b] = coupled[b].y;
  y = at_rows(y);
  for (std::size_t k = 0; k < system_.size(); ++k) {
    const Vec3 found = system_.velocity(k, resolved_), solved = system_.velocity(k, y);
    const double least = std::min(target_[static_cast<long>(k)], found[0]);
    if (least - solved[0] > speed) return false;
    const bool pushes = pressed_[k] || lambda_[k][0] > 0.0;
    if (pushes && (found - solved).norm() > speed) return false;
  }
  return true;
}

}  // namespace archetide
