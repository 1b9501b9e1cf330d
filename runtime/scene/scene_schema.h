#pragma once

#include "common/params/schema.h"

namespace archetide {

/// Every key of a scene file: type, unit, range, default, meaning.
const Schema& scene_schema();

}  // namespace archetide
