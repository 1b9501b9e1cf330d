#pragma once

#include <string>

#include "common/archetype/skin.h"
#include "common/base/profile.h"
#include "precompute/recipe.h"

namespace archetide {

/// Body file with a [skin] -> skin. Reads the surface and the parts' body files, for their cuts;
/// the parts need not be built. Throws InputError when a part is not cut out of this surface, when
/// a vertex belongs to no part, or a part has no vertex.
Skin build_skin(const Recipe& recipe, Profile& profile);

/// What `info` prints about a skin; file_bytes 0: it is no file yet (`check`).
std::string skin_text(const Skin& skin, std::size_t file_bytes);
std::string skin_json(const Skin& skin, std::size_t file_bytes);

}  // namespace archetide
