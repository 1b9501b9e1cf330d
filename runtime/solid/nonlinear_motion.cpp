#include "runtime/solid/nonlinear_motion.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "runtime/solid/nodal_space.h"

namespace archetide {
namespace {

// Gauss's rule on the way from 0 to 1.
const double kFar = 0.5 * std::sqrt(0.6);
const double kPoints[] = {0.5 - kFar, 0.5, 0.5 + kFar}, kShares[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};

/// C = α M_r + β K_r at rest, r x r.
MatX damping(const ReducedBody& body) {
  const Archetype& a = *body.archetype;
  return (a.alpha * body.mass_scale) * a.M_r.topLeftCorner(body.r, body.r) +
         a.beta * a.K_r.topLeftCorner(body.r, body.r);
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

/// What a stage of a nonlinear body is made of, of a step that begins with the shape q_n (r).
class Terms {
 public:
  Terms(const ReducedBody& body, const ConfigurationTerms& terms, const LoadStiffness& load,
        const VecX& q_n, double dt)
      : body_(body), terms_(terms), load_(load), q_n_(q_n), dt_(dt) {}
  virtual ~Terms() = default;

  const ReducedBody& body() const { return body_; }
  double dt() const { return dt_; }
  VecX inertia(const VecX& v) const { return modal_momentum(body_, terms_, v); }  // M_q v
  VecX force_at_start() const { return elastic_force(body_, q_n_); }
  /// C v, and dt/2 K_h v, what is implicit of the load beside it.
  virtual VecX damping_force(const VecX& v) const = 0;
  VecX load_damping(const VecX& v) const {
    return load_.empty() ? VecX(VecX::Zero(v.size())) : VecX(0.5 * dt_ * (load_ * v));
  }
  /// F(v) = ∫₀¹ f(q_n + s Δt v) ds.
  virtual VecX mean_force(const VecX& v) const = 0;
  /// f without what moves the body as a whole.
  virtual VecX on_modes(const VecX& f) const = 0;
  /// Into motion: M̂ = M_q + Δt/2 C + Δt²/4 K_h + Δt²/2 dF/d(Δt v), definite; dF/d(Δt v) = ∫₀¹ s K(q_n +
  /// s Δt v) ds by the rule of mean_force(), whose derivative it is.
  virtual void linearise(const VecX& v, ModalMotion& motion) const = 0;
  /// The same of the stiffness K(q_n) that does not change, half of which takes the place of the mean.
  virtual void linearise_at_start(ModalMotion& motion) const = 0;

 protected:
  const ReducedBody& body_;
  const ConfigurationTerms& terms_;
  const LoadStiffness& load_;
  const VecX q_n_;
  const double dt_;
};

class TermsOfModes final : public Terms {
 public:
  TermsOfModes(const ReducedBody& body, const ConfigurationTerms& terms, const LoadStiffness& load,
               const VecX& q_n, double dt)
      : Terms(body, terms, load, q_n, dt), C_(damping(body)) {}

  VecX damping_force(const VecX& v) const override { return C_ * v; }
  VecX mean_force(const VecX& v) const override {
    MatX q(q_n_.size(), 3);
    for (int g = 0; g < 3; ++g) q.col(g) = q_n_ + kPoints[g] * dt_ * v;
    return V().forces(q) * Vec3(kShares[0], kShares[1], kShares[2]);
  }
  VecX on_modes(const VecX& f) const override { return f; }
  void linearise(const VecX& v, ModalMotion& motion) const override {
    MatX mean = MatX::Zero(q_n_.size(), q_n_.size());
    for (int g = 0; g < 3; ++g)
      mean += (kShares[g] * kPoints[g]) * V().stiffness(q_n_ + kPoints[g] * dt_ * v);
    linearise_with(mean, motion);
  }
  void linearise_at_start(ModalMotion& motion) const override {
    linearise_with(0.5 * V().stiffness(q_n_), motion);
  }

 private:
  const ElasticCubature& V() const { return body_.archetype->elastic; }
  void linearise_with(const MatX& mean, ModalMotion& motion) const {
    MatX inert = terms_.M_q + 0.5 * dt_ * C_;
    if (!load_.empty()) inert += 0.25 * dt_ * dt_ * load_.modes;
    motion.M_hat = inert + 0.5 * dt_ * dt_ * mean;
    make_definite(terms_.M_q, motion);
    motion.slope = motion.M_hat - inert;
  }
  MatX C_;
};

class TermsOfNodes final : public Terms {
 public:
  using Terms::Terms;

  VecX damping_force(const VecX& v) const override {
    const Archetype& a = *body_.archetype;
    return space().product(a.alpha * body_.mass_scale, a.beta, v);
  }
  VecX mean_force(const VecX& v) const override {
    VecX f = VecX::Zero(q_n_.size());
    for (int g = 0; g < 3; ++g)
      f += kShares[g] * space().elastic_force(q_n_ + kPoints[g] * dt_ * v);
    return f;
  }
  VecX on_modes(const VecX& f) const override {
    MatX out = f;
    space().take_rigid_force(out);
    return out;
  }
  void linearise(const VecX& v, ModalMotion& motion) const override {
    std::vector<Mat3> elastic(space().blocks(), Mat3::Zero());
    for (int g = 0; g < 3; ++g)
      space().add_stiffness(q_n_ + kPoints[g] * dt_ * v, 0.5 * dt_ * dt_ * kShares[g] * kPoints[g],
                            elastic);
    linearise_with(std::move(elastic), motion);
  }
  void linearise_at_start(ModalMotion& motion) const override {
    std::vector<Mat3> elastic(space().blocks(), Mat3::Zero());
    space().add_stiffness(q_n_, 0.25 * dt_ * dt_, elastic);
    linearise_with(std::move(elastic), motion);
  }

 private:
  const NodalSpace& space() const { return *body_.nodes; }
  void linearise_with(std::vector<Mat3> elastic, ModalMotion& motion) const {
    const Archetype& a = *body_.archetype;
    const double h = 0.5 * dt_;
    auto mass =
        std::make_shared<NodalMass>(body_.nodes, body_.mass_scale * (1.0 + h * a.alpha), h * a.beta,
                                    std::move(elastic), load_.nodes.get(), h * h);
    if (terms_.exact_mass) mass->add(terms_.D.transpose(), -terms_.inertia_inverse);
    motion.nodal = std::move(mass);
  }
};

std::unique_ptr<Terms> terms_of(const ReducedBody& body, const ConfigurationTerms& terms,
                                const LoadStiffness& load, const VecX& q_n, double dt) {
  if (body.nodes) return std::make_unique<TermsOfNodes>(body, terms, load, q_n, dt);
  return std::make_unique<TermsOfModes>(body, terms, load, q_n, dt);
}

/// M_q (v − q̇ⁿ) + Δt/2 (C v + Δt/2 K_h v + F(v) − g − f), to be zero.
VecX residual(const Terms& step, const VecX& load, const VecX& v) {
  return step.on_modes(
      step.inertia(v - step.body().q_dot) +
      0.5 * step.dt() * (step.damping_force(v) + step.load_damping(v) + step.mean_force(v) - load));
}

/// The better of two guesses, with M_hat there: the rates that the body has, and those of a body
/// whose stiffness stays as it is.
VecX first_rates(const Terms& step, const VecX& load, ModalMotion& motion) {
  step.linearise_at_start(motion);
  const VecX& v = step.body().q_dot;
  const VecX linear =
      motion.solve(step.inertia(v) - 0.5 * step.dt() * (step.force_at_start() - load));
  return residual(step, load, linear).norm() < residual(step, load, v).norm() ? linear : v;
}

}  // namespace

VecX ModalMotion::solve(const VecX& f) const {
  return nodal ? VecX(nodal->solve(f)) : VecX(M_hat_factor.solve(f));
}

VecX ModalMotion::slope_product(const VecX& v) const {
  return nodal ? nodal->elastic_product(v) : VecX(slope * v);
}

bool FreeMotion::slope_of_nodes() const { return H.nodal->is_nonlinear(); }

VecX FreeMotion::slope_product(const VecX& q_dot) const {
  return slope.size() > 0 ? VecX(slope * q_dot) : H.nodal->elastic_product(q_dot);
}

ModalMotion nonlinear_half_step(const ReducedBody& body, const ConfigurationTerms& terms,
                                const VecX& load, double dt, const LoadStiffness& load_stiffness,
                                ModalMotion motion) {
  constexpr int kMostTurns = 30, kMostHalvings = 8;
  constexpr double kAccuracy = 1e-9;  // of the momentum of inertia and load
  constexpr double kSlow = 0.2;       // a turn that leaves more needs the stiffness where it stands
  const auto step = terms_of(body, terms, load_stiffness, body.q, dt);
  if (motion.q_dot.size() == 0) motion.q_dot = first_rates(*step, load, motion);
  VecX rest = residual(*step, load, motion.q_dot);
  const double goal =
      kAccuracy * (step->inertia(body.q_dot).norm() + 0.5 * dt * step->on_modes(load).norm() +
                   0.5 * dt * step->force_at_start().norm());
  for (int turn = 0; turn < kMostTurns && rest.norm() > goal; ++turn) {
    const VecX change = motion.solve(rest);
    double share = 1.0;
    VecX v = motion.q_dot - change, trial = residual(*step, load, v);
    for (int k = 0; k < kMostHalvings && !(trial.norm() < rest.norm()); ++k) {
      share *= 0.5;
      v = motion.q_dot - share * change;
      trial = residual(*step, load, v);
    }
    const bool slow = !(trial.norm() <= kSlow * rest.norm());
    if (trial.norm() < rest.norm()) motion.q_dot = v, rest = trial;
    if (slow) step->linearise(motion.q_dot, motion);
  }
  return motion;
}

void linearise(const ReducedBody& body, const ConfigurationTerms& terms, double dt,
               const LoadStiffness& load_stiffness, ModalMotion& motion) {
  terms_of(body, terms, load_stiffness, body.q, dt)->linearise(motion.q_dot, motion);
}

ModalMotion nonlinear_half_step_about(const ReducedBody& body, const VecX& about,
                                      const ConfigurationTerms& terms, const VecX& load, double dt,
                                      const LoadStiffness& load_stiffness) {
  const auto step = terms_of(body, terms, load_stiffness, body.q, dt);
  ModalMotion motion;
  step->linearise(about, motion);
  motion.q_dot = about - motion.solve(residual(*step, load, about));
  return motion;
}

VecX impulse_of_following_load(const ReducedBody& body, const Configuration& middle,
                               const FreeMotion& motion, const VecX& q_dot, double dt) {
  if (motion.load_stiffness.empty()) return {};
  const VecX beyond = body.q_dot + q_dot - 2.0 * middle.rates_of_force();
  return -0.25 * dt * dt * (motion.load_stiffness * beyond);
}

VecX rest_of_linear_force(const ReducedBody& body, const FreeMotion& motion, const VecX& q_dot,
                          double dt) {
  const VecX& about = motion.linear_about;
  const auto step = terms_of(body, motion.terms, motion.load_stiffness, body.q, dt);
  const VecX change = step->mean_force(q_dot) - step->mean_force(about);
  return motion.H.modal_solve(0.5 * dt * change - motion.slope_product(q_dot - about));
}

ModalMotion nonlinear_full_step(const ReducedBody& body, const Configuration& at,
                                const ConfigurationTerms& terms, const VecX& load, double dt,
                                const LoadStiffness& load_stiffness) {
  const VecX& v = at.rates_of_force();
  const auto step = terms_of(body, terms, load_stiffness, 2.0 * at.q - body.q, dt);
  ModalMotion motion;
  step->linearise(v, motion);
  // Ĥ q̇ⁿ⁺¹ = (M_q − Δt/2 C − S) q̇ⁿ − Δt F(v) + 2 S v + Δt (g + f), S = Δt²/2 ∂F + Δt²/4 K_h
  const VecX around = 2.0 * v - body.q_dot;
  motion.q_dot =
      motion.solve(step->inertia(body.q_dot) - 0.5 * dt * step->damping_force(body.q_dot) +
                   motion.slope_product(around) + 0.5 * dt * step->load_damping(around) +
                   dt * (load - step->mean_force(v)));
  return motion;
}

double energy_of_linear_force(const ReducedBody& body, const Configuration& middle,
                              const FreeMotion& motion, const VecX& q_dot, const VecX& q_end,
                              double dt) {
  const VecX q_n = 2.0 * middle.q - body.q, twice_mean = body.q_dot + q_dot,
             v = middle.rates_of_force();
  const auto step = terms_of(body, motion.terms, motion.load_stiffness, q_n, dt);
  const VecX impulse = dt * step->mean_force(v) + motion.slope_product(twice_mean - 2.0 * v);
  return elastic_energy(body, q_end) - elastic_energy(body, q_n) - 0.5 * twice_mean.dot(impulse);
}

MatX nonlinear_modal_mass(const ReducedBody& body, const MatX& M_q, double dt) {
  if (dt == 0.0 || body.r == 0) return M_q;
  return M_q + 0.5 * dt * damping(body) +
         0.25 * dt * dt * without_negative(body.archetype->elastic.stiffness(body.q));
}

}  // namespace archetide
