#pragma once

#include <map>
#include <memory>
#include <vector>

#include "runtime/solid/inversion_limit.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// Keeps bodies from turning inside out while they step [D33]. Modes only: linear and angular
/// momentum stay as they are, elastic energy and the modes' kinetic energy can only fall. Costs
/// nothing for rigid bodies, O(r) a step for others that are far from the limit.
class InversionGuard {
 public:
  /// Forgets who was held. The other functions are for these bodies; const ones on any thread.
  void start_step(const std::vector<ReducedBody>& bodies);

  /// Directions (r x k, or empty) in which a step with y (6 + r) would lead beyond the limit from a
  /// place that is already there: for Configuration::locked, so that what surrounds the body meets
  /// modes that do not move. All directions if others press on the body and much of its way would be
  /// cut off: it would not make the room that they were given.
  MatX closing(const ReducedBody& body, const FreeMotion& stage, const VecX& y, double dt,
               bool pressed) const;

  /// Whether a step with y (6 + r) would lead beyond the limit.
  bool beyond(const ReducedBody& body, double dt, const VecX& y) const;

  /// Shortens the way of the modes with y (6 + r) to the largest share of q + dt q_dot that is
  /// allowed, which is returned.
  double shorten(const ReducedBody& body, double dt, VecX& y) const;

  /// Modal rates of y (6 + r) that lead no further than the limit: to s (q + dt q_dot) with the
  /// largest s <= 1 that is allowed. If s < 1 body b is held, and true is returned.
  bool stop(int b, const ReducedBody& body, const FreeMotion& stage, double dt, VecX& y);

  /// Modal rates of a body that was stopped become 0: its shape stays.
  void halt(int b, const ReducedBody& body, const FreeMotion& stage, double dt, VecX& y);

  /// advance_pose of a body that may have been stopped. `locked`: directions that the stage was
  /// solved with; if there are any the body is held too. The configuration that is returned keeps
  /// the velocity stage from closing further what stands at the limit of a held body.
  Configuration advance(int b, ReducedBody& body, const FreeMotion& stage, const VecX& y, double dt,
                        const MatX& locked = MatX());

  /// At the end of the step: takes from the held bodies' modal rates what goes on closing elements,
  /// and the energy that they have from the way that they were not allowed to go.
  void stop_held(std::vector<ReducedBody>& bodies, ModalMass mass) const;

  /// Bodies that were held in this step, ascending.
  std::vector<int> held() const;
  bool holds(int b) const { return held_.count(b) > 0; }

 private:
  const InversionLimit& limit(const ReducedBody& body) const;
  /// Share of the coordinates at which a step with y (6 + r) would end that the limit allows; 1: all.
  double allowed_share(const ReducedBody& body, double dt, const VecX& y) const;

  std::map<std::shared_ptr<const Archetype>, std::unique_ptr<InversionLimit>> limits_;
  struct Held {
    double excess = 0.0;  // work on the part of its way that was cut off, J
    VecX q_dot = VecX();  // that it was stopped at, 1/s; empty: only locked
  };
  std::map<int, Held> held_;  // by body
};

}  // namespace archetide
