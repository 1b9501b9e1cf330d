#include "tests/support/elastic/elastic_cases.h"

#include <cmath>

#include "common/base/check.h"
#include "tests/support/cpu_seconds.h"
#include "tests/support/dry_body.h"

namespace archetide {
namespace {

// The mode whose displacement is most along x.
int axial_mode(const MatX& modes) {
  int best = 0;
  double most = 0.0;
  for (int i = 0; i < modes.cols(); ++i) {
    const Eigen::Map<const MatX> u(modes.col(i).data(), 3, modes.rows() / 3);
    const double share = u.row(0).squaredNorm() / u.squaredNorm();
    if (share > most) most = share, best = i;
  }
  ARCHETIDE_CHECK_OP(most, >, 0.9);
  return best;
}

// A body that has this mode alone.
std::shared_ptr<const Archetype> with_one_mode(const ModesResult& modes, int i, double alpha) {
  auto a = std::make_shared<Archetype>();
  const int r = static_cast<int>(modes.omega2.size());
  a->omega2 = modes.omega2.segment(i, 1);
  a->M_r = modes.M_r.block(i, i, 1, 1), a->K_r = modes.K_r.block(i, i, 1, 1);
  a->alpha = alpha;
  a->integrals.mass = modes.integrals.mass, a->integrals.Sxx = modes.integrals.Sxx;
  a->integrals.I3 = {modes.integrals.I3[i]}, a->integrals.A = {modes.integrals.A[i]};
  a->integrals.B = {modes.integrals.B[i * r + i]};
  return a;
}

}  // namespace

ElasticResult elastic_modes(const ElasticCase& c) {
  ElasticResult result;
  const double start = cpu_seconds();
  TetrahedralizeOptions options;
  options.target = c.target;
  options.order = c.order;
  result.body = tetrahedralize(c.surface, options);
  move_to_centre_of_mass(result.body.mesh);
  result.mesh_cpu = cpu_seconds() - start;
  ModesOptions modes_options;
  modes_options.count = c.count;
  modes_options.mass = c.mass;
  modes_options.loads = c.loads;
  result.modes = compute_modes(result.body.mesh, material_of(c), modes_options, result.profile);
  result.modes_cpu = cpu_seconds() - start - result.mesh_cpu;
  return result;
}

VecX lamb_sphere(const Material& m) {
  const bool soft = m.poisson < 0.4;
  VecX x(20);
  x << VecX::Constant(5, 2.50113262), VecX::Constant(5, soft ? 2.646217035 : 2.661496174),
      VecX::Constant(3, soft ? 3.529987301 : 3.797507462), VecX::Constant(7, 3.864699778);
  return x * std::sqrt(m.young / (2.0 * (1.0 + m.poisson)) / m.density);
}

double worst_deviation(const VecX& omega, const VecX& exact, int count) {
  return (omega.head(count).array() / exact.head(count).array() - 1.0).abs().maxCoeff();
}

Eigen::Vector4d bar_bending_errors(const VecX& omega, const Material& m) {
  const double bending[4] = {0.3200270767, 0.8678313038, 1.662797132, 2.671223514};
  const int first[4] = {0, 2, 4, 7};
  Eigen::Vector4d errors;
  for (int k = 0; k < 4; ++k)
    errors[k] = omega[first[k]] * 20.0 * std::sqrt(m.density / m.young) / bending[k] - 1.0;
  return errors;
}

double spinning_rod_stretch(const ElasticResult& bar, const Material& m, double& kl) {
  const double half = 10.0, speed = std::sqrt(m.young / m.density);  // m, m/s
  const int mode = axial_mode(bar.modes.node_modes);
  const double omega = std::sqrt(bar.modes.omega2[mode]);
  const auto archetype = with_one_mode(bar.modes, mode, omega);  // damping ratio 1/2
  ReducedBody body = make_body(archetype, 1);
  const auto terms = [&] {
    return configuration_terms(body, current_configuration(body), ModalMass::kExact);
  };
  body.L = terms().inertia * Vec3(0, 0, kl * speed / half);
  dry_steps(body, 4000, 0.02 / omega, ModalOptions{});  // 80 / omega: damped by e^-40
  kl = frame_spin(terms(), body.L, body.q_dot).norm() * half / speed;
  // Mean displacement of the nodes of the two ends, outward.
  double stretch = 0.0;
  int count = 0;
  for (std::size_t n = 0; n < bar.body.mesh.nodes.size(); ++n) {
    const double x = bar.body.mesh.nodes[n][0];
    if (std::abs(x) < half - 1e-6) continue;
    stretch += (x > 0 ? 1.0 : -1.0) * bar.modes.node_modes(3 * n, mode) * body.q[0], ++count;
  }
  return stretch / count / half;
}

}  // namespace archetide
