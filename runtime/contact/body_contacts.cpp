#include "runtime/contact/body_contacts.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <tuple>

namespace archetide {
namespace {

constexpr double kSlack =
    0.1;  // of the tolerance: overlap that is left alone, or rest would jitter

/// One system's worth of configuration terms and masses, for the bodies that have contacts; y of a
/// body of nodes in the coordinates of its contacts.
struct Masses {
  std::vector<ConfigurationTerms> terms;
  std::vector<GeneralisedMass> H;
  std::vector<ContactBody> bodies;
  std::vector<VecX> y;
  RowsOfNodes nodes;
};

/// Rows of the bodies of nodes, and their velocities there.
void take_rows(const std::vector<BodyContact>& contacts, Masses& m) {
  add_rows(contacts, m.bodies);
  std::vector<const GeneralisedMass*> H;
  for (const GeneralisedMass& mass : m.H) H.push_back(&mass);
  set_inverses(H, m.nodes);
  for (std::size_t b = 0; b < m.nodes.size(); ++b)
    if (m.nodes[b]) m.y[b] = m.nodes[b]->velocity(m.y[b]);
}

/// Changes of the velocities of bodies of nodes, 6 + 3 n, by these impulses; of others empty.
std::vector<VecX> answers_of_nodes(const Masses& m, const ContactSystem& system,
                                   const std::vector<Vec3>& impulses) {
  std::vector<VecX> changes(m.bodies.size());
  if (std::none_of(m.nodes.begin(), m.nodes.end(), [](const auto& n) { return n != nullptr; }))
    return changes;
  std::vector<VecX> given(m.bodies.size());
  for (std::size_t b = 0; b < given.size(); ++b)
    if (m.bodies[b].body) given[b] = VecX::Zero(m.y[b].size());
  for (std::size_t k = 0; k < impulses.size(); ++k) system.add_impulse(k, impulses[k], given);
  for (std::size_t b = 0; b < given.size(); ++b)
    if (m.nodes[b]) changes[b] = m.nodes[b]->answer(given[b]);
  return changes;
}

Masses masses_of(const std::vector<ReducedBody>& bodies,
                 const std::vector<const ContactShape*>& shapes,
                 const std::vector<BodyContact>& contacts, double dt, const ModalOptions& modal) {
  Masses m;
  const std::size_t n = bodies.size();
  m.terms.resize(n), m.H.resize(n), m.bodies.resize(n), m.y.resize(n), m.nodes.resize(n);
  std::vector<char> used(n, 0);
  for (const BodyContact& c : contacts) {
    used[c.a] = 1;
    if (c.b >= 0) used[c.b] = 1;
  }
  for (std::size_t b = 0; b < n; ++b) {
    if (!used[b]) continue;
    m.terms[b] = configuration_terms(bodies[b], current_configuration(bodies[b]), modal.mass);
    m.H[b] = generalised_mass(bodies[b], m.terms[b], dt, Stage::kVelocityFull, modal.step);
    if (bodies[b].nodes) m.nodes[b] = std::make_unique<NodalRows>(bodies[b], m.terms[b]);
    m.bodies[b] = {&bodies[b], shapes[b], &m.terms[b], &m.H[b], nullptr, m.nodes[b].get()};
    m.y[b] = generalised_velocity(bodies[b], m.terms[b]);
  }
  take_rows(contacts, m);
  return m;
}

/// Contacts of each unordered pair, in order.
std::vector<std::vector<std::size_t>> by_pair(const std::vector<BodyContact>& contacts) {
  std::map<std::pair<int, int>, std::vector<std::size_t>> pairs;
  for (std::size_t k = 0; k < contacts.size(); ++k)
    pairs[std::minmax(contacts[k].a, contacts[k].b)].push_back(k);
  std::vector<std::vector<std::size_t>> out;
  for (auto& [pair, list] : pairs) out.push_back(std::move(list));
  return out;
}

/// Overlaps (negative gaps) of each body with surroundings that pinch it from two sides: what
/// cannot move cannot be left on both sides, so the body takes the middle; taking both overlaps
/// back would press without bound, and friction with it hold the body in its place.
void share_pinches(std::vector<BodyContact>& contacts) {
  constexpr double kFacing = -0.7;  // cosine of the normals of two sides
  std::vector<BodyContact*> overlaps;
  for (BodyContact& c : contacts)
    if (c.b < 0 && c.gap < 0.0) overlaps.push_back(&c);
  std::vector<double> opposed(overlaps.size(), 0.0);  // gap of the deepest one that faces it, m
  for (std::size_t k = 0; k < overlaps.size(); ++k)
    for (const BodyContact* d : overlaps)
      if (d->a == overlaps[k]->a && d->normal.dot(overlaps[k]->normal) < kFacing)
        opposed[k] = std::min(opposed[k], d->gap);
  for (std::size_t k = 0; k < overlaps.size(); ++k)
    if (opposed[k] < 0.0) overlaps[k]->gap = std::min(0.0, 0.5 * (overlaps[k]->gap - opposed[k]));
}

bool in_order(const ContactForce& p, const ContactForce& q) {
  return std::tie(p.a, p.b, p.sample) < std::tie(q.a, q.b, q.sample);
}

/// Those of `own` and, between bodies no faster than this, of `other`; sorted as these are.
ContactForces either(const ContactForces& own, const ContactForces& other,
                     const std::vector<double>& speed, double slow) {
  const auto rests = [&](int b) { return b < 0 || speed[b] < slow; };
  ContactForces resting, both;
  std::copy_if(other.begin(), other.end(), std::back_inserter(resting),
               [&](const ContactForce& f) { return rests(f.a) && rests(f.b); });
  std::set_union(own.begin(), own.end(), resting.begin(), resting.end(), std::back_inserter(both),
                 in_order);
  return both;
}

}  // namespace

double recovery_speed(double overlap, double dt, double gravity) {
  constexpr double kPart = 0.5, kSeconds = 0.1;
  return std::min(kPart * overlap / dt,
                  gravity > 0.0 ? 0.5 * std::sqrt(2.0 * gravity * overlap) : overlap / kSeconds);
}

ContactForces contact_forces(const std::vector<BodyContact>& contacts, const ContactSystem& system,
                             const std::vector<Vec3>& lambda, double h) {
  ContactForces forces;
  for (std::size_t k = 0; k < contacts.size(); ++k)
    if (lambda[k][0] > 0.0)
      forces.push_back({contacts[k].a, contacts[k].b, contacts[k].sample,
                        system.rows()[k].frame.transpose() * lambda[k] / h});
  std::sort(forces.begin(), forces.end(), in_order);
  return forces;
}

std::vector<Vec3> contact_impulses(const std::vector<BodyContact>& contacts,
                                   const ContactSystem& system, const ContactForces& forces,
                                   double h) {
  std::vector<Vec3> lambda(contacts.size(), Vec3::Zero());
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const ContactForce* f = find_force(forces, contacts[k].a, contacts[k].b, contacts[k].sample);
    if (!f) continue;
    const Vec3 guess = h * (system.rows()[k].frame * f->force);
    if (guess[0] > 0.0) lambda[k] = guess;
  }
  return lambda;
}

BodyContacts::BodyContacts(const BodyContactOptions& options,
                           const std::vector<ReducedBody>& bodies, Surroundings surroundings)
    : options_(options), surroundings_(std::move(surroundings)) {
  shapes_.resize(bodies.size(), nullptr);
  for (const ContactCover& cover : options_.search.covers)
    for (std::size_t k = 0; k < cover.bodies.size(); ++k)
      shapes_[cover.bodies[k]] = cover.shape->shapes[k].get();
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (!shapes_[b]) shapes_[b] = &library_.of(bodies[b]);
}

// Of bodies at rest, what pressed in either stage stays in both: what points hold in one stage alone
// has a velocity in the other that never ends and leads nowhere [D69].
std::vector<BodyContact> BodyContacts::find(const std::vector<ReducedBody>& bodies,
                                            const std::vector<double>& speed, double dt,
                                            const ContactForces& own, const ContactForces& other,
                                            std::vector<BodyContact>* near) const {
  std::vector<double> fastest = speed;
  for (const ContactCover& cover : options_.search.covers) {
    double most = 0.0;  // a point of a cover is no faster than what moves it
    for (const int b : cover.bodies) most = std::max(most, speed[b]);
    for (const int b : cover.bodies) fastest[b] = most;
  }
  std::vector<double> margin;
  for (const double v : fastest)
    margin.push_back(options_.tolerance + dt * (v + options_.gravity * dt));
  std::vector<BodyContact> found =
      find_contacts(bodies, shapes_, surroundings_, margin,
                    either(own, other, speed, resting_speed(dt)), options_.search, dt, near);
  for (BodyContact& c : found)
    c.material = pair_material(material(bodies, c.a), material(bodies, c.b));
  return found;
}

// Of a body, or of the wall or obstacle -1 - b.
ContactMaterial BodyContacts::material(const std::vector<ReducedBody>& bodies, int b) const {
  const ContactMaterial of_scene{options_.restitution, options_.friction};
  if (b >= 0) return bodies[b].contact.value_or(of_scene);
  const auto walls =
      static_cast<int>(surroundings_.items().size()) - static_cast<int>(options_.obstacles.size());
  const int obstacle = -1 - b - walls;
  return obstacle < 0 ? of_scene : options_.obstacles[obstacle].value_or(of_scene);
}

double BodyContacts::restitution(const BodyContact& c) const {
  return c.material ? c.material->restitution : options_.restitution;
}

double BodyContacts::resting_speed(double dt) const {
  return std::max(std::sqrt(2.0 * options_.gravity * options_.tolerance),
                  2.0 * options_.gravity * dt);
}

// Redundant points with normals that differ in their last digits never quite agree on their shares:
// what moves nothing by more than a part of what gravity adds in a step is left (60 s of it are
// 6e-6 m at dt = 0.01 s, and where nothing moves the first guess is already right).
ContactSolveOptions BodyContacts::solve_options(double dt) const {
  constexpr double kStill = 1e-6;
  ContactSolveOptions solve;
  solve.friction = options_.friction;
  solve.still = kStill * options_.gravity * dt;
  return solve;
}

// A point may close its gap within the step and no more; one that touches stays, so that points
// which lie equally well do not compete for the last digits of their gaps; an overlap is taken
// back.
double BodyContacts::closing_target(const BodyContact& c, double dt) const {
  const double slack = kSlack * options_.tolerance;
  if (std::abs(c.gap) <= slack) return 0.0;
  if (c.gap > 0.0) return -(c.gap - slack + (touches(c) ? 0.0 : c.clearance)) / dt;
  return recovery_speed(-c.gap - slack, dt, options_.gravity);
}

double BodyContacts::depth_of_last(const std::vector<ReducedBody>& bodies,
                                   std::size_t others) const {
  const int last = static_cast<int>(bodies.size()) - 1;
  double depth = 0.0;
  for (const BodyContact& c : find(bodies, std::vector<double>(bodies.size(), 0.0), 0.0, {}, {})) {
    const auto [one, other] = std::minmax(c.a, c.b);
    if (other == last && one >= 0 && one < static_cast<int>(others))
      depth = std::max(depth, -c.gap);
  }
  return depth;
}

bool BodyContacts::sank_deeper(const GroupContacts& reachable, const Penetration& now,
                               double way) const {
  constexpr double kDeeper = 250.0;  // tolerances, a quarter of a cell: half of what is allowed
  constexpr double kBeyond = 0.2;    // of that where more than is allowed is left
  const double deeper = kDeeper * options_.tolerance;
  double before = 0.0;
  for (const BodyContact& c : reachable.contacts) before = std::max(before, -c.gap);
  const double share = now.largest > 2.0 * deeper ? kBeyond : 1.0;
  return way > deeper && now.largest > before + share * deeper;
}

GroupContacts BodyContacts::reachable_contacts(const std::vector<ReducedBody>& bodies,
                                               const std::vector<double>& speed, double dt) const {
  GroupContacts out;
  out.contacts = find(bodies, speed, dt, memory.position, memory.velocity);
  share_pinches(out.contacts);
  out.shapes = shapes_;
  out.start = memory.position;
  out.solve = solve_options(dt);
  out.target.resize(static_cast<long>(out.contacts.size()));
  for (std::size_t k = 0; k < out.contacts.size(); ++k) {
    out.target[static_cast<long>(k)] = closing_target(out.contacts[k], dt);
  }
  return out;
}

BodyContacts::Result BodyContacts::resolve(std::vector<ReducedBody>& bodies,
                                           const std::vector<double>& speed, double dt) const {
  Result out;
  const std::vector<BodyContact> all =
      find(bodies, speed, dt, memory.velocity, memory.position, &out.velocity_stage.near);
  std::vector<BodyContact> touching;
  for (const BodyContact& c : all) {
    if (!touches(c)) continue;
    touching.push_back(c);
    ++out.penetration.touching;
    out.penetration.largest = std::max(out.penetration.largest, -c.gap);
    out.penetration.sum += std::max(-c.gap, 0.0);
  }
  if (!touching.empty()) out.work = impacts(bodies, touching, dt);

  // where bodies bounce, a point that will touch with speed must keep it
  GroupContacts& held = out.velocity_stage;
  std::vector<double> target;
  for (const BodyContact& c : all) {
    if (!touches(c) && restitution(c) > 0.0 && c.gap / dt > resting_speed(dt)) continue;
    held.contacts.push_back(c);
    target.push_back(touches(c) ? 0.0 : -(c.gap + c.clearance) / dt);
  }
  held.target = Eigen::Map<const VecX>(target.data(), static_cast<long>(target.size()));
  held.shapes = shapes_;
  held.start = memory.velocity;
  held.solve = solve_options(dt);
  return out;
}

double BodyContacts::impacts(std::vector<ReducedBody>& bodies,
                             const std::vector<BodyContact>& touching, double dt) const {
  constexpr int kRounds = 50;
  Masses m = masses_of(bodies, shapes_, touching, dt, options_.modal);
  const std::vector<VecX> before = m.y;
  const ContactSystem system(touching, m.bodies);
  const double resting = resting_speed(dt);
  const ContactSolveOptions solve = solve_options(dt);
  std::vector<Vec3> total(touching.size(), Vec3::Zero());
  VecX target = VecX::Zero(static_cast<long>(touching.size()));

  // pair after pair, so that a row of balls hands the impact on
  const std::vector<std::vector<std::size_t>> pairs = by_pair(touching);
  std::vector<Vec3> lambda(touching.size(), Vec3::Zero());
  bool met = std::any_of(touching.begin(), touching.end(),
                         [&](const BodyContact& c) { return restitution(c) > 0.0; });
  for (int round = 0; met && round < kRounds; ++round) {
    met = false;
    for (const std::vector<std::size_t>& pair : pairs) {
      bool approaching = false;
      for (const std::size_t k : pair) {
        const double v = system.velocity(k, m.y)[0];
        target[static_cast<long>(k)] = v < -resting ? -restitution(touching[k]) * v : 0.0;
        approaching = approaching || v < -resting;
      }
      if (!approaching) continue;
      met = true;
      for (const std::size_t k : pair) lambda[k].setZero();
      system.solve(target, solve, pair, lambda, m.y);
      for (const std::size_t k : pair) total[k] += lambda[k];
    }
  }
  // what is left, all at once and without bounce
  lambda.assign(touching.size(), Vec3::Zero());
  target.setZero();
  system.solve(target, solve, lambda, m.y);
  for (std::size_t k = 0; k < touching.size(); ++k) total[k] += lambda[k];

  std::vector<Vec3> delta_P(bodies.size(), Vec3::Zero()), delta_L = delta_P;
  system.add_momenta(total, touching, m.bodies, delta_P, delta_L);
  const std::vector<VecX> of_nodes = answers_of_nodes(m, system, total);
  double work = 0.0;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (m.bodies[b].body && bodies[b].prescribed)
      work -= delta_P[b].dot(m.y[b].head<3>()) + delta_L[b].dot(m.y[b].segment<3>(3));
    if (!m.bodies[b].body || m.y[b] == before[b]) continue;
    const VecX y =
        m.nodes[b] ? VecX(generalised_velocity(bodies[b], m.terms[b]) + of_nodes[b]) : m.y[b];
    accept_velocity(bodies[b], y, delta_P[b], delta_L[b]);
  }
  return work;
}

}  // namespace archetide
