#pragma once

#include <string>
#include <vector>

#include "runtime/scene/archetype_library.h"
#include "runtime/scene/deformation_forecast.h"
#include "runtime/scene/scene_spec.h"
#include "runtime/simulation.h"

namespace archetide {

/// Everything a Simulation starts from except the water's level set (large; initial_water.h makes
/// it).
struct BuiltScene {
  SimulationOptions options;
  std::vector<ReducedBody> bodies;
  std::vector<std::string> body_names;     // one per body
  std::vector<double> release;             // one per body, ascending: when it appears, s
  std::vector<TriMesh> obstacles;          // closed, outward, world frame
  std::vector<Joint> joints;               // of [[body]]s, which stand before the scattered ones
  std::vector<std::string> joint_names;    // one per joint
  std::vector<Actuator> actuators;         // of [[force]]s
  std::vector<ExternalLoad> loads;         // of [[external]]s
  std::vector<Spring> springs;             // of [[spring]]s; of [[body]]s, as joints
  std::vector<Motor> motors;               // of [[motor]]s; likewise
  std::vector<std::string> wavemakers;     // what each of them makes, a line
  std::vector<PrescribedBody> prescribed;  // [[static]]s that move; among the bodies of time 0
  std::vector<SkinnedBodies> skins;        // the same
  std::vector<DeformationForecast> forecasts;  // one per archetype with modes
  std::vector<std::string> notes;              // what the user should know, a line each
};

/// Throws FileError for archetypes that are missing or damaged, InputError for what does not fit
/// them.
BuiltScene build_scene(const SceneSpec& scene, ArchetypeLibrary& library);

/// The tank, the water and the method's options alone.
SimulationOptions simulation_options(const SceneSpec& scene);

/// `modes` of the archetype, and those stored beyond them that have the frequency of the last: the
/// directions within such a cluster are arbitrary, and a part of it is stiffer in some than in
/// others.
int whole_cluster(const Archetype& archetype, int modes);

/// One instance: pose, mass, P = m v, L = I w, modes (whole_cluster) at rest. Throws InputError when
/// it asks for more modes than are stored.
ReducedBody instantiate(const BodySpec& spec, std::shared_ptr<const Archetype> archetype);

/// build_scene, initial_fluid and the simulation itself.
Simulation make_simulation(BuiltScene built, const SceneSpec& scene);

}  // namespace archetide
