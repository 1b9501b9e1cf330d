#include "runtime/simulation.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "common/check.h"
#include "common/input_error.h"
#include "runtime/articulation/pre_stabilisation.h"
#include "runtime/body_state.h"
#include "runtime/budget.h"
#include "runtime/contact/body_contacts.h"
#include "runtime/contact/split_impulse.h"
#include "runtime/contact/wall_contact.h"
#include "runtime/failure.h"
#include "runtime/fluid/advection.h"
#include "runtime/fluid/spray.h"
#include "runtime/solid/inversion_guard.h"
#include "runtime/statistics.h"
#include "runtime/water_step.h"

namespace archetide {
namespace {

WallContactOptions wall_options(const SimulationOptions& o, double dt) {
  WallContactOptions w;
  w.low = o.grid.low();
  w.high = o.grid.high();
  for (int s = 0; s < 6; ++s) w.closed[s] = !o.open_side[s];
  w.restitution = o.restitution;
  w.friction = o.friction;
  w.tolerance = 1e-3 * o.grid.dx;
  // What gravity adds in two steps is a body lying on the floor, not one that bounces.
  const double g = o.gravity.norm();
  w.resting_speed = std::max(std::sqrt(2.0 * g * w.tolerance), 2.0 * g * dt);
  w.dt = dt;
  w.modal = o.modal;
  return w;
}

// Skins, met instead of the bodies under them; those of one kind share a shape.
std::vector<ContactCover> contact_covers(const std::vector<SkinnedBodies>& skins,
                                         const std::vector<ReducedBody>& bodies) {
  std::map<const BoundSkin*, std::shared_ptr<const CoverShape>> known;
  std::vector<ContactCover> covers;
  for (const SkinnedBodies& skin : skins) {
    std::shared_ptr<const CoverShape>& shape = known[skin.shape.get()];
    if (!shape) {
      const Skin& whole = *skin.shape->skin;
      std::vector<std::shared_ptr<const Archetype>> parts;
      for (const int b : skin.bodies) parts.push_back(bodies[b].archetype);
      MatX weights(whole.surface.vertices.size(), parts.size());
      for (Eigen::Index v = 0; v < weights.rows(); ++v)
        for (Eigen::Index p = 0; p < weights.cols(); ++p)
          weights(v, p) = whole.weight(static_cast<std::size_t>(v), static_cast<int>(p));
      shape = cover_shape(whole.surface, weights, parts);
    }
    covers.push_back(
        {skin.bodies, shape, [skin](const std::vector<ReducedBody>& at, std::vector<Vec3>& x) {
           skin_points(
               skin, [&](int b) -> const ReducedBody& { return at[b]; }, x);
         }});
  }
  return covers;
}

// Contact between bodies, if the scene has any that may touch; of skins with walls in any case.
std::unique_ptr<BodyContacts> make_body_contacts(const SimulationOptions& o,
                                                 const std::vector<ReducedBody>& bodies,
                                                 const std::vector<TriMesh>& obstacles,
                                                 const std::vector<Joint>& joints,
                                                 const std::vector<SkinnedBodies>& skins) {
  const bool has_tank = o.grid.cells() > 0;
  const bool among = o.body_contact && bodies.size() + obstacles.size() >= 2;
  const bool skins_at_walls = !skins.empty() && has_tank && o.wall_contact;
  if (bodies.empty() || !(among || skins_at_walls)) return nullptr;
  Sides closed{};
  if (has_tank && o.wall_contact)
    for (int s = 0; s < 6; ++s) closed[s] = !o.open_side[s];
  double dx = o.grid.dx;
  if (!has_tank) {
    dx = INFINITY;  // no grid: an eighth of the smallest body
    for (const ReducedBody& b : bodies) dx = std::min(dx, body_reach(*b.archetype).rest / 8.0);
  }
  BodyContactOptions c{o.restitution, o.friction, 1e-3 * dx, o.gravity.norm(), o.modal, {}};
  c.search.each_other = among;
  c.search.covers = contact_covers(skins, bodies);
  for (const Joint& joint : joints)
    if (joint.b >= 0) c.search.apart.insert(std::minmax({joint.a, joint.b}));
  for (const SkinnedBodies& skin : skins)
    for (const int a : skin.bodies)
      for (const int b : skin.bodies)
        if (a < b) c.search.apart.insert({a, b});
  const std::vector<TriMesh> met = among ? obstacles : std::vector<TriMesh>();
  return std::make_unique<BodyContacts>(
      c, bodies, Surroundings(o.grid.low(), o.grid.high(), closed, met, 0.5 * dx));
}

CouplingOptions coupling_options(const SimulationOptions& o, const WaterStep& water) {
  CouplingOptions c;
  c.grid = water.grid();
  c.has_water = o.has_water;
  c.open_side = water.open_side();
  c.hydrostatics = {o.water_density, o.gravity, o.reference_point};
  c.geometry = o.geometry;
  c.modal = o.modal;
  c.solve = {o.tolerance, o.max_iterations};
  c.walls = wall_options(o, 0.0);
  return c;
}

}  // namespace

struct Simulation::Impl {
  SimulationOptions options;
  std::vector<ReducedBody> bodies;
  std::vector<ReducedBody> waiting;  // to appear, in order
  std::vector<double> release;       // s, of those that wait
  std::vector<TriMesh> obstacles;
  std::vector<Joint> joints;
  std::vector<Actuator> actuators;
  std::vector<SkinnedBodies> skins;
  WaterStep water;
  WaterStep::Memory water_before;  // the step
  Coupling coupling;

  std::vector<StageContacts> held;              // per body, points at walls for the velocity stage
  std::vector<BodyReach> reach;                 // per body, bounds its extent
  std::unique_ptr<BodyContacts> body_contacts;  // null: bodies meet nothing but walls
  GroupContacts reachable, touching;            // of the position and of the velocity stage
  InversionGuard guard;                         // of soft bodies' elements
  std::vector<VecX> reaction;  // per body, what joints gave in the position stage, N s
  int open_joint = -1;         // that the last attempt could not close, or -1 ..
  double open_gap = 0.0;       // .. and how far it stays open, m
  std::vector<VecX> drive;     // per body, actuation in the velocity stage, or empty
  std::vector<Vec3> water_impulse, water_angular_impulse;
  std::vector<ReducedBody> half_way;     // as the water meets them in the position stage
  std::vector<ReducedBody> last_solved;  // as the last solve saw them (Scheme::kSingle)
  std::int64_t step_count = 0;
  double actuation_work = 0.0;  // J
  BudgetKeeper budget;
  Profile profile;

  Impl(SimulationOptions o, FluidState initial, std::vector<ReducedBody> b,
       std::vector<TriMesh> obs, std::vector<double> appear, std::vector<Joint> tied,
       std::vector<SkinnedBodies> skinned)
      : options(std::move(o)),
        waiting(std::move(b)),
        release(std::move(appear)),
        obstacles(std::move(obs)),
        joints(std::move(tied)),
        skins(std::move(skinned)),
        water(options, std::move(initial)),
        coupling(coupling_options(options, water), obstacles, joints, skins) {
    release.resize(waiting.size(), 0.0);
    body_contacts = make_body_contacts(options, waiting, obstacles, joints, skins);
    admit_bodies();
  }

  bool has_tank() const { return options.grid.cells() > 0; }

  void prepare();
  void admit_bodies();
  void fit_tank();
  void admit(std::size_t n);
  bool attempt(double dt, StepReport& report);
  bool advance_positions(double dt, std::vector<Configuration>& middle,
                         std::vector<std::vector<Vec3>>& read_points, StepReport& report);
  bool lock_modes(const std::vector<StageResult>& results, double dt,
                  std::vector<StageBody>& stage);
  bool keep_bodies_whole(const std::vector<FreeMotion>& motions, double dt, std::vector<VecX>& y);
  bool close_joints(const std::vector<FreeMotion>& motions, const std::vector<char>& stopped,
                    double dt, std::vector<VecX>& y);
  void guess_half_way(double dt);
  void predict_positions(double dt, std::vector<Configuration>& middle);
  void correct_positions(double dt, const std::vector<ReducedBody>& start);
  bool resolve_contact(double dt, StepReport& report);
  bool resolve_contacts(double dt, StepReport& report);
  double energy_of_bodies() const;
  bool advance_velocities(double dt, const std::vector<Configuration>& middle,
                          const std::vector<std::vector<Vec3>>& read_points, StepReport& report);
  std::vector<VecX> actuation(double t, const std::vector<Configuration>& at) const;
  bool may_reach_wall(std::size_t b, double dt) const;
  bool only_gravity_acts(std::size_t b) const;
  double largest_travel(std::size_t b, double water_top) const;
  std::vector<double> body_speeds() const;
  bool resolve_body_contact(double dt, StepReport& report);
  void update_geometry(const std::vector<ReducedBody>& at);
  void visit_state(StateArchive& a);
  void visit_last_solved(StateArchive& a);
  void carry_markers(double dt);
  void stop_held();
  void add_water_budget(const SprayMotion& drops, BudgetKeeper::End& end) const;
  void fill_report(double dt, StepReport& report);
  SimulationFailure failure(double dt, const StepReport& report) const;
};

// Bodies whose time has come join the others.
void Simulation::Impl::admit_bodies() {
  constexpr double kSameTime = 1e-9;  // s
  std::size_t n = 0;
  while (n < waiting.size() && release[n] <= water.fluid.time + kSameTime) {
    const ReducedBody& body = waiting[n++];
    budget.add_appearing_energy(kinetic_energy(body) + elastic_energy(body) -
                                body_mass(body) * options.gravity.dot(body.position));
  }
  if (n > 0) admit(n);
}

void Simulation::Impl::admit(std::size_t n) {
  bodies.insert(bodies.end(), waiting.begin(), waiting.begin() + static_cast<long>(n));
  waiting.erase(waiting.begin(), waiting.begin() + static_cast<long>(n));
  release.erase(release.begin(), release.begin() + static_cast<long>(n));
  for (std::size_t b = reach.size(); b < bodies.size(); ++b)
    reach.push_back(body_reach(*bodies[b].archetype));
  held.resize(bodies.size());
  reaction.resize(bodies.size());
  water_impulse.resize(bodies.size(), Vec3::Zero());
  water_angular_impulse.resize(bodies.size(), Vec3::Zero());
}

// First look at the scene: fractions, a clean level set, particles.
void Simulation::Impl::prepare() {
  if (!water.present()) return;
  update_geometry(bodies);
  water.prepare(coupling);
  water.place_markers(obstacles, bodies);
}

void Simulation::Impl::update_geometry(const std::vector<ReducedBody>& at) {
  std::vector<StageBody> stage;
  for (const ReducedBody& b : at) stage.push_back({&b, current_configuration(b), {}, false, {}});
  coupling.update_geometry(stage);
}

// The list of everything that a step hands to the next.
void Simulation::Impl::visit_state(StateArchive& a) {
  a.field("time", water.fluid.time);
  a.field("last_dt", water.last_dt);
  a.field("step_count", step_count);
  a.field("actuation_work", actuation_work);
  budget.visit_state(a);
  std::size_t present = bodies.size();
  a.field("present", present);
  if (present < bodies.size() || present > bodies.size() + waiting.size())
    a.fail("there are other bodies in this scene");
  if (present > bodies.size()) admit(present - bodies.size());
  body_fields(a, "bodies", bodies);
  a.field("bodies/water_impulse", water_impulse);
  a.field("bodies/water_angular_impulse", water_angular_impulse);
  if (body_contacts) {
    contact_fields(a, "contact/position", body_contacts->memory.position);
    contact_fields(a, "contact/velocity", body_contacts->memory.velocity);
  }
  if (water.present()) {
    water.visit_state(a);
    if (a.reading()) coupling.set_tank(water.grid(), water.open_side());
    if (options.scheme == Scheme::kSingle) visit_last_solved(a);
  }
  coupling.visit_state(a);
}

// With one solve a step the surface moves before there is a new geometry.
void Simulation::Impl::visit_last_solved(StateArchive& a) {
  if (last_solved.empty()) last_solved = bodies;
  body_fields(a, "seen", last_solved);
  if (a.reading()) update_geometry(last_solved);
}

// Before a step: the fields end above the water.
void Simulation::Impl::fit_tank() {
  if (!water.present() || !water.fit_ceiling()) return;
  coupling.set_tank(water.grid(), water.open_side());
  update_geometry(options.scheme == Scheme::kSingle && !last_solved.empty() ? last_solved : bodies);
}

void Simulation::Impl::carry_markers(double dt) {
  if (water.fluid.markers.empty()) return;
  ScopedTimer timer(profile, "markers");
  water.carry_markers(dt, bodies);
}

// Section 6, positions: velocities at the half step move the bodies.
bool Simulation::Impl::advance_positions(double dt, std::vector<Configuration>& middle,
                                         std::vector<std::vector<Vec3>>& read_points,
                                         StepReport& report) {
  if (body_contacts) {
    ScopedTimer search(profile, "contact");
    reachable = body_contacts->reachable_contacts(bodies, body_speeds(), dt);
  }
  ScopedTimer timer(profile, "positions");
  if (water.present()) water.advect_to_half(dt);
  std::vector<Configuration> now;
  for (const ReducedBody& body : bodies) now.push_back(current_configuration(body));
  const std::vector<VecX> driven = actuation(water.fluid.time + 0.5 * dt, now);
  std::vector<StageBody> stage;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    stage.push_back({&bodies[b], now[b], {}, may_reach_wall(b, dt), {}, {}, driven[b]});
  if (water.present() && options.geometry == Geometry::kCutCell) {
    guess_half_way(dt);
    for (std::size_t b = 0; b < bodies.size(); ++b) stage[b].met = &half_way[b];
  }
  std::vector<StageResult> results;
  const auto couple = [&] {
    report.position =
        coupling.couple(Stage::kPositionHalf, dt, {&water.fluid.phi}, stage, water.u_half, results,
                        body_contacts ? &reachable : nullptr, water.narrow_flow());
    return report.position.converged;
  };
  if (!couple()) return false;
  if (lock_modes(results, dt, stage)) {  // again, so that the water meets modes that do not move
    if (water.present()) water.restore_half();
    if (body_contacts) reachable = body_contacts->reachable_contacts(bodies, body_speeds(), dt);
    if (!couple()) return false;
  }
  if (body_contacts) {
    profile.add("positions", -coupling.contact_seconds());
    profile.add("contact", coupling.contact_seconds());
    body_contacts->memory.position = reachable.forces;
    report.contact_sweeps += reachable.sweeps;
  }
  if (water.present()) water.after_position_solve(dt, coupling);
  std::vector<VecX> y;
  std::vector<FreeMotion> motions;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    y.push_back(results[b].y);
    motions.push_back(results[b].motion);
    reaction[b] = results[b].joint_reaction;
  }
  if (!keep_bodies_whole(motions, dt, y)) return false;
  middle.clear();
  read_points.resize(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    std::vector<Vec3> before, &mid = read_points[b];
    surface_points(bodies[b], before);
    middle.push_back(
        guard.advance(static_cast<int>(b), bodies[b], motions[b], y[b], dt, stage[b].at.locked));
    held[b] = results[b].contacts;
    surface_points(bodies[b], mid);
    for (std::size_t v = 0; v < mid.size(); ++v) mid[v] += kReadBack * (before[v] - mid[v]);
  }
  return true;
}

// Where the velocities that bodies have take them in half a step: the water's velocity in the
// middle of the step belongs to the walls as they stand then [D47]. Modes by their implicit rule,
// but from balance: stiff ones hardly move, and nothing that rests.
void Simulation::Impl::guess_half_way(double dt) {
  half_way = bodies;
  for (ReducedBody& body : half_way) {
    FreeMotion motion;
    motion.terms = configuration_terms(body, current_configuration(body), options.modal.mass);
    motion.H = generalised_mass(body, motion.terms, dt, Stage::kPositionHalf, options.modal.step);
    VecX y = generalised_velocity(body, motion.terms);
    if (body.r > 0) y.tail(body.r) = motion.H.M_hat_factor.solve(motion.terms.M_q * body.q_dot);
    guard.shorten(body, 0.5 * dt, y);
    advance_pose(body, motion, y, 0.5 * dt);
  }
}

// Modes that would close elements which stand at their limit are held there; true if there are any.
bool Simulation::Impl::lock_modes(const std::vector<StageResult>& results, double dt,
                                  std::vector<StageBody>& stage) {
  bool any = false;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    stage[b].at.locked = guard.closing(bodies[b], results[b].motion, results[b].y, dt);
    any = any || stage[b].at.locked.size() > 0;
  }
  return any;
}

// Velocities of the position update that leave no joint open and no element inside out. Bodies that
// are stopped keep their shape while the joints are closed again without it.
bool Simulation::Impl::keep_bodies_whole(const std::vector<FreeMotion>& motions, double dt,
                                         std::vector<VecX>& y) {
  std::vector<char> stopped(bodies.size(), 0);
  for (bool again = true; again;) {
    if (!close_joints(motions, stopped, dt, y)) return false;
    again = false;
    for (std::size_t b = 0; b < bodies.size(); ++b)
      if (!stopped[b] && guard.stop(static_cast<int>(b), bodies[b], motions[b], dt, y[b]))
        stopped[b] = 1, again = again || reaction[b].size() > 0;
  }
  return true;
}

// Velocities of the position update that leave no gap in a joint; those that are stopped keep their
// modal rates. What that takes belongs to the joints' reaction.
bool Simulation::Impl::close_joints(const std::vector<FreeMotion>& motions,
                                    const std::vector<char>& stopped, double dt,
                                    std::vector<VecX>& y) {
  if (joints.empty()) return true;
  constexpr double kClosed = 1e-12, kGood = 1e-8;  // of the smallest jointed body
  double size = INFINITY;
  for (const Joint& joint : joints)
    for (const int b : {joint.a, joint.b})
      if (b >= 0) size = std::min(size, reach[b].rest);
  const PreStabilised kept = pre_stabilise(joints, bodies, motions, stopped, dt, kClosed * size, y);
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (kept.impulse[b].size() > 0 && reaction[b].size() > 0) reaction[b] += kept.impulse[b];
  if (kept.drift <= kGood * size) return true;
  open_joint = kept.widest, open_gap = kept.drift;
  return false;
}

// B^T f of each body's actuators, or empty. Both stages evaluate it at the middle of the step: with
// the trapezoidal rule the first then gives the modes (q̇ⁿ + q̇ⁿ⁺¹)/2, and work done is energy
// gained.
std::vector<VecX> Simulation::Impl::actuation(double t,
                                              const std::vector<Configuration>& at) const {
  std::vector<VecX> force(bodies.size());
  for (const Actuator& actuator : actuators) {
    const auto b = static_cast<std::size_t>(actuator.body);
    if (b >= bodies.size()) continue;  // has not appeared yet
    const ConfigurationTerms terms = configuration_terms(bodies[b], at[b], options.modal.mass);
    const VecX f = modal_force(actuator, t, bodies[b], at[b], terms);
    force[b] = force[b].size() > 0 ? VecX(force[b] + f) : f;
  }
  return force;
}

// Scheme::kSingle, before its solve: bodies move on with the velocity that they have, modes by
// their own implicit half step, so that stiff ones stay bounded. The water's surface moves with
// u^n.
void Simulation::Impl::predict_positions(double dt, std::vector<Configuration>& middle) {
  if (water.present()) water.start_single();
  std::vector<Configuration> now;
  for (const ReducedBody& body : bodies) now.push_back(current_configuration(body));
  const std::vector<VecX> driven = actuation(water.fluid.time + 0.5 * dt, now);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    ReducedBody& body = bodies[b];
    VecX force = VecX::Zero(body.dofs());
    if (driven[b].size() > 0) force.tail(body.r) = driven[b];
    const FreeMotion motion =
        free_motion(body, now[b], force, dt, Stage::kPositionHalf, options.modal);
    VecX y = motion.y_star;
    guard.stop(static_cast<int>(b), body, motion, dt, y);
    middle.push_back(guard.advance(static_cast<int>(b), body, motion, y, dt));
    held[b] = {};
  }
}

// Scheme::kSingle, after its solve: the step is taken again from x^n with the mean of old and new
// velocity (trapezoid), or the new one (backward Euler), the rule that the velocities were solved
// with.
void Simulation::Impl::correct_positions(double dt, const std::vector<ReducedBody>& start) {
  const bool mean = options.modal.step == ModalStep::kTrapezoid;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    ReducedBody moved = start[b];
    const ConfigurationTerms terms_n =
        configuration_terms(moved, current_configuration(moved), options.modal.mass);
    const ConfigurationTerms terms =
        configuration_terms(bodies[b], current_configuration(bodies[b]), options.modal.mass);
    VecX y = generalised_velocity(bodies[b], terms);
    if (mean) y = 0.5 * (y + generalised_velocity(moved, terms_n));
    FreeMotion motion;
    motion.terms = terms_n;
    motion.H = generalised_mass(moved, terms_n, dt, Stage::kVelocityFull, options.modal.step);
    guard.stop(static_cast<int>(b), moved, motion, dt, y);
    guard.advance(static_cast<int>(b), moved, motion, y, dt);
    bodies[b].position = moved.position;
    bodies[b].rotation = moved.rotation;
    if (drive[b].size() > 0) actuation_work += drive[b].dot(moved.q - start[b].q);
    bodies[b].q = moved.q;
  }
}

std::vector<double> Simulation::Impl::body_speeds() const {
  std::vector<double> speeds;
  for (const ReducedBody& b : bodies) speeds.push_back(largest_surface_speed(b));
  return speeds;
}

// Between the stages: bodies against each other, obstacles and walls. False when they sank into
// each other and a shorter step may keep them apart.
bool Simulation::Impl::resolve_body_contact(double dt, StepReport& report) {
  constexpr int kMostHalvings = 3;  // for that; an overlap is no failure
  split_impulses(reachable, reaction, dt, bodies);
  BodyContacts::Result met = body_contacts->resolve(bodies, body_speeds(), dt);
  touching = std::move(met.velocity_stage);
  const Penetration& p = met.penetration;
  report.contacts = p.touching;
  report.max_penetration = p.largest;
  report.mean_penetration = p.touching > 0 ? p.sum / p.touching : 0.0;
  if (options.scheme == Scheme::kSingle || options.on_fail == OnFail::kStop) return true;
  return report.halvings >= kMostHalvings || !body_contacts->sank_deeper(reachable, p);
}

// Section 6, contact between the stages [GBF03]: what bodies touch on x^{n+1} and v^n.
bool Simulation::Impl::resolve_contact(double dt, StepReport& report) {
  const double before = energy_of_bodies();
  const bool apart = resolve_contacts(dt, report);
  budget.add_contact_energy(energy_of_bodies() - before);
  return apart;
}

double Simulation::Impl::energy_of_bodies() const {
  double sum = 0.0;
  for (const ReducedBody& body : bodies) sum += kinetic_energy(body) + elastic_energy(body);
  return sum;
}

bool Simulation::Impl::resolve_contacts(double dt, StepReport& report) {
  if (body_contacts) {
    ScopedTimer timer(profile, "contact");
    return resolve_body_contact(dt, report);
  }
  if (!has_tank() || !options.wall_contact) return true;
  ScopedTimer timer(profile, "contact");
  WallContactOptions walls = wall_options(options, dt);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    walls.push_out = reaction[b].size() == 0;  // no joints
    if (held[b].points.empty() && away_from_walls(bodies[b], reach[b], walls)) continue;
    WallContactResult contact = resolve_wall_contacts(bodies[b], walls, held[b].points);
    report.contacts += contact.contacts;
    held[b] = std::move(contact.velocity_stage);
  }
  return true;
}

// Whether the body may come to a wall within the step.
bool Simulation::Impl::may_reach_wall(std::size_t b, double dt) const {
  if (body_contacts || !has_tank() || !options.wall_contact) return false;
  const double speed = largest_surface_speed(bodies[b]) + options.gravity.norm() * dt;
  return !away_from_walls(bodies[b], reach[b], wall_options(options, dt), 2.0 * speed * dt);
}

// Whether only gravity acts on the body while it meets nothing.
bool Simulation::Impl::only_gravity_acts(std::size_t b) const {
  const int n = static_cast<int>(b);
  const auto drives = [&](const Actuator& a) { return a.body == n; };
  const auto ties = [&](const Joint& j) { return j.a == n || j.b == n; };
  return obstacles.empty() && skins.empty() && std::none_of(joints.begin(), joints.end(), ties) &&
         std::none_of(actuators.begin(), actuators.end(), drives);
}

// How far body b may move in a step, m: so many cells as the CFL number says, and through air as
// far as it meets nothing: steps are for the water, which does not yet feel it.
double Simulation::Impl::largest_travel(std::size_t b, double water_top) const {
  constexpr double kClearance = 2.0;  // cells that are left
  const Grid& g = options.grid;
  const double least = options.cfl * g.dx;
  const Vec3& x = bodies[b].position;
  const double radius = farthest_point(bodies[b], reach[b]);
  if (!only_gravity_acts(b) || x[2] + radius <= water_top) return least;
  std::vector<Vec3> points;
  surface_points(bodies[b], points);
  double way = INFINITY;
  for (const Vec3& p : points) way = std::min(way, p[2] - water_top);
  for (int side = 0; side < 6; ++side) {
    if (options.open_side[side]) continue;
    const int axis = side / 2;
    const double gap = side % 2 == 0 ? x[axis] - g.low()[axis] : g.high()[axis] - x[axis];
    way = std::min(way, gap - radius);
  }
  for (std::size_t c = 0; body_contacts && c < bodies.size(); ++c) {
    if (c == b) continue;
    const double apart = (bodies[c].position - x).norm() - radius;
    way = std::min(way, 0.5 * (apart - farthest_point(bodies[c], reach[c])));
  }
  return std::max(least, way - kClearance * g.dx);
}

// Section 6, velocities: the water surface, advection, forces over the whole step, and the solve
// that ends it.
bool Simulation::Impl::advance_velocities(double dt, const std::vector<Configuration>& middle,
                                          const std::vector<std::vector<Vec3>>& read_points,
                                          StepReport& report) {
  drive = actuation(water.fluid.time + 0.5 * dt, middle);
  std::vector<StageBody> stage;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    stage.push_back({&bodies[b], middle[b], read_points[b], false, held[b], reaction[b], drive[b]});
  if (water.present()) {
    {
      ScopedTimer timer(profile, "surface");
      water.let_flow(dt, coupling);
      coupling.prepare_geometry(stage);
      water.move_surface(dt, coupling, step_count);
    }
    ScopedTimer timer(profile, "advection");
    water.advect_to_end(dt);
  }
  ScopedTimer timer(profile, "velocities");
  std::vector<StageResult> results;
  report.velocity =
      coupling.couple(Stage::kVelocityFull, dt, water.surface_now(dt), stage, water.u_star, results,
                      body_contacts ? &touching : nullptr, water.narrow_flow(), &water.held());
  if (!report.velocity.converged) return false;
  if (body_contacts) {
    profile.add("velocities", -coupling.contact_seconds());
    profile.add("contact", coupling.contact_seconds());
    body_contacts->memory.velocity = touching.forces;
    report.contact_sweeps += touching.sweeps;
  }
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (drive[b].size() > 0 && options.scheme == Scheme::kNewmark) {
      // f · (q̇ⁿ + q̇ⁿ⁺¹)/2 dt, or of the way that a held body went
      const VecX mean = 0.5 * (bodies[b].q_dot + results[b].y.tail(bodies[b].r));
      const bool went = guard.holds(static_cast<int>(b));
      actuation_work += dt * drive[b].dot(went ? middle[b].q_dot : mean);
    }
    accept_velocity(bodies[b], results[b].y, results[b].delta_P, results[b].delta_L);
    budget.add_water_impulse(impulse_at(bodies[b].position, results[b].water_impulse.head<3>(),
                                        results[b].water_impulse.segment<3>(3)));
    water_impulse[b] += results[b].water_impulse.head<3>();
    water_angular_impulse[b] += results[b].water_impulse.segment<3>(3);
  }
  if (water.present()) {
    water.after_velocity_solve(dt, coupling);
    report.divergence = coupling.last_divergence();
  }
  return true;
}

bool Simulation::Impl::attempt(double dt, StepReport& report) {
  guard.start_step();
  budget.start_attempt(bodies);
  open_joint = -1;
  std::vector<Configuration> middle;
  std::vector<std::vector<Vec3>> read_points;
  if (options.scheme == Scheme::kNewmark) {
    if (!advance_positions(dt, middle, read_points, report)) return false;
    if (broken_body(bodies) >= 0) return false;
    if (!resolve_contact(dt, report)) return false;
    if (!advance_velocities(dt, middle, read_points, report)) return false;
    stop_held();
    return true;
  }
  const std::vector<ReducedBody> start = bodies;
  read_points.resize(bodies.size());
  predict_positions(dt, middle);
  resolve_contact(dt, report);
  if (!advance_velocities(dt, middle, read_points, report)) return false;
  last_solved = bodies;
  correct_positions(dt, start);
  stop_held();
  return true;
}

void Simulation::Impl::stop_held() {
  if (guard.held().empty()) return;
  const double before = energy_of_bodies();
  guard.stop_held(bodies, options.modal.mass);
  budget.add_held_energy(energy_of_bodies() - before);
}

// What the columns of the budget need of the water.
void Simulation::Impl::add_water_budget(const SprayMotion& drops, BudgetKeeper::End& end) const {
  const double density = options.water_density;
  const WaterMoment inside = water_moment(water.grid(), water.held());
  end.before = coupling.motion_before(), end.after = coupling.motion_after();
  end.drops = {density * drops.momentum, density * drops.angular_momentum, density * drops.kinetic};
  end.solids = coupling.solid_impulse(), end.hydrostatic = coupling.hydrostatic_impulse();
  end.water_mass = density * inside.volume, end.water_moment = density * inside.moment;
  end.drop_mass = density * spray_volume(water.fluid.spray);
  end.drop_moment = density * drops.moment;
  end.unmatched = coupling.unmatched_impulse();
  end.drag_energy = water.drag_energy(), end.slowed_energy = water.slowed_energy();
}

void Simulation::Impl::fill_report(double dt, StepReport& r) {
  ScopedTimer timer(profile, "statistics");
  r.t = water.fluid.time;
  r.dt = dt;
  r.max_speed = 0.0;
  for (const ReducedBody& b : bodies) {
    add_body_statistics(b, options.gravity, r);
    r.max_speed = std::max(r.max_speed, largest_surface_speed(b));
  }
  BudgetKeeper::End end;
  if (water.present()) {
    add_water_statistics(options, water.grid(), water.fluid, coupling, r);
    r.outflow_volume = water.outflow;
    r.volume_refitted = water.refitted;
    r.volume_residual = water.residual_volume();
    r.spray_volume = spray_volume(water.fluid.spray);
    const SprayMotion drops = spray_motion(water.fluid.spray, options.gravity);
    r.spray_kinetic = options.water_density * drops.kinetic;
    r.spray_momentum = options.water_density * drops.momentum;
    r.spray_angular_momentum = options.water_density * drops.angular_momentum;
    r.potential += options.water_density * drops.potential;
    r.water_kinetic += water.slowed_energy();
    add_water_budget(drops, end);
  }
  end.energy = r.energy(), end.work = actuation_work;
  budget.end_step(dt, options.gravity, bodies, end);
  r.budget = budget.total();
  r.joint_drift = joint_drift(joints, bodies);
  r.held_bodies = guard.held();
  r.actuation_work = actuation_work;
  r.cfl = has_tank() ? r.max_speed * dt / options.grid.dx : 0.0;
}

// What a step that cannot be taken broke at: the joint that stays open, or the cell with most
// divergence left and the body nearest to it.
SimulationFailure Simulation::Impl::failure(double dt, const StepReport& report) const {
  Culprit culprit;
  std::ostringstream what;
  if (open_joint >= 0) {
    const Joint& joint = joints[open_joint];
    culprit.joint = open_joint, culprit.body = joint.a, culprit.other_body = joint.b;
    what << "a joint could not be closed: " << open_gap << " m are left (dt = " << dt << " s)";
    return {"joint", what.str(), water.fluid.time, culprit};
  }
  double nearest = INFINITY;
  if (water.present()) {
    culprit.cell = coupling.last_divergent_cell();
    const Vec3i& c = *culprit.cell;
    const Vec3 x = options.grid.cell_centre(c[0], c[1], c[2]);
    for (std::size_t b = 0; b < bodies.size(); ++b) {
      const double gap = (bodies[b].position - x).norm() - reach[b].rest;
      if (gap < nearest) nearest = gap, culprit.body = static_cast<int>(b);
    }
  }
  what << "the coupled solve did not converge (dt = " << dt << " s, residual "
       << std::max(report.position.residual, report.velocity.residual) << ", "
       << std::max(report.position.iterations, report.velocity.iterations) << " iterations)";
  return {"convergence", what.str(), water.fluid.time, culprit};
}

Simulation::Simulation(SimulationOptions options, FluidState initial,
                       std::vector<ReducedBody> bodies, std::vector<TriMesh> obstacles,
                       std::vector<double> release, std::vector<Joint> joints,
                       std::vector<SkinnedBodies> skins)
    : impl_(std::make_unique<Impl>(std::move(options), std::move(initial), std::move(bodies),
                                   std::move(obstacles), std::move(release), std::move(joints),
                                   std::move(skins))) {
  // one solve a step lacks the half step that keeps joints closed: their energy grew (measured)
  ARCHETIDE_CHECK(impl_->joints.empty() || impl_->options.scheme == Scheme::kNewmark);
  impl_->prepare();
}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;

double Simulation::stable_dt() const {
  const SimulationOptions& o = impl_->options;
  double dt = o.max_dt;
  if (o.grid.cells() == 0) return dt;
  const double g = o.gravity.norm();
  // speed dt + |g| dt^2 = way: what falls freely during the step counts as well
  const auto limit = [&](double speed, double way) {
    dt = std::min(dt, 2.0 * way / (speed + std::sqrt(speed * speed + 4.0 * g * way) + 1e-300));
  };
  const bool water = impl_->water.present();
  const double top = water ? impl_->water.top() : 0.0;
  for (std::size_t b = 0; b < impl_->bodies.size(); ++b)
    limit(largest_surface_speed(impl_->bodies[b]),
          water ? impl_->largest_travel(b, top) : o.cfl * o.grid.dx);
  constexpr double kRange = 8.0;  // more than water that was slowed down in a like step can want
  if (water)
    limit(speed_of_most(impl_->water.fluid.u, impl_->water.valid(), o.outrun, kRange),
          o.cfl * o.grid.dx);
  // Waves of one cell, k = pi / dx: omega dt = sqrt(pi) < 2, the limit of the explicit surface.
  if (impl_->water.present() && g > 0.0) dt = std::min(dt, std::sqrt(o.grid.dx / g));
  return dt;
}

StepReport Simulation::step(double dt) {
  Impl& s = *impl_;
  s.admit_bodies();
  s.fit_tank();
  StepReport before;
  before.t = s.water.fluid.time;
  demand_finite(s.bodies, s.water.fluid, before);
  // What a rejected attempt must give back. u^n is only replaced by a step that succeeds.
  const std::vector<ReducedBody> bodies = s.bodies;
  s.water.remember(s.water_before);
  const BodyContacts::Memory contact_memory =
      s.body_contacts ? s.body_contacts->memory : BodyContacts::Memory();

  constexpr int kMaxHalvings = 8;
  for (int halvings = 0;; ++halvings, dt *= 0.5) {
    StepReport report;
    report.halvings = halvings;
    if (s.attempt(dt, report)) {
      s.carry_markers(dt);
      s.water.last_dt = dt;
      s.water.fluid.time += dt;
      ++s.step_count;
      s.fill_report(dt, report);
      demand_finite(s.bodies, s.water.fluid, report);
      return report;
    }
    if (s.options.on_fail == OnFail::kStop || halvings == kMaxHalvings) throw s.failure(dt, report);
    s.bodies = bodies;
    s.water.restore(s.water_before);
    if (s.body_contacts) s.body_contacts->memory = contact_memory;
  }
}

void Simulation::visit_state(StateArchive& a) {
  ARCHETIDE_CHECK(!a.reading() || impl_->step_count == 0);
  impl_->visit_state(a);
}

void Simulation::set_actuators(std::vector<Actuator> actuators) {
  impl_->actuators = std::move(actuators);
}

double Simulation::time() const { return impl_->water.fluid.time; }
const SimulationOptions& Simulation::options() const { return impl_->options; }
const Grid& Simulation::grid() const { return impl_->water.grid(); }
const FluidState& Simulation::fluid() const { return impl_->water.fluid; }
const std::vector<ReducedBody>& Simulation::bodies() const { return impl_->bodies; }
std::vector<ReducedBody>& Simulation::bodies() { return impl_->bodies; }
std::vector<ReducedBody> Simulation::all_bodies() const {
  std::vector<ReducedBody> all = impl_->bodies;
  all.insert(all.end(), impl_->waiting.begin(), impl_->waiting.end());
  return all;
}
const std::vector<SkinnedBodies>& Simulation::skins() const { return impl_->skins; }
const Coupling& Simulation::coupling() const { return impl_->coupling; }
const std::vector<TriMesh>& Simulation::obstacles() const { return impl_->obstacles; }
const Vec3& Simulation::water_impulse(int b) const { return impl_->water_impulse[b]; }
const Vec3& Simulation::water_angular_impulse(int b) const {
  return impl_->water_angular_impulse[b];
}
void Simulation::reset_water_impulses() {
  for (Vec3& v : impl_->water_impulse) v.setZero();
  for (Vec3& v : impl_->water_angular_impulse) v.setZero();
}
const Profile& Simulation::profile() const { return impl_->profile; }

}  // namespace archetide
