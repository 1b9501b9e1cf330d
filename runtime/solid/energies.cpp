#include "runtime/solid/nodal_space.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

// ½ m v² + ½ ω·Iω + ½ q̇ᵀ M_q q̇: the three parts of J y are M-orthogonal.
double kinetic_energy(const ReducedBody& body, const ConfigurationTerms& t, const VecX& y) {
  const Vec3 w = y.segment<3>(3);
  const VecX q_dot = y.tail(body.r);
  return 0.5 * (t.mass * y.head<3>().squaredNorm() + w.dot(t.inertia * w) +
                q_dot.dot(modal_momentum(body, t, q_dot)));
}

double kinetic_energy(const ReducedBody& body) {
  const ConfigurationTerms t =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  return kinetic_energy(body, t, generalised_velocity(body, t));
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
  const bool nonlinear = body.r > 0 && body.archetype->nonlinear();
  const auto numbers = body.q.size() + body.q_dot.size() + body.dofs() + (nonlinear ? body.r : 0);
  return sizeof(ReducedBody) + sizeof(double) * numbers;
}

}  // namespace archetide
