#include "runtime/failure_diagnosis.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

namespace archetide {
namespace {

// The first mode that is not finite, or -1.
int broken_mode(const ReducedBody& body) {
  for (int i = 0; i < body.r; ++i)
    if (!std::isfinite(body.q[i]) || !std::isfinite(body.q_dot[i])) return i;
  return -1;
}

// A cell beside the first velocity that is not finite, or with such a level set.
std::optional<Vec3i> broken_cell(const FluidState& fluid) {
  const Array3<double>& phi = fluid.phi;
  for (int k = 0; k < phi.nz(); ++k)
    for (int j = 0; j < phi.ny(); ++j)
      for (int i = 0; i < phi.nx(); ++i)
        if (!std::isfinite(phi(i, j, k) + fluid.u[0](i, j, k) + fluid.u[1](i, j, k) +
                           fluid.u[2](i, j, k)))
          return Vec3i(i, j, k);
  return std::nullopt;
}

// The joint that stays open.
SimulationFailure open_joint(const SimulationState& s, double dt, const StepAttempt& attempt) {
  const Joint& joint = s.joints[attempt.open_joint];
  Culprit culprit;
  culprit.joint = attempt.open_joint, culprit.body = joint.a, culprit.other_body = joint.b;
  std::ostringstream what;
  what << "a joint could not be closed: " << attempt.open_gap << " m are left (dt = " << dt
       << " s)";
  return {"joint", what.str(), s.time(), culprit};
}

// The body nearest to x, or -1.
int nearest_body(const SimulationState& s, const Vec3& x) {
  double nearest = INFINITY;
  int body = -1;
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    const double gap = (s.bodies[b].position - x).norm() - s.reach[b].rest;
    if (gap < nearest) nearest = gap, body = static_cast<int>(b);
  }
  return body;
}

}  // namespace

int broken_body(const std::vector<ReducedBody>& bodies) {
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const ReducedBody& body = bodies[b];
    const bool finite = body.position.allFinite() && body.rotation.coeffs().allFinite() &&
                        body.P.allFinite() && body.L.allFinite() && broken_mode(body) < 0;
    if (!finite) return static_cast<int>(b);
  }
  return -1;
}

void demand_finite(const std::vector<ReducedBody>& bodies, const FluidState& fluid,
                   const StepReport& r) {
  const int body = broken_body(bodies);
  if (body >= 0)
    throw SimulationFailure("finite", "a body is no longer finite", r.t,
                            {body, broken_mode(bodies[body]), {}});
  if (!std::isfinite(r.water_kinetic) || !std::isfinite(r.max_speed))
    throw SimulationFailure("finite", "the water is no longer finite", r.t,
                            {-1, -1, broken_cell(fluid)});
  if (!std::isfinite(r.energy()))
    throw SimulationFailure("finite", "the energy is no longer finite", r.t, {});
}

SimulationFailure step_failure(const SimulationState& s, double dt, const StepAttempt& attempt) {
  if (attempt.open_joint >= 0) return open_joint(s, dt, attempt);
  Culprit culprit;
  if (s.water.present()) {
    const Vec3i& c = s.coupling.last_divergent_cell();
    culprit.cell = c;
    culprit.body = nearest_body(s, s.options.grid.cell_centre(c[0], c[1], c[2]));
  }
  const SolveReport &position = attempt.report.position, &velocity = attempt.report.velocity;
  std::ostringstream what;
  what << "the coupled solve did not converge (dt = " << dt << " s, residual "
       << std::max(position.residual, velocity.residual) << ", "
       << std::max(position.iterations, velocity.iterations) << " iterations)";
  return {"convergence", what.str(), s.time(), culprit};
}

}  // namespace archetide
