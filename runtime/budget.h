#pragma once

#include <vector>

#include "common/state_file.h"
#include "runtime/coupling/impulses.h"
#include "runtime/coupling/water_motion.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// Where momentum and energy of water, drops and bodies come from and go to, since the start (of
/// the first step's end on): P = P(0) + solids.P + weight.P + contact + transported.P.
struct Budget {
  Motion transported;  // what moving the water through the grid, and fluid.drag, has changed
  Impulse solids;      // of the pressure on the tank's sides and the obstacles, hydrostatic as well
  Impulse weight;      // of gravity on water, drops and bodies
  Vec3 contact = Vec3::Zero();  // of contacts and joints with what stands still, N s
  double contact_energy = 0.0;  // that contacts between the stages have changed, J

  Budget& operator+=(const Budget& step);
  void visit_state(StateArchive& a);
};

/// Collects a Budget, step by step; an attempt that is given up leaves nothing.
class BudgetKeeper {
 public:
  void start_attempt(const std::vector<ReducedBody>& bodies);
  void add_contact_energy(double joules) { step_.contact_energy += joules; }
  /// Impulse of the water on a body in the velocity stage, N s.
  void add_water_impulse(const Vec3& P) { from_water_ += P; }

  /// What a step of dt leaves: motion of the water before and after its velocity stage and of the
  /// drops, p' of solids, hydrostatic impulse (Coupling), mass of the water (kg) and its first
  /// moment (kg m), and mass of the drops.
  struct End {
    Motion before, after, drops;
    Impulse solids, hydrostatic;
    double water_mass = 0.0, drop_mass = 0.0;
    Vec3 water_moment = Vec3::Zero(), drop_moment = Vec3::Zero();
  };
  void end_step(double dt, const Vec3& gravity, const std::vector<ReducedBody>& bodies,
                const End& end);

  const Budget& total() const { return total_; }
  void visit_state(StateArchive& a);

 private:
  Budget total_, step_;
  Motion last_;                      // water and drops after the last step
  double last_drops_ = 0.0;          // kg
  Vec3 last_moment_ = Vec3::Zero();  // kg m, of the drops
  Vec3 bodies_before_ = Vec3::Zero(), from_water_ = Vec3::Zero();  // N s
  bool started_ = false;
};

}  // namespace archetide
