#pragma once

#include "common/files/state_file.h"
#include "runtime/contact/body_contacts.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// Pose, momenta and modal state of bodies, side by side; how many there are is the scene's.
void body_fields(StateArchive& a, const std::string& name, std::vector<ReducedBody>& bodies);

/// What contacts pushed.
void contact_fields(StateArchive& a, const std::string& name, ContactForces& forces);

}  // namespace archetide
