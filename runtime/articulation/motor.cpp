#include "runtime/articulation/motor.h"

#include <cmath>

namespace archetide {
namespace {

// How a body turns about the axis n through its centre of mass.
struct Turning {
  double speed = 0.0;       // rad/s
  double compliance = 0.0;  // n . I^-1 n, 1/(kg m^2)
};

Turning turning(const ReducedBody& body, const Vec3& n, ModalMass mass) {
  const ConfigurationTerms terms = configuration_terms(body, current_configuration(body), mass);
  const Vec3 answer = terms.inertia_inverse * n;
  return {answer.dot(body.L), answer.dot(n)};
}

}  // namespace

double Motor::supply(double t) const {
  if (!runs(t)) return 0.0;
  return std::isfinite(period) ? std::sin(2.0 * M_PI * (t - start) / period + phase) : 1.0;
}

// Eq. S8f.
void add_motor_torque(const Motor& motor, double t, double dt, const PlacedBody& placed,
                      ModalMass mass, std::vector<VecX>& force) {
  if (!motor.runs(t)) return;
  const ReducedBody a = placed(motor.a);
  const Vec3 n = a.rotation * motor.axis;
  double torque = motor.torque * motor.supply(t);
  if (std::isfinite(motor.speed)) {
    const Turning of_a = turning(a, n, mass),
                  of_b = motor.b < 0 ? Turning{} : turning(placed(motor.b), n, mass);
    const double loss = motor.torque / motor.speed;  // N m s
    torque = (torque - loss * (of_a.speed - of_b.speed)) /
             (1.0 + 0.5 * dt * loss * (of_a.compliance + of_b.compliance));
  }
  force[motor.a].segment<3>(3) += torque * n;
  if (motor.b >= 0) force[motor.b].segment<3>(3) -= torque * n;
}

}  // namespace archetide
