#pragma once

#include <functional>

#include "runtime/failure.h"
#include "runtime/scene/expectations.h"
#include "runtime/scene/scene_spec.h"
#include "runtime/simulation.h"

namespace archetide {

/// Watches a run; crossing a limit of the scene's [limits] is a SimulationFailure.
class LimitWatch {
 public:
  explicit LimitWatch(LimitSpec spec) : spec_(spec) {}

  /// After every step.
  void observe(const StepReport& report, const Simulation& simulation);
  /// What the limits compare with.
  void visit_state(StateArchive& a);

 private:
  double energy_growth(const StepReport& report, const Simulation& simulation);

  LimitSpec spec_;
  VolumeDrift drift_;
  // Energy at the start, with that of bodies that have appeared; after the last step; largest
  // kinetic and elastic energy so far, J. NaN: no step yet.
  double energy_start_ = std::numeric_limits<double>::quiet_NaN(), energy_before_ = 0.0,
         energy_scale_ = 0.0;
  int bodies_before_ = 0;
};

/// The fastest water face (its cell) or body.
Culprit fastest(const Simulation& simulation);
/// The most deformed body, and its mode with the largest displacement.
Culprit most_deformed(const Simulation& simulation);

}  // namespace archetide
