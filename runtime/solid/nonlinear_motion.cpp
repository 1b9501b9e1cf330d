#include <cmath>

#include <Eigen/Eigenvalues>

#include "runtime/solid/nonlinear_motion.h"

namespace archetide {
namespace {

/// C = α M_r + β K_r at rest, r x r.
MatX damping(const ReducedBody& body) {
  const Archetype& a = *body.archetype;
  return (a.alpha * body.mass_scale) * a.M_r.topLeftCorner(body.r, body.r) +
         a.beta * a.K_r.topLeftCorner(body.r, body.r);
}

/// dt/2 K_h, what is implicit of the load beside C; 0 if it is empty.
MatX load_damping(const ReducedBody& body, double dt, const MatX& load_stiffness) {
  if (load_stiffness.size() == 0) return MatX::Zero(body.r, body.r);
  return 0.5 * dt * load_stiffness;
}

// Gauss's rule on the way from 0 to 1.
const double kFar = 0.5 * std::sqrt(0.6);
const double kPoints[] = {0.5 - kFar, 0.5, 0.5 + kFar}, kShares[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};

/// F(v) = ∫₀¹ f(q_n + s Δt v) ds.
VecX mean_force(const ElasticCubature& V, const VecX& q_n, const VecX& way) {
  MatX q(q_n.size(), 3);
  for (int g = 0; g < 3; ++g) q.col(g) = q_n + kPoints[g] * way;
  return V.forces(q) * Vec3(kShares[0], kShares[1], kShares[2]);
}

/// dF/d(Δt v) = ∫₀¹ s K(q_n + s Δt v) ds by the same rule: the derivative of what mean_force gives.
MatX mean_stiffness(const ElasticCubature& V, const VecX& q_n, const VecX& way) {
  MatX mean = MatX::Zero(q_n.size(), q_n.size());
  for (int g = 0; g < 3; ++g)
    mean += (kShares[g] * kPoints[g]) * V.stiffness(q_n + kPoints[g] * way);
  return mean;
}

/// Factors H; directions in which it is not definite (a body about to buckle, in a long step) get a
/// tenth of the smallest mass.
void make_definite(const MatX& M_q, ModalMotion& motion) {
  const double floor = 0.1 * M_q.diagonal().minCoeff();
  motion.M_hat_factor.compute(motion.M_hat);
  if (motion.M_hat_factor.vectorD().minCoeff() > floor) return;
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(motion.M_hat);
  motion.M_hat = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(floor).asDiagonal() *
                 eigen.eigenvectors().transpose();
  motion.M_hat_factor.compute(motion.M_hat);
}

/// K without the directions in which it pushes on.
MatX without_negative(const MatX& K) {
  if (Eigen::LLT<MatX>(K).info() == Eigen::Success) return K;
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(K);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
         eigen.eigenvectors().transpose();
}

/// M_q (v − q̇ⁿ) + Δt/2 (C v + F(v) − g − f), to be zero.
struct HalfStep {
  const ReducedBody& body;
  const MatX& M_q;
  const MatX C;
  const VecX& load;
  double dt;

  const ElasticCubature& V() const { return body.archetype->elastic; }
  VecX residual(const VecX& v) const {
    return M_q * (v - body.q_dot) + 0.5 * dt * (C * v + mean_force(V(), body.q, dt * v) - load);
  }
  /// The better of two guesses, with M_hat there: the rates that the body has, and those of a body
  /// whose stiffness stays as it is.
  VecX start(ModalMotion& motion) const {
    motion.M_hat = M_q + 0.5 * dt * C + 0.25 * dt * dt * V().stiffness(body.q);
    make_definite(M_q, motion);
    const VecX linear =
        motion.M_hat_factor.solve(M_q * body.q_dot - 0.5 * dt * (V().force(body.q) - load));
    return residual(linear).norm() < residual(body.q_dot).norm() ? linear : body.q_dot;
  }
  void linearise(const VecX& v, ModalMotion& motion) const {
    const MatX inert = M_q + 0.5 * dt * C;
    motion.M_hat = inert + 0.5 * dt * dt * mean_stiffness(V(), body.q, dt * v);
    make_definite(M_q, motion);
    motion.slope = motion.M_hat - inert;
  }
};

}  // namespace

ModalMotion nonlinear_half_step(const ReducedBody& body, const MatX& M_q, const VecX& load,
                                double dt, const MatX& load_stiffness, ModalMotion motion) {
  constexpr int kMostTurns = 30, kMostHalvings = 8;
  constexpr double kAccuracy = 1e-9;  // of the momentum of inertia and load
  constexpr double kSlow = 0.2;       // a turn that leaves more needs the stiffness where it stands
  const HalfStep step{body, M_q, damping(body) + load_damping(body, dt, load_stiffness), load, dt};
  if (motion.q_dot.size() == 0) motion.q_dot = step.start(motion);
  VecX rest = step.residual(motion.q_dot);
  const double goal = kAccuracy * ((M_q * body.q_dot).norm() + 0.5 * dt * load.norm() +
                                   0.5 * dt * step.V().force(body.q).norm());
  for (int turn = 0; turn < kMostTurns && rest.norm() > goal; ++turn) {
    const VecX change = motion.M_hat_factor.solve(rest);
    double share = 1.0;
    VecX v = motion.q_dot - change, trial = step.residual(v);
    for (int k = 0; k < kMostHalvings && !(trial.norm() < rest.norm()); ++k) {
      share *= 0.5;
      v = motion.q_dot - share * change;
      trial = step.residual(v);
    }
    const bool slow = !(trial.norm() <= kSlow * rest.norm());
    if (trial.norm() < rest.norm()) motion.q_dot = v, rest = trial;
    if (slow) step.linearise(motion.q_dot, motion);
  }
  return motion;
}

void linearise(const ReducedBody& body, const MatX& M_q, double dt, const MatX& load_stiffness,
               ModalMotion& motion) {
  const VecX no_load;
  const MatX C = damping(body) + load_damping(body, dt, load_stiffness);
  HalfStep{body, M_q, C, no_load, dt}.linearise(motion.q_dot, motion);
}

ModalMotion nonlinear_half_step_about(const ReducedBody& body, const VecX& about, const MatX& M_q,
                                      const VecX& load, double dt, const MatX& load_stiffness) {
  const MatX C = damping(body) + load_damping(body, dt, load_stiffness);
  const HalfStep step{body, M_q, C, load, dt};
  ModalMotion motion;
  step.linearise(about, motion);
  motion.q_dot = about - motion.M_hat_factor.solve(step.residual(about));
  return motion;
}

VecX impulse_of_following_load(const ReducedBody& body, const Configuration& middle,
                               const FreeMotion& motion, const VecX& q_dot, double dt) {
  if (motion.load_stiffness.size() == 0) return {};
  const VecX beyond = body.q_dot + q_dot - 2.0 * middle.rates_of_force();
  return -0.25 * dt * dt * (motion.load_stiffness * beyond);
}

VecX rest_of_linear_force(const ReducedBody& body, const FreeMotion& motion, const VecX& q_dot,
                          double dt) {
  const ElasticCubature& V = body.archetype->elastic;
  const VecX& about = motion.linear_about;
  const VecX change = mean_force(V, body.q, dt * q_dot) - mean_force(V, body.q, dt * about);
  return motion.H.modal_solve(0.5 * dt * change - motion.slope * (q_dot - about));
}

ModalMotion nonlinear_full_step(const ReducedBody& body, const Configuration& at, const MatX& M_q,
                                const VecX& load, double dt, const MatX& load_stiffness) {
  const VecX q_n = 2.0 * at.q - body.q, v = at.rates_of_force(), way = dt * v;
  const ElasticCubature& V = body.archetype->elastic;
  const MatX C = 0.5 * dt * damping(body);
  ModalMotion motion;
  motion.M_hat = M_q + C + 0.5 * dt * load_damping(body, dt, load_stiffness) +
                 0.5 * dt * dt * mean_stiffness(V, q_n, way);
  make_definite(M_q, motion);
  // Ĥ q̇ⁿ⁺¹ = (M_q − Δt/2 C − S) q̇ⁿ − Δt F(v) + 2 S v + Δt (g + f), S = Δt²/2 ∂F + Δt²/4 K_h
  const MatX S = motion.M_hat - M_q - C;
  motion.q_dot = motion.M_hat_factor.solve((M_q - C - S) * body.q_dot + 2.0 * (S * v) +
                                           dt * (load - mean_force(V, q_n, way)));
  return motion;
}

VecX corrected_modes(const ReducedBody& body, const Configuration& middle, const VecX& q_dot,
                     double dt) {
  if (body.r == 0 || !body.archetype->nonlinear()) return {};
  const VecX q_n = 2.0 * middle.q - body.q;
  return q_n + 0.5 * dt * (body.q_dot + q_dot);
}

double energy_of_linear_force(const ReducedBody& body, const Configuration& middle,
                              const FreeMotion& motion, const VecX& q_dot, const VecX& q_end,
                              double dt) {
  const ElasticCubature& V = body.archetype->elastic;
  const VecX q_n = 2.0 * middle.q - body.q, twice_mean = body.q_dot + q_dot,
             v = middle.rates_of_force();
  const MatX S = motion.H.M_hat - motion.terms.M_q -
                 0.5 * dt * (damping(body) + load_damping(body, dt, motion.load_stiffness));
  const VecX impulse = dt * mean_force(V, q_n, dt * v) + S * (twice_mean - 2.0 * v);
  return V.energy(q_end) - V.energy(q_n) - 0.5 * twice_mean.dot(impulse);
}

MatX nonlinear_modal_mass(const ReducedBody& body, const MatX& M_q, double dt) {
  if (dt == 0.0 || body.r == 0) return M_q;
  return M_q + 0.5 * dt * damping(body) +
         0.25 * dt * dt * without_negative(body.archetype->elastic.stiffness(body.q));
}

}  // namespace archetide
