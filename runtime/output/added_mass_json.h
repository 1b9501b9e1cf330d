#pragma once

#include <string>

#include "runtime/added_mass.h"

namespace archetide {

/// What `added-mass` prints.
std::string added_mass_json(const ReducedBody& body, const AddedMassTank& tank,
                            const AddedMass& found);

}  // namespace archetide
