#include "common/base/check.h"
#include "runtime/solid/nodal_space.h"
#include "runtime/solid/nodal_terms.h"
#include "runtime/solid/reduced_body.h"
#include "runtime/solid/rotation.h"

namespace archetide {

Configuration current_configuration(const ReducedBody& body) {
  return {body.rotation, body.q, body.q_dot, Vec3::Zero()};
}

Moments deformed_moments(const ReducedBody& body, const VecX& q) {
  if (body.nodes) return nodal_moments(body, q);
  const MomentumIntegrals& rest = body.archetype->integrals;
  const int stride = body.archetype->r();
  Moments out{rest.Sxx, std::vector<Mat3>(body.r)};
  for (int i = 0; i < body.r; ++i) {
    // C_i = Σ m y φ_iᵀ = A_i + Σ_j q_j B_ijᵀ
    Mat3 transposed = rest.A[i].transpose();
    const Mat3* B_i = rest.B.data() + static_cast<std::size_t>(i) * stride;
    for (int j = 0; j < body.r; ++j) transposed += q[j] * B_i[j];
    out.C[i] = transposed.transpose();
    // Σ m y yᵀ = Σ m x xᵀ + Σ m (S q) xᵀ + Σ m y (S q)ᵀ
    out.Syy += q[i] * (rest.A[i].transpose() + out.C[i]);
  }
  for (Mat3& C : out.C) C *= body.mass_scale;
  out.Syy *= body.mass_scale;
  return out;
}

Vec3 angular_momentum_of_modes(const ReducedBody& body, const Moments& moments, const VecX& q_dot) {
  if (body.nodes) return nodal_angular_momentum(*body.nodes, moments.nodal, q_dot);
  Vec3 L = Vec3::Zero();
  for (std::size_t i = 0; i < moments.C.size(); ++i)
    L += q_dot[static_cast<Eigen::Index>(i)] * axial(moments.C[i]);
  return L;
}

ConfigurationTerms configuration_terms(const ReducedBody& body, const Configuration& c,
                                       ModalMass mass) {
  ARCHETIDE_CHECK_OP(c.q.size(), ==, body.r);
  ConfigurationTerms t;
  t.moments = deformed_moments(body, c.q);
  t.mass = body_mass(body);

  // I(q) = tr(Syy) 1 − Syy, turned to the world
  const Mat3 R = c.rotation.toRotationMatrix();
  const Mat3& Syy = t.moments.Syy;
  const Mat3 inertia_body = Syy.trace() * Mat3::Identity() - Syy;
  t.inertia = R * inertia_body * R.transpose();
  t.inertia_inverse = R * inertia_body.inverse() * R.transpose();

  // D_i = Σ m y × φ_i, and the spin that it makes
  t.D.resize(3, body.r);
  if (body.nodes)
    t.D = nodal_levers(*body.nodes, R, t.moments.nodal);
  else
    for (int i = 0; i < body.r; ++i) t.D.col(i) = R * axial(t.moments.C[i]);
  t.spin_of_modes = t.inertia_inverse * t.D;

  t.exact_mass = mass == ModalMass::kExact;
  t.shape = *shape_correction(body, c.q);
  if (body.nodes) return t;
  // Eq. 21: the modes without rigid motion have the mass M_q = Bᵀ M B = M_r − Dᵀ I⁻¹ D
  t.M_q = body.mass_scale * body.archetype->M_r.topLeftCorner(body.r, body.r);
  if (t.exact_mass) t.M_q.noalias() -= t.D.transpose() * t.spin_of_modes;
  return t;
}

VecX modal_momentum(const ReducedBody& body, const ConfigurationTerms& terms, const VecX& q_dot) {
  if (!body.nodes) return terms.M_q * q_dot;
  VecX f = body.nodes->product(body.mass_scale, 0.0, q_dot);
  if (terms.exact_mass) f.noalias() -= terms.spin_of_modes.transpose() * (terms.D * q_dot);
  return f;
}

// Eq. 35: ω = I⁻¹(L − D q̇).
Vec3 frame_spin(const ConfigurationTerms& terms, const Vec3& L, const VecX& q_dot) {
  return terms.inertia_inverse * (L - terms.D * q_dot);
}

VecX generalised_velocity(const ReducedBody& body, const ConfigurationTerms& terms) {
  VecX y(body.dofs());
  y << body.P / terms.mass, terms.inertia_inverse * body.L, body.q_dot;
  return y;
}

// Eq. 16: the torque of the same forces, Σ m y × a = w × Syy w − 2 (w tr C_u − C_uᵀ w), taken out by
// Bᵀ
Vec3 fictitious_torque(const Vec3& w, const Mat3& Syy, const Mat3& C_u) {
  return w.cross(Syy * w) - 2.0 * (C_u.trace() * w - C_u.transpose() * w);
}

VecX fictitious_force(const ReducedBody& body, const Configuration& at,
                      const ConfigurationTerms& terms) {
  if (body.r == 0) return VecX();
  if (body.nodes) return nodal_fictitious_force(body, at, terms);
  const MomentumIntegrals& rest = body.archetype->integrals;
  const int stride = body.archetype->r();
  const Mat3 R = at.rotation.toRotationMatrix();
  const Vec3 w = R.transpose() * frame_spin(terms, body.L + at.delta_L, at.q_dot);
  const Mat3 spin = skew(w);
  const Mat3 spin_squared = spin * spin;

  // Eqs. 5 and 7: −Σ m φ_i · (w × (w × y) + 2 w × u) = −tr([w]² C_i) − 2 tr([w] Bqd_iᵀ), u = S q̇
  VecX g(body.r);
  Mat3 C_u = Mat3::Zero();  // Σ m y uᵀ
  for (int i = 0; i < body.r; ++i) {
    Mat3 B_qd = Mat3::Zero();  // Σ m φ_i uᵀ
    const Mat3* B_i = rest.B.data() + static_cast<std::size_t>(i) * stride;
    for (int j = 0; j < body.r; ++j) B_qd += at.q_dot[j] * B_i[j];
    g[i] = -spin_squared.cwiseProduct(terms.moments.C[i].transpose()).sum() -
           2.0 * body.mass_scale * spin.cwiseProduct(B_qd).sum();
    C_u += at.q_dot[i] * terms.moments.C[i];
  }

  g.noalias() -=
      terms.spin_of_modes.transpose() * (R * fictitious_torque(w, terms.moments.Syy, C_u));
  return g;
}

}  // namespace archetide
