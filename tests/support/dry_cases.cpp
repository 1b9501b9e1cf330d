#include "tests/support/dry_cases.h"

#include <cmath>

#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {

Vec3 tumbling_spin(double time, int steps) {
  auto archetype = std::make_shared<Archetype>();
  archetype->integrals.mass = 1.0;
  archetype->integrals.Sxx = Vec3(2, 1, 0).asDiagonal();  // tr(S) 1 - S = diag(1, 2, 3)
  archetype->M_r = archetype->K_r = MatX(0, 0);
  const Vec3 inertia(1, 2, 3);
  ReducedBody body = make_body(archetype, 0);
  body.L = inertia.cwiseProduct(Vec3(1e-3, 1, 1e-3));
  dry_steps(body, steps, time / steps, ModalOptions{});
  return (body.rotation.conjugate() * body.L).cwiseQuotient(inertia);
}

Vibration measured_vibration(double omega_dt, ModalStep step) {
  SyntheticOptions options;
  options.r = 1;
  const SyntheticBody synthetic =
      deformable_archetype(box_tets(Vec3(1, 1, 1), Vec3i(2, 2, 2)), options);
  const double omega = options.first_omega, dt = omega_dt / omega;
  Eigen::Matrix2d step_matrix;
  for (int c = 0; c < 2; ++c) {
    ReducedBody body = make_body(synthetic.archetype, 1);
    (c == 0 ? body.q[0] : body.q_dot[0]) = c == 0 ? 1.0 : omega;
    dry_steps(body, 1, dt, {step, ModalMass::kExact});
    step_matrix.col(c) << body.q[0], body.q_dot[0] / omega;
  }
  const double modulus = std::sqrt(step_matrix.determinant());
  const double angle = std::acos(0.5 * step_matrix.trace() / modulus);
  return {std::pow(modulus, 2.0 * M_PI / angle), angle / omega_dt};
}

Vibration exact_vibration(double x, ModalStep step) {
  if (step == ModalStep::kTrapezoid) return {1.0, 2.0 * std::atan(0.5 * x) / x};
  const double trace = (1 - x * x / 4) / (1 + x * x / 4) + 1 / (1 + x * x);
  const double modulus = std::sqrt((1 + 0.75 * x * x) / ((1 + x * x / 4) * (1 + x * x)));
  const double angle = std::acos(0.5 * trace / modulus);
  return {std::pow(modulus, 2 * M_PI / angle), angle / x};
}

double angle_off_rigid(double first_omega) {
  SyntheticOptions options;
  options.r = 5;
  options.first_omega = first_omega;
  const SyntheticBody synthetic =
      deformable_archetype(blob_tets(3, Vec3(0.5, 0.4, 0.3), Vec3i(3, 3, 3)), options);
  ReducedBody soft = make_body(synthetic.archetype, options.r);
  soft.L = configuration_terms(soft, current_configuration(soft), ModalMass::kExact).inertia *
           Vec3(1.0, 1.5, -1.2);
  ReducedBody rigid = make_body(synthetic.archetype, 0);
  rigid.L = soft.L;
  dry_steps(soft, 500, 0.01, ModalOptions{});
  dry_steps(rigid, 500, 0.01, ModalOptions{});
  return soft.rotation.angularDistance(rigid.rotation);
}

}  // namespace archetide
