#include "runtime/contact/split_impulse.h"

namespace archetide {
namespace {

/// How far the body went but for the pushes, m: dt (P^n + P of its joints) / m.
Vec3 way(const ReducedBody& body, const VecX& reaction, double dt) {
  Vec3 P = body.P;
  if (reaction.size() > 0) P += reaction.head<3>();
  return dt / body_mass(body) * P;
}

/// Share of a's lever in the change of the distance between two bodies that slide along each other:
/// a contact goes with the more curved one, that of balls by their radii.
double share_of_lever(const BodyContact& c, const ReducedBody& a, const ReducedBody& b) {
  const double arm_a = (c.point - a.position).norm(), arm_b = (c.point - b.position).norm();
  return arm_a + arm_b > 0.0 ? arm_a / (arm_a + arm_b) : 0.5;
}

}  // namespace

void split_impulses(const GroupContacts& reachable, const std::vector<VecX>& reaction, double dt,
                    std::vector<ReducedBody>& bodies) {
  const double h = 0.5 * dt;  // of the position stage, s
  for (const BodyContact& c : reachable.contacts) {
    if (c.b < 0) continue;
    const ContactForce* push = find_force(reachable.forces, c.a, c.b, c.sample);
    if (!push) continue;
    ReducedBody &a = bodies[c.a], &b = bodies[c.b];
    const Vec3 slid = way(a, reaction[c.a], dt) - way(b, reaction[c.b], dt);
    const Vec3 moment = slid.cross(h * push->force);
    const double share = share_of_lever(c, a, b);
    if (!a.prescribed) a.L += share * moment;
    if (!b.prescribed) b.L += (1.0 - share) * moment;
  }
}

}  // namespace archetide
