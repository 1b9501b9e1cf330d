#pragma once

#include <memory>
#include <vector>

#include "runtime/articulation/joint.h"
#include "runtime/articulation/skinning.h"
#include "runtime/contact/body_contacts.h"
#include "runtime/contact/wall_contact.h"
#include "runtime/options.h"

namespace archetide {

/// Contact with the closed sides of the tank during a step of dt (s).
WallContactOptions wall_options(const SimulationOptions& options, double dt);

/// Contact between bodies and with obstacles, of skins with walls in any case; null if the scene
/// has nothing that may touch, and each body alone meets the walls.
std::unique_ptr<BodyContacts> make_body_contacts(const SimulationOptions& options,
                                                 const std::vector<ReducedBody>& bodies,
                                                 const std::vector<TriMesh>& obstacles,
                                                 const std::vector<Joint>& joints,
                                                 const std::vector<SkinnedBodies>& skins);

}  // namespace archetide
