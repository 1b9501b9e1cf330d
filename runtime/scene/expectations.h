#pragma once

#include <string>
#include <vector>

#include "runtime/scene/scene_spec.h"
#include "runtime/simulation.h"

namespace archetide {

/// Volume of water and spray against that of the first step.
class VolumeDrift {
 public:
  /// StepReport::volume_drift since the first step that it saw.
  double observe(const StepReport& report);
  void visit_state(StateArchive& a, const std::string& name) { a.field(name, first_); }

 private:
  double first_ = -1.0;  // V0, m^3; negative: not seen yet
};

/// Height of the calm surface when every body floats or lies on the floor, m.
double calm_level(const SimulationOptions& options, double water_volume,
                  const std::vector<ReducedBody>& bodies);

struct ExpectationResult {
  bool pass = false;
  std::string text;  // "PASS expect.volume_drift: 0.0012, at most 0.05"
};

/// A closed form of the scene's [expect] and what the run came to.
struct ClosedForm {
  std::string key;                // "expect.body[0].draft"
  double value = 0.0, exact = 0;  // m
  double size = 0.0;              // of the body: cube root of its volume, m
};

/// Watches a run and judges the scene's [expect] at its end.
class Expectations {
 public:
  Expectations(ExpectSpec spec, double end_time);

  void observe(const StepReport& report, const Simulation& simulation);
  std::vector<ExpectationResult> evaluate() const;
  std::vector<ClosedForm> closed_forms() const;
  void visit_state(StateArchive& a);

 private:
  // Time averages of one body over its window.
  struct BodyMeans {
    double seconds = 0.0;  // s
    double z = 0.0;        // integral of height, m s
    double speed = 0.0;    // integral of speed, m
    double draft = 0.0;    // integral of the level above the lowest point, m s
    double size = 0.0;     // cube root of the volume, m
  };

  ExpectSpec spec_;
  double end_time_;  // s
  VolumeDrift drift_;
  double worst_drift_ = 0.0, largest_deformation_ = 0.0;
  int most_iterations_ = 0;
  std::vector<BodyMeans> means_;  // one per spec_.bodies
};

}  // namespace archetide
