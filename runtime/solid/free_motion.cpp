#include "common/base/check.h"
#include "runtime/solid/nodal_space.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {
namespace {

/// dt/2 (trapezoid, either stage), or Eq. 31: the length of the stage (backward Euler).
double implicit_length(double dt, Stage stage, ModalStep step) {
  return step == ModalStep::kTrapezoid || stage == Stage::kPositionHalf ? 0.5 * dt : dt;
}

/// h C + h² K with h the implicit length.
MatX implicit_part(const ReducedBody& body, double dt, Stage stage, ModalStep step) {
  const Archetype& a = *body.archetype;
  const double h = implicit_length(dt, stage, step);
  // Eq. 9: C = α M_r + β K_r
  return (h * a.alpha * body.mass_scale) * a.M_r.topLeftCorner(body.r, body.r) +
         (h * a.beta + h * h) * a.K_r.topLeftCorner(body.r, body.r);
}

/// The same over nodes, with their mass: (1 + h alpha) M + (h beta + h²) K − Dᵀ I⁻¹ D.
std::shared_ptr<NodalMass> nodal_mass(const ReducedBody& body, const ConfigurationTerms& terms,
                                      double h) {
  const Archetype& a = *body.archetype;
  auto mass = std::make_shared<NodalMass>(body.nodes, body.mass_scale * (1.0 + h * a.alpha),
                                          h * a.beta + h * h);
  if (terms.exact_mass) mass->add(terms.D.transpose(), -terms.inertia_inverse);
  return mass;
}

/// Directions in which modes are held get a mass kHeld times the largest. More would cost digits of
/// the others.
void hold(const MatX& locked, GeneralisedMass& H) {
  constexpr double kHeld = 1e6;
  if (locked.size() == 0) return;
  ARCHETIDE_CHECK(!H.nodal);
  const double mass = kHeld * H.M_hat.diagonal().maxCoeff();
  const MatX n = locked.colwise().normalized();
  H.M_hat.noalias() += mass * (n * n.transpose());
  H.M_hat_factor.compute(H.M_hat);
}

/// M_q q̇ⁿ − h K qⁿ + h (g + f_q) of a body of nodes.
VecX nodal_momentum(const ReducedBody& body, const VecX& q_n, const Configuration& at,
                    const VecX& force, double h, const FreeMotion& motion) {
  return modal_momentum(body, motion.terms, body.q_dot) - h * elastic_force(body, q_n) +
         h * (fictitious_force(body, at, motion.terms) + force.tail(body.r));
}

/// f -= (M̂ − M_q) q̇ⁿ.
void take_implicit_part(const ReducedBody& body, const FreeMotion& motion, Eigen::Ref<VecX> f) {
  if (body.nodes)
    f -= motion.H.modal_product(body.q_dot) - modal_momentum(body, motion.terms, body.q_dot);
  else
    f -= (motion.H.M_hat - motion.terms.M_q) * body.q_dot;
}

void take(ModalMotion&& modes, FreeMotion& motion) {
  motion.y_star.tail(modes.q_dot.size()) = modes.q_dot;
  motion.H.M_hat = std::move(modes.M_hat);
  motion.H.M_hat_factor = std::move(modes.M_hat_factor);
  motion.H.nodal = std::move(modes.nodal);
  motion.slope = std::move(modes.slope);
}

/// Mass and fictitious forces of the middle of a step of a nonlinear body.
struct MiddleTerms {
  ConfigurationTerms terms;
  VecX fictitious;
};
MiddleTerms middle_terms(const ReducedBody& body, const VecX& q_dot, double dt, ModalMass mass,
                         FreeMotion& out) {
  out.y_star.tail(body.r) = q_dot;
  ReducedBody moved = body;
  const Configuration middle = advance_pose(moved, out, out.y_star, dt);
  ConfigurationTerms there = configuration_terms(body, middle, mass);
  VecX fictitious = fictitious_force(body, middle, there);
  return {std::move(there), std::move(fictitious)};
}

/// Mass and fictitious forces belong to the middle of the step, which the pass before has found, and
/// the elastic force is linear about the rates of that pass. What pushed the body in the last step
/// is expected again: the solve finds it itself, but from rates that are no longer far off [D74].
void move_nonlinear_half(const ReducedBody& body, const Configuration& at, const VecX& force,
                         double dt, ModalMass mass, FreeMotion& out) {
  constexpr int kPasses = 2;  // with one a bent, spinning bar gains 3 % in 20 periods [D54]
  const LoadStiffness& K = out.load_stiffness;
  if (at.linear_about.size() > 0) {
    const MiddleTerms middle = middle_terms(body, at.linear_about, dt, mass, out);
    out.linear_about = at.linear_about;
    return take(nonlinear_half_step_about(body, at.linear_about, middle.terms,
                                          middle.fictitious + force, dt, K),
                out);
  }
  const VecX push = body.last_push.size() == body.r ? body.last_push : VecX::Zero(body.r),
             load = force + push,
             first = fictitious_force(body, current_configuration(body), out.terms);
  ConfigurationTerms terms = out.terms;
  ModalMotion modes = nonlinear_half_step(body, terms, first + load, dt, K);
  for (int pass = 0; pass < kPasses; ++pass) {
    MiddleTerms middle = middle_terms(body, modes.q_dot, dt, mass, out);
    terms = std::move(middle.terms);
    modes = nonlinear_half_step(body, terms, middle.fictitious + load, dt, K, std::move(modes));
  }
  linearise(body, terms, dt, K, modes);
  out.linear_about = modes.q_dot;
  modes.q_dot -= modes.solve(0.5 * dt * push);
  take(std::move(modes), out);
}

/// free_motion of the modes of a nonlinear body; the rest of `out` is done.
void move_nonlinear(const ReducedBody& body, const Configuration& at, const VecX& force, double dt,
                    Stage stage, ModalMass mass, FreeMotion& out) {
  if (stage == Stage::kPositionHalf) return move_nonlinear_half(body, at, force, dt, mass, out);
  const VecX load = fictitious_force(body, at, out.terms) + force;
  take(nonlinear_full_step(body, at, out.terms, load, dt, out.load_stiffness), out);
}

/// H without modes.
GeneralisedMass rigid_mass(const ReducedBody& body, const ConfigurationTerms& terms) {
  GeneralisedMass H;
  H.answers = !body.prescribed;
  H.mass = terms.mass;
  H.inertia = terms.inertia;
  H.inertia_inverse = terms.inertia_inverse;
  return H;
}

double stage_length(double dt, Stage stage) {
  return stage == Stage::kPositionHalf ? 0.5 * dt : dt;
}

/// Eq. S8e: y* of a body that goes as it is told, which nothing changes.
FreeMotion as_told(const ReducedBody& body, Stage stage, FreeMotion out) {
  const PrescribedMotion& told = *body.prescribed;
  out.H = rigid_mass(body, out.terms);
  out.y_star.resize(6);
  if (stage == Stage::kPositionHalf)
    out.y_star << told.way, told.turn;
  else
    out.y_star << told.velocity, told.spin;
  return out;
}

}  // namespace

int GeneralisedMass::size() const {
  return 6 + (nodal ? nodal->size() : static_cast<int>(M_hat.rows()));
}

VecX GeneralisedMass::modal_product(const VecX& q_dot) const {
  if (nodal) return nodal->product(q_dot);
  return M_hat * q_dot;
}

VecX GeneralisedMass::modal_solve(const VecX& f) const {
  if (nodal) return nodal->solve(f);
  return M_hat_factor.solve(f);
}

VecX GeneralisedMass::apply(const VecX& y) const {
  VecX f(size());
  f << mass * y.head<3>(), inertia * y.segment<3>(3), modal_product(y.tail(size() - 6));
  return f;
}

// Eqs. 10 and 34: H⁻¹ f, H = diag(m 1, I, M̂). With J on both sides it is K_λ of Eq. 43.
VecX GeneralisedMass::solve(const VecX& f) const {
  if (!answers) return VecX::Zero(size());
  VecX y(size());
  y.head<3>() = f.head<3>() / mass;
  y.segment<3>(3) = inertia_inverse * f.segment<3>(3);
  if (nodal) y.tail(nodal->size()) = nodal->solve(f.tail(nodal->size()));
  if (M_hat.rows() > 0) y.tail(M_hat.rows()) = M_hat_factor.solve(f.tail(M_hat.rows()));
  return y;
}

MatX GeneralisedMass::dense() const {
  ARCHETIDE_CHECK(!nodal);
  MatX m = MatX::Zero(size(), size());
  m.topLeftCorner<3, 3>().diagonal().setConstant(mass);
  m.block<3, 3>(3, 3) = inertia;
  m.bottomRightCorner(M_hat.rows(), M_hat.rows()) = M_hat;
  return m;
}

MatX GeneralisedMass::inverse() const {
  ARCHETIDE_CHECK(!nodal);
  MatX m = MatX::Zero(size(), size());
  if (!answers) return m;
  m.topLeftCorner<3, 3>().diagonal().setConstant(1.0 / mass);
  m.block<3, 3>(3, 3) = inertia_inverse;
  const auto r = M_hat.rows();
  if (r > 0) m.bottomRightCorner(r, r) = M_hat_factor.solve(MatX::Identity(r, r));
  return m;
}

// Eq. S5.
GeneralisedMass generalised_mass(const ReducedBody& body, const ConfigurationTerms& terms,
                                 double dt, Stage stage, ModalStep step) {
  GeneralisedMass H = rigid_mass(body, terms);
  if (body.nodes) {
    H.nodal = nodal_mass(body, terms, implicit_length(dt, stage, step));
    return H;
  }
  H.M_hat = body.is_nonlinear() ? nonlinear_modal_mass(body, terms.M_q, dt)
                                : terms.M_q + implicit_part(body, dt, stage, step);
  if (body.r > 0) H.M_hat_factor.compute(H.M_hat);
  return H;
}

FreeMotion free_motion(const ReducedBody& body, const Configuration& at, const VecX& force,
                       double dt, Stage stage, const ModalOptions& options,
                       const LoadStiffness& load_stiffness) {
  const bool nonlinear = body.is_nonlinear();
  FreeMotion out;
  out.terms = configuration_terms(body, at, options.mass);
  if (at.impact_step > 0.0) {
    out.H = generalised_mass(body, out.terms, at.impact_step, stage, options.step);
    out.y_star = generalised_velocity(body, out.terms);
    return out;
  }
  if (body.prescribed) return as_told(body, stage, std::move(out));
  const double h = stage_length(dt, stage);

  // Eqs. 26 and 28: momenta change by the impulse of external forces alone
  VecX momentum(body.dofs());
  momentum.head<3>() = body.P + h * force.head<3>();
  momentum.segment<3>(3) = body.L + h * force.segment<3>(3);

  if (nonlinear) {
    out.load_stiffness = load_stiffness;
    out.H = rigid_mass(body, out.terms);
    out.y_star = VecX::Zero(body.dofs());
    out.y_star.head<3>() = momentum.head<3>() / out.H.mass;
    out.y_star.segment<3>(3) = out.H.inertia_inverse * momentum.segment<3>(3);
    move_nonlinear(body, at, force.tail(body.r), dt, stage, options.mass, out);
    return out;
  }

  out.H = generalised_mass(body, out.terms, dt, stage, options.step);
  // Eqs. 25, 32 and 34: M̂ q̇* = M_q q̇ⁿ − h K qⁿ + h (g + f_q); the trapezoid's full step averages
  // C and K over qⁿ, qⁿ⁺¹
  if (body.r > 0) {
    const VecX q_n = 2.0 * at.q - body.q;
    auto modal = momentum.tail(body.r);
    if (body.nodes) {
      modal = nodal_momentum(body, q_n, at, force, h, out);
    } else {
      const auto K = body.archetype->K_r.topLeftCorner(body.r, body.r);
      modal = out.terms.M_q * body.q_dot - h * (K * q_n) +
              h * (fictitious_force(body, at, out.terms) + force.tail(body.r));
    }
    if (options.step == ModalStep::kTrapezoid && stage == Stage::kVelocityFull)
      take_implicit_part(body, out, modal);
  }
  hold(at.locked, out.H);
  out.y_star = out.H.solve(momentum);
  return out;
}

void set_velocity(const Vec3& v, const Vec3& w, ReducedBody& body) {
  const ConfigurationTerms terms =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  body.P = terms.mass * v;
  body.L = terms.inertia * w;
}

// Eqs. 39 and 40 as momenta.
void accept_velocity(ReducedBody& body, const VecX& y, const Vec3& delta_P, const Vec3& delta_L) {
  if (body.prescribed) return set_velocity(y.head<3>(), y.segment<3>(3), body);
  body.P += delta_P;
  body.L += delta_L;
  body.q_dot = y.tail(body.r);
}

}  // namespace archetide
