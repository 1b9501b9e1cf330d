#include "runtime/articulation/spring.h"

#include <algorithm>
#include <cmath>

namespace archetide {
namespace {

// One end of a spring.
struct SpringEnd {
  Vec3 place = Vec3::Zero(), velocity = Vec3::Zero();  // m, m/s
  ReducedBody body;                                    // of the world: none
  ConfigurationTerms terms;
  MatX J;  // 3 x (6 + r)

  explicit SpringEnd(const Vec3& in_space) : place(in_space) {}
  SpringEnd(ReducedBody at, const AttachedPoint& point, ModalMass mass)
      : place(place_of(at, point)), body(std::move(at)) {
    terms = configuration_terms(body, current_configuration(body), mass);
    J = arm_jacobian(body, terms, place - body.position, point.modes);
    velocity = J * generalised_velocity(body, terms);
  }
  // n . J H^-1 J^T n, 1/kg
  double compliance(const Vec3& n, const ModalOptions& modal, double dt) const {
    if (J.size() == 0) return 0.0;
    const VecX f = J.transpose() * n;
    return f.dot(generalised_mass(body, terms, dt, Stage::kVelocityFull, modal.step).solve(f));
  }
};

struct SpringEnds {
  SpringEnd a, b;
  SpringEnds(const Spring& s, const PlacedBody& placed, ModalMass mass)
      : a(placed(s.a), s.at_a, mass),
        b(s.b < 0 ? SpringEnd(s.at_world) : SpringEnd(placed(s.b), s.at_b, mass)) {}
};

}  // namespace

Spring make_spring(const std::vector<ReducedBody>& bodies, int a, int b, const Vec3& rest_a,
                   const Vec3& end) {
  Spring spring;
  spring.a = a, spring.b = b;
  spring.at_a = attach(bodies[a], rest_a);
  if (b < 0)
    spring.at_world = end;
  else
    spring.at_b = attach(bodies[b], end);
  const Vec3 other = b < 0 ? end : place_of(bodies[b], spring.at_b);
  spring.length = (other - place_of(bodies[a], spring.at_a)).norm();
  return spring;
}

// Eq. S8d.
void add_spring_force(const Spring& spring, const PlacedBody& placed, ModalMass mass,
                      std::vector<VecX>& force) {
  const SpringEnds ends(spring, placed, mass);
  const Vec3 d = ends.b.place - ends.a.place;
  const double length = d.norm();
  if (length == 0.0 || (spring.slack && length <= spring.length)) return;
  const Vec3 n = d / length;
  double pull = spring.stiffness * (length - spring.length) +
                spring.damping * n.dot(ends.b.velocity - ends.a.velocity);
  if (spring.slack) pull = std::max(0.0, pull);
  force[spring.a] += ends.a.J.transpose() * (pull * n);
  if (spring.b >= 0) force[spring.b] -= ends.b.J.transpose() * (pull * n);
}

double stable_spring_step(const Spring& spring, const PlacedBody& placed, const ModalOptions& modal,
                          double dt) {
  constexpr double kShare = 0.5;  // of a radian of the oscillation; 2 is the limit
  const SpringEnds ends(spring, placed, modal.mass);
  const Vec3 n = (ends.b.place - ends.a.place).stableNormalized();
  const double compliance = ends.a.compliance(n, modal, dt) + ends.b.compliance(n, modal, dt);
  return kShare / std::max({std::sqrt(spring.stiffness * compliance), spring.damping * compliance,
                            kShare / dt});
}

}  // namespace archetide
