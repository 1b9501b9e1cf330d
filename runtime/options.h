#pragma once

#include <optional>
#include <vector>

#include "runtime/coupling/coupling.h"
#include "runtime/fluid/damping.h"
#include "runtime/fluid/water_source.h"
#include "runtime/grid/grid.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

enum class Scheme { kNewmark, kSingle };  // two coupled solves a step (Section 6), or one [D4]
enum class OnFail { kHalveStep, kStop };

/// What is simulated, and how; the defaults are those of the scene file.
struct SimulationOptions {
  Grid grid;  // zero cells: no tank, no water (bodies in vacuum)
  bool has_water = false;
  double water_density = 1000.0;        // kg/m^3
  Vec3 gravity = Vec3(0, 0, -9.81);     // m/s^2
  Vec3 reference_point = Vec3::Zero();  // where p' = p; the result must not depend on it
  Sides open_side{};                    // open sides of the tank; others closed and free-slip
  Damping damping;                      // of the water's motion
  int particles_per_cell = 0;           // 0: plain level set
  bool spray = false;                   // water particles that come away fly as drops

  std::vector<WaterSource> sources = {};

  Geometry geometry = Geometry::kCutCell;
  double tolerance = 1e-8;  // relative residual of the coupled solve, 1e-14 .. 1e-2
  int max_iterations = 200;
  ModalOptions modal;
  Scheme scheme = Scheme::kNewmark;
  // Cells that the fastest water or body may cross in a step, 0.1 .. 10; a body that falls through
  // air as far as there is nothing to meet.
  double cfl = 1.0;
  // Share of the water that may go farther, up to 3 times that and 10 cells, and is slowed down to
  // it: where water closes over something a few faces make small steps for all.
  double outrun = 0.0;
  double max_dt = 1.0 / 24.0;  // s
  OnFail on_fail = OnFail::kHalveStep;

  bool wall_contact = true;   // surface points against the tank's closed sides
  bool body_contact = false;  // bodies against each other and against obstacles
  double restitution = 0.0, friction = 0.0;
  std::vector<std::optional<ContactMaterial>> obstacles = {};  // of each; absent: the two above
};

}  // namespace archetide
