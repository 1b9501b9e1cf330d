#pragma once

#include <vector>

#include "runtime/contact/contact_search.h"
#include "runtime/contact/contact_system.h"

namespace archetide {

/// Speed that takes an overlap (m) back in steps of dt (s), m/s: at most half of it a step, and no
/// faster than falling out of it; without gravity (m/s^2) within about a tenth of a second.
double recovery_speed(double overlap, double dt, double gravity);

struct BodyContactOptions {
  double restitution = 0.0;  // 0 .. 1, of what has no material of its own
  double friction = 0.0;     // Coulomb's coefficient, likewise
  double tolerance = 0.0;    // m; closer points touch
  double gravity = 0.0;      // m/s^2
  ModalOptions modal;
  SearchOptions search;  // jointed bodies do not meet; skins
  /// Of the last items of the surroundings, the obstacles; absent: the scene's.
  std::vector<std::optional<ContactMaterial>> obstacles = {};
};

/// Contacts that a stage of the step holds, their least separating speeds, and what they pushed.
struct GroupContacts {
  std::vector<BodyContact> contacts;
  VecX target;                              // m/s
  std::vector<const ContactShape*> shapes;  // one per body
  /// After the position stage, where a body is nonlinear: every sample within reach of one, for
  /// keep_apart.
  std::vector<BodyContact> near;
  ContactForces start;  // of the last step
  ContactSolveOptions solve;
  ContactForces forces;  // result: those that push, sorted
  int sweeps = 0;        // result
};

/// How deep bodies stand in one another and in their surroundings.
struct Penetration {
  int touching = 0;
  double largest = 0.0, sum = 0.0;  // m, over the points that touch
};

/// Contact between bodies, and with walls and obstacles, for the two stages of a step and between
/// them.
///
///   position stage: y of the half step must not carry a point through its gap, and gently takes
///   back overlaps; it moves poses only, so overlaps never turn into momentum;
///   between: impacts on x^{n+1} and v^n, pair after pair with restitution until no pair approaches
///   (a chain hands an impact on), then all at once without;
///   velocity stage: points that touch do not approach, with friction.
class BodyContacts {
 public:
  BodyContacts(const BodyContactOptions& options, const std::vector<ReducedBody>& bodies,
               Surroundings surroundings);

  /// Contacts that the step may make from x^n. `speed`: of the fastest point of each body, m/s.
  GroupContacts reachable_contacts(const std::vector<ReducedBody>& bodies,
                                   const std::vector<double>& speed, double dt) const;

  struct Result {
    GroupContacts velocity_stage;
    Penetration penetration;
    double work = 0.0;  // of bodies that go as they are told on the others, J
  };
  /// Impacts change v^n of the bodies; P and L by exactly the impulses at the common points.
  Result resolve(std::vector<ReducedBody>& bodies, const std::vector<double>& speed,
                 double dt) const;

  /// Whether bodies stand much deeper in something than where the step began: thin parts that turn,
  /// or bend, come to lie against others than those that `reachable_contacts` found. `way`: what two
  /// surfaces may have come closer, m; what went deeper than that is no matter of the step.
  bool sank_deeper(const GroupContacts& reachable, const Penetration& now, double way) const;

  /// How deep the last of `bodies` stands in the first `others` of them, as they are bent, m.
  double depth_of_last(const std::vector<ReducedBody>& bodies, std::size_t others) const;

  /// What the contacts of the last step pushed, the first guess of the next: part of the state.
  struct Memory {
    ContactForces position, velocity;
  };
  Memory memory;

  std::size_t bytes() const { return library_.bytes(); }

 private:
  std::vector<BodyContact> find(const std::vector<ReducedBody>& bodies,
                                const std::vector<double>& speed, double dt,
                                const ContactForces& own, const ContactForces& other,
                                std::vector<BodyContact>* near = nullptr) const;
  double resting_speed(double dt) const;
  ContactMaterial material(const std::vector<ReducedBody>& bodies, int b) const;
  double restitution(const BodyContact& c) const;
  ContactSolveOptions solve_options(double dt) const;
  bool touches(const BodyContact& c) const { return c.gap <= options_.tolerance; }
  double closing_target(const BodyContact& c, double dt) const;
  double impacts(std::vector<ReducedBody>& bodies, const std::vector<BodyContact>& touching,
                 double dt) const;

  BodyContactOptions options_;
  Surroundings surroundings_;
  ShapeLibrary library_;
  std::vector<const ContactShape*> shapes_;
};

/// lambda (frame, N s) of a stage of length h as forces.
ContactForces contact_forces(const std::vector<BodyContact>& contacts, const ContactSystem& system,
                             const std::vector<Vec3>& lambda, double h);
/// The other way round: first guesses for these contacts.
std::vector<Vec3> contact_impulses(const std::vector<BodyContact>& contacts,
                                   const ContactSystem& system, const ContactForces& forces,
                                   double h);

}  // namespace archetide
