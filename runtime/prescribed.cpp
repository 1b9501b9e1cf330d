#include "runtime/prescribed.h"

#include <algorithm>

namespace archetide {

void place_prescribed(SimulationState& s) {
  for (const PrescribedBody& told : s.prescribed) {
    const PrescribedBody::Pose now = told.at(s.time());
    ReducedBody& body = s.bodies[told.body];
    body.position = now.position, body.rotation = now.rotation;
    body.prescribed = std::make_shared<const PrescribedMotion>(
        PrescribedMotion{now.velocity, now.spin, now.velocity, now.spin});
    set_velocity(now.velocity, now.spin, body);
  }
}

void aim_prescribed(SimulationState& s, double dt) {
  for (const PrescribedBody& told : s.prescribed) {
    const PrescribedBody::Pose end = told.at(s.time() + dt);
    ReducedBody& body = s.bodies[told.body];
    const Eigen::AngleAxisd turn(end.rotation * body.rotation.conjugate());
    body.prescribed = std::make_shared<const PrescribedMotion>(
        PrescribedMotion{(end.position - body.position) / dt, turn.angle() / dt * turn.axis(),
                         end.velocity, end.spin});
  }
}

double prescribed_speed(const SimulationState& s, std::size_t b, double dt) {
  constexpr int kLooks = 8;
  double fastest = 0.0;
  for (const PrescribedBody& told : s.prescribed) {
    if (told.body != static_cast<int>(b)) continue;
    const double reach = farthest_point(s.bodies[b], s.reach[b]);
    for (int look = 0; look <= kLooks; ++look) {
      const PrescribedBody::Pose then = told.at(s.time() + dt * look / kLooks);
      fastest = std::max(fastest, then.velocity.norm() + reach * then.spin.norm());
    }
  }
  return fastest;
}

double work_of_prescribed(const ReducedBody& before, const PrescribedMotion& motion,
                          const VecX& given) {
  const VecX start = generalised_velocity(
      before, configuration_terms(before, current_configuration(before), ModalMass::kExact));
  const Vec3 v = 0.5 * (start.head<3>() + motion.velocity),
             w = 0.5 * (start.segment<3>(3) + motion.spin);
  return -given.head<3>().dot(v) - given.segment<3>(3).dot(w);
}

}  // namespace archetide
