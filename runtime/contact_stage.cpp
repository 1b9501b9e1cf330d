#include "runtime/contact_stage.h"

#include <algorithm>

#include "runtime/contact/split_impulse.h"
#include "runtime/contact_setup.h"
#include "runtime/statistics.h"
#include "runtime/step_size.h"

namespace archetide {
namespace {

// Bodies against each other, obstacles and walls.
bool resolve_body_contact(SimulationState& s, double dt, HalfStep& half, StepReport& report) {
  split_impulses(half.reachable, half.reaction, dt, s.bodies);
  const std::vector<double> speeds = largest_surface_speeds(s.bodies);
  BodyContacts::Result met = s.body_contacts->resolve(s.bodies, speeds, dt);
  half.touching = std::move(met.velocity_stage);
  half.work_in_contact = met.work;
  const Penetration& p = met.penetration;
  report.contacts = p.touching;
  report.max_penetration = p.largest;
  report.mean_penetration = p.touching > 0 ? p.sum / p.touching : 0.0;
  if (s.options.scheme == Scheme::kSingle || !may_halve(s.options, report, kMostForOverlap))
    return true;
  const double way = 2.0 * dt * *std::max_element(speeds.begin(), speeds.end());
  return !s.body_contacts->sank_deeper(half.reachable, p, way);
}

// Each body alone at the walls of the tank.
void resolve_walls(SimulationState& s, double dt, HalfStep& half, StepReport& report) {
  WallContactOptions walls = wall_options(s.options, dt);
  for (std::size_t b = 0; b < s.bodies.size(); ++b) {
    walls.push_out = half.reaction[b].size() == 0;  // no joints
    if (s.bodies[b].prescribed) continue;
    if (half.held[b].points.empty() && away_from_walls(s.bodies[b], s.reach[b], walls)) continue;
    WallContactResult contact = resolve_wall_contacts(s.bodies[b], walls, half.held[b].points);
    report.contacts += contact.contacts;
    half.held[b] = std::move(contact.velocity_stage);
  }
}

}  // namespace

bool resolve_contact(SimulationState& s, double dt, HalfStep& half, StepReport& report) {
  if (!s.body_contacts && !(s.has_tank() && s.options.wall_contact)) return true;
  ScopedTimer timer(s.profile, "contact");
  const double before = energy_of_bodies(s.bodies);
  bool apart = true;
  if (s.body_contacts)
    apart = resolve_body_contact(s, dt, half, report);
  else
    resolve_walls(s, dt, half, report);
  half.lost_in_contact = before + half.work_in_contact - energy_of_bodies(s.bodies);
  s.budget.add_contact_energy(-half.lost_in_contact);
  return apart;
}

}  // namespace archetide
