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
  if (body.nodes) return body.nodes->elastic_force(q);
  if (body.is_nonlinear()) return body.archetype->elastic.force(q);
  return body.archetype->K_r.topLeftCorner(body.r, body.r) * q;
}

double elastic_energy(const ReducedBody& body) { return elastic_energy(body, body.q); }

double elastic_energy(const ReducedBody& body, const VecX& q) {
  if (body.nodes) return body.nodes->elastic_energy(q);
  if (body.is_nonlinear()) return body.archetype->elastic.energy(q);
  return 0.5 * q.dot(elastic_force(body, q));
}

std::size_t instance_bytes(const ReducedBody& body) {
  constexpr int kKeptShapes = 2;  // KeptShapes: q, slope and shift_rate each
  const auto numbers = body.q.size() + body.q_dot.size() + body.dofs() +
                       (body.is_nonlinear() ? body.r : 0) + kKeptShapes * 5 * body.r;
  return sizeof(ReducedBody) + sizeof(double) * numbers;
}

}  // namespace archetide
