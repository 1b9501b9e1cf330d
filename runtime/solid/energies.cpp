#include "runtime/solid/nodal_space.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

double kinetic_energy(const ReducedBody& body) {
  // ½ P²/m + ½ L·I⁻¹L + ½ q̇ᵀ M_q q̇: the three parts of J M_rigid⁻¹ (P, L) + B q̇ are M-orthogonal
  const ConfigurationTerms t =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  return 0.5 * (body.P.squaredNorm() / t.mass + body.L.dot(t.inertia_inverse * body.L) +
                body.q_dot.dot(modal_momentum(body, t, body.q_dot)));
}

VecX elastic_force(const ReducedBody& body, const VecX& q) {
  if (body.nodes) return body.nodes->product(0.0, 1.0, q);
  return body.archetype->K_r.topLeftCorner(body.r, body.r) * q;
}

double elastic_energy(const ReducedBody& body) {
  if (body.r > 0 && body.archetype->nonlinear()) return body.archetype->elastic.energy(body.q);
  return 0.5 * body.q.dot(elastic_force(body, body.q));
}

std::size_t instance_bytes(const ReducedBody& body) {
  return sizeof(ReducedBody) + sizeof(double) * (body.q.size() + body.q_dot.size());
}

}  // namespace archetide
