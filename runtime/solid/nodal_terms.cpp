#include "runtime/solid/nodal_terms.h"

#include "runtime/solid/rotation.h"

namespace archetide {

// Σ m y yᵀ = Σ m x xᵀ + Σ m u xᵀ + Σ m y uᵀ, x and u as the mass has them
Moments nodal_moments(const ReducedBody& body, const VecX& q) {
  const NodalSpace& nodes = *body.nodes;
  const VecX u = nodes.of_mass(q), Mu = nodes.product(body.mass_scale, 0.0, u);
  Moments out{body.mass_scale * body.archetype->integrals.Sxx,
              {},
              body.mass_scale * nodes.rest_moments() + Mu};
  out.Syy += outer_sum(Mu, nodes.rest_of_mass()) + outer_sum(out.nodal, u);
  return out;
}

Vec3 nodal_angular_momentum(const NodalSpace& nodes, const VecX& Y, const VecX& u_dot) {
  return axial(outer_sum(Y, nodes.of_mass(u_dot)));
}

MatX nodal_levers(const NodalSpace& nodes, const Mat3& R, const VecX& Y) {
  MatX D(Y.size(), 3);
  for (Eigen::Index p = 0; p < Y.size(); p += 3)
    D.middleRows<3>(p) = (R * skew(Y.segment<3>(p))).transpose();
  return nodes.from_mass(D).transpose();
}

// Eqs. 5 and 7 node by node: −([w]² Y_p + 2 [w] (M u̇)_p), and their torque taken out by Bᵀ.
VecX nodal_fictitious_force(const ReducedBody& body, const Configuration& at,
                            const ConfigurationTerms& terms) {
  const Mat3 R = at.rotation.toRotationMatrix();
  const Vec3 w = R.transpose() * frame_spin(terms, body.L + at.delta_L, at.q_dot);
  const VecX& Y = terms.moments.nodal;
  const VecX u_dot = body.nodes->of_mass(at.q_dot);
  const VecX momentum = body.nodes->product(body.mass_scale, 0.0, u_dot);
  VecX g(Y.size());
  for (Eigen::Index p = 0; p < Y.size(); p += 3)
    g.segment<3>(p) = -w.cross(w.cross(Y.segment<3>(p)) + 2.0 * momentum.segment<3>(p));
  g = body.nodes->from_mass(g);
  const Mat3 C_u = outer_sum(Y, u_dot);
  g.noalias() -=
      terms.spin_of_modes.transpose() * (R * fictitious_torque(w, terms.moments.Syy, C_u));
  return g;
}

}  // namespace archetide
