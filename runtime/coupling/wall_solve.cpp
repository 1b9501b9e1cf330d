// Coupling: the coupled solve with bodies that meet walls only, each alone.

#include <algorithm>

#include "runtime/coupling/coupling.h"

namespace archetide {
namespace {

// A body and the points at walls that may hold it.
struct HeldBody {
  VecX y_star;                             // 6 + r, not held
  MatX inverse_mass;                       // of the body that is not held ..
  std::shared_ptr<const NodalBody> nodes;  // .. and the whole of a body of nodes
  MatX rows, tangents;
  std::vector<int> pressing;  // of the rows

  bool meets_walls() const { return rows.rows() > 0; }
  VecX free_velocity(const CoupledBody& c) const {
    if (nodes) return y_star + nodes->answer(c.impulse);
    return y_star + inverse_mass * c.impulse;
  }
};

HeldBody held_body(const ReducedBody& body, const StageResult& result, const CoupledBody& c,
                   ModalMass mass) {
  HeldBody held{c.y_star, c.inverse_mass, c.nodes, {}, {}, {}};
  const StageContacts& contacts = result.contacts;
  if (contacts.points.empty()) return held;
  const ConfigurationTerms here = configuration_terms(body, current_configuration(body), mass);
  held.rows = contact_rows(body, here, contacts.points);
  held.tangents = tangent_rows(body, here, contacts.points);
  held.pressing = pressing_rows(result.motion.H, held.rows, held.y_star, contacts.target);
  return held;
}

// The body with the points that press as constraints.
void hold(const HeldBody& held, const StageContacts& contacts, CoupledBody& c) {
  if (!held.meets_walls()) return;
  const MatX rows = held.rows(held.pressing, Eigen::all);
  const VecX target = contacts.target(held.pressing);
  if (held.nodes) {
    const ConstrainedMass mass(ConstrainedMass::Response{held.nodes->answer(rows.transpose())},
                               rows, target);
    c.nodes = held.nodes->held(mass.response(), mass.gram_inverse());
    c.inverse_mass = c.nodes->inverse().block();
    c.y_star = mass.project(held.y_star);
    return;
  }
  const ConstrainedMass mass(held.inverse_mass, rows, target);
  c.inverse_mass = mass.inverse();
  c.y_star = mass.project(held.y_star);
}

// The points that press under the solution's pressure; true if they are others than before.
bool find_pressing(const StageResult& result, const CoupledBody& c, HeldBody& held) {
  if (!held.meets_walls()) return false;
  auto now =
      pressing_rows(result.motion.H, held.rows, held.free_velocity(c), result.contacts.target);
  const bool changed = now != held.pressing;
  held.pressing = std::move(now);
  return changed;
}

}  // namespace

// A wall may push but not pull: the points that press are found again from the solution's pressure,
// and the solve repeated until they do not change.
SolveReport Coupling::solve_held(Stage stage, double dt, const std::vector<StageBody>& bodies,
                                 MacField& u, std::vector<CoupledBody>& coupled,
                                 std::vector<StageResult>& results) {
  constexpr int kMaxRounds = 5;
  const std::size_t n = bodies.size();
  const double h = stage_seconds(stage, dt);
  std::vector<HeldBody> held;
  for (std::size_t b = 0; b < n; ++b)
    held.push_back(held_body(*bodies[b].body, results[b], coupled[b], options_.modal.mass));
  const bool any = std::any_of(held.begin(), held.end(),
                               [&](const HeldBody& body) { return body.meets_walls(); });
  const bool again = any && wet();
  CoupledSolveOptions trial = options_.solve;
  if (again) trial.tolerance = std::max(trial.tolerance, kTrialTolerance);
  Array3<double>& pressure = pressure_[stage == Stage::kVelocityFull];
  SolveReport total;
  for (int round = 0; round < kMaxRounds; ++round) {
    for (std::size_t b = 0; b < n; ++b) hold(held[b], results[b].contacts, coupled[b]);
    total.add(solver_.find_pressure(options_.grid, system_, h, coupled,
                                    round == 0 ? trial : options_.solve, u, pressure, nullptr,
                                    round > 0));
    bool changed = false;
    for (std::size_t b = 0; b < n; ++b)
      changed = find_pressing(results[b], coupled[b], held[b]) || changed;
    if (!again || (round > 0 && !changed)) break;
  }
  solver_.move_water(options_.grid, system_, h, pressure, u, valid_);

  // Friction, and what the last round did not settle, on the body alone.
  for (std::size_t b = 0; b < n; ++b) {
    if (!held[b].meets_walls()) continue;
    coupled[b].y = held[b].free_velocity(coupled[b]);
    push_apart(results[b].motion.H, held[b].rows, held[b].tangents, results[b].contacts.target,
               options_.walls.at(*bodies[b].body).friction, coupled[b].y);
  }
  return total;
}

}  // namespace archetide
