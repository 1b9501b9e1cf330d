// Validates a scene and lists what is on.

#include <fmt/core.h>
#include <iomanip>
#include <iostream>

#include "common/base/number_text.h"
#include "runtime/commands/command.h"
#include "runtime/output/run_description.h"
#include "runtime/output/run_writer.h"
#include "runtime/scene/initial_water.h"
#include "runtime/scene/run_loop.h"
#include "runtime/scene/scene_builder.h"
#include "runtime/water_step.h"

namespace archetide {
namespace {

template <class Value>
void line(const std::string& name, const Value& value) {
  std::cout << std::left << std::setw(14) << name << value << '\n';
}

void list_time_and_cells(const SceneSpec& scene, const Grid& grid) {
  line("scene", scene.name + " (" + scene.file + ")");
  line("time",
       fmt::format("{:f} s, {} frames", scene.end_time, frame_count(scene.end_time, scene.fps)));
  line("cells", fmt::format("{} ({} x {} x {})", grid.cells(), grid.nx, grid.ny, grid.nz));
}

// `fields`: the part of the tank that has fields.
void list_water(const SceneSpec& scene, const SimulationOptions& o, const Grid& fields) {
  line("water", !o.has_water              ? "none"
                : scene.fluid->water.full ? "the tank is full, no free surface"
                                          : "free surface");
  if (fields.nz < o.grid.nz)
    line("fields", fmt::format("the lowest {} layers, as far as the water needs", fields.nz));
  line("particles", o.particles_per_cell ? fmt::format("{} per cell{}", o.particles_per_cell,
                                                       o.spray ? ", spray" : "")
                                         : "none");
  line("damping", damping_text(o.damping));
  line("geometry", o.geometry == Geometry::kCutCell ? "cut-cell" : "voxel");
  line("scheme", o.scheme == Scheme::kNewmark ? "newmark (two solves)" : "single");
}

void list_bodies(const BuiltScene& built) {
  line("bodies", built.bodies.size());
  for (std::size_t b = 0; b < built.bodies.size(); ++b) {
    const ReducedBody& body = built.bodies[b];
    log_detail(fmt::format("  body {} {}: {:f} kg, {} modes", b, built.body_names[b],
                           body.archetype->integrals.mass * body.mass_scale, body.r));
  }
  for (const DeformationForecast& kind : built.forecasts) line("deformation", forecast_text(kind));
  line("joints", built.joints.size());
  line("skins", built.skins.size());
  for (const std::string& text : coarser_surfaces(built.bodies, built.skins))
    line("surface", "the water meets of " + text + " triangles");
  line("obstacles", built.obstacles.size());
  for (const std::string& text : built.wavemakers) line("wave maker", text);
  line("actuators", built.actuators.size());
  line("loads", built.loads.size());
  line("springs", built.springs.size());
  line("motors", built.motors.size());
}

void list_outputs(const SceneSpec& scene) {
  int markers = 0;
  for (const MarkersSpec& spec : scene.markers) markers += spec.count;
  line("markers", markers);
  line("gauges", scene.gauges.size());
  line("sources", scene.sources.size());
  line("checkpoints", scene.checkpoints ? fmt::format("every {} frames", scene.checkpoint_every)
                                        : "when it is stopped");
}

int check(const Arguments& a) {
  const SceneSpec scene = read_scene(a);
  ArchetypeLibrary library(scene.directory, a.archetypes);
  const BuiltScene built = build_scene(scene, library);
  const Grid fields = field_grid(built.options, initial_fluid(scene.fluid));
  const MemoryEstimate memory = estimate_memory(built.options, fields, built.bodies);
  list_time_and_cells(scene, built.options.grid);
  list_water(scene, built.options, fields);
  list_bodies(built);
  list_outputs(scene);
  for (const std::string& note : built.notes) line("note", note);
  line("memory", bytes_text(memory.total()) + " (water " + bytes_text(memory.water) + ", bodies " +
                     bytes_text(memory.bodies) + ", archetypes " + bytes_text(memory.archetypes) +
                     ")" + memory_at_the_lid(built.options, fields, built.bodies));
  return kExitDone;
}

}  // namespace

SimCommand check_command() {
  return {"check",
          "validate a scene, list what is on, estimate cells and memory",
          {"check assets/scenes/tub.scene.toml", "check assets/scenes/tub.scene.toml -v"},
          check,
          scene_options};
}

}  // namespace archetide
