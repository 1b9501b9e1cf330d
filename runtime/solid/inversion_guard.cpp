#include "runtime/solid/inversion_guard.h"

#include <algorithm>
#include <cmath>

namespace archetide {
namespace {

/// The energy of a nonlinear body resists being turned inside out by itself. Bodies of nodes are
/// not bounded: the limit is one of modes.
bool bounded(const ReducedBody& body) {
  return body.r > 0 && !body.nodes && !body.archetype->nonlinear();
}

/// The force at the middle of a step that takes the modal rates to q_dot, M (q̇ − q̇ⁿ) / (dt/2).
VecX force_on_modes(const ReducedBody& body, const FreeMotion& stage, double dt,
                    const VecX& q_dot) {
  return stage.terms.M_q * (q_dot - body.q_dot) / (0.5 * dt);
}

}  // namespace

void InversionGuard::start_step(const std::vector<ReducedBody>& bodies) {
  held_.clear();
  for (const ReducedBody& body : bodies) {
    if (!bounded(body)) continue;
    std::unique_ptr<InversionLimit>& made = limits_[body.archetype];
    if (!made) made = std::make_unique<InversionLimit>(*body.archetype);
  }
}

// Of the body's archetype, for all its instances.
const InversionLimit& InversionGuard::limit(const ReducedBody& body) const {
  return *limits_.at(body.archetype);
}

double InversionGuard::allowed_share(const ReducedBody& body, double dt, const VecX& y) const {
  return bounded(body) ? limit(body).allowed_share(body.q + dt * y.tail(body.r)) : 1.0;
}

bool InversionGuard::beyond(const ReducedBody& body, double dt, const VecX& y) const {
  return allowed_share(body, dt, y) < 1.0;
}

MatX InversionGuard::closing(const ReducedBody& body, const FreeMotion& stage, const VecX& y,
                             double dt, bool pressed) const {
  constexpr double kLittle = 0.9;  // of the way of a body that others press on is cut off no more
  const double share = allowed_share(body, dt, y);
  if (share == 1.0) return {};
  if (pressed && share < kLittle) return MatX::Identity(body.r, body.r);
  VecX q_dot = y.tail(body.r);
  return limit(body).stop_closing(body.q, stage.terms.M_q, q_dot);
}

double InversionGuard::shorten(const ReducedBody& body, double dt, VecX& y) const {
  const double share = allowed_share(body, dt, y);
  if (share < 1.0) y.tail(body.r) = (share * (body.q + dt * y.tail(body.r)) - body.q) / dt;
  return share;
}

bool InversionGuard::stop(int b, const ReducedBody& body, const FreeMotion& stage, double dt,
                          VecX& y) {
  const VecX q_dot = y.tail(body.r), q = body.q + dt * q_dot;
  const double share = shorten(body, dt, y);
  if (share == 1.0) return false;
  // on the way from s q to q
  const VecX force = force_on_modes(body, stage, dt, q_dot);
  held_[b] = {std::max(0.0, (1.0 - share) * force.dot(q)), q_dot};
  return true;
}

void InversionGuard::halt(int b, const ReducedBody& body, const FreeMotion& stage, double dt,
                          VecX& y) {
  Held& held = held_.at(b);
  const VecX force = force_on_modes(body, stage, dt, held.q_dot);
  held.excess = std::max(held.excess, dt * force.dot(held.q_dot));
  y.tail(body.r).setZero();
}

Configuration InversionGuard::advance(int b, ReducedBody& body, const FreeMotion& stage,
                                      const VecX& y, double dt, const MatX& locked) {
  if (locked.size() > 0) held_.try_emplace(b);
  Configuration middle = advance_pose(body, stage, y, dt);
  if (!holds(b)) return middle;
  VecX q_dot = held_[b].q_dot;
  middle.locked =
      locked.size() > 0 ? locked : limit(body).stop_closing(body.q, stage.terms.M_q, q_dot);
  return middle;
}

void InversionGuard::stop_held(std::vector<ReducedBody>& bodies, ModalMass mass) const {
  for (const auto& [b, how] : held_) {
    ReducedBody& body = bodies[b];
    const ConfigurationTerms terms = configuration_terms(body, current_configuration(body), mass);
    limits_.at(body.archetype)->stop_closing(body.q, terms.M_q, body.q_dot);
    const double energy = 0.5 * body.q_dot.dot(terms.M_q * body.q_dot);
    if (how.excess > 0.0) body.q_dot *= std::sqrt(std::max(0.0, 1.0 - how.excess / energy));
  }
}

std::vector<int> InversionGuard::held() const {
  std::vector<int> bodies;
  for (const auto& [b, how] : held_) bodies.push_back(b);
  return bodies;
}

}  // namespace archetide
