#pragma once

#include <string>
#include <vector>

#include "runtime/scene/scene_spec.h"

namespace archetide {

/// Reads a scene file with its `--set key=value` overrides. Throws FileError when it cannot be
/// read, InputError with everything that is wrong in it.
SceneSpec parse_scene(const std::string& path, const std::vector<std::string>& overrides = {});

/// The same from text; `path` names it in errors and anchors relative paths.
SceneSpec parse_scene_text(const std::string& text, const std::string& path,
                           const std::vector<std::string>& overrides = {});

}  // namespace archetide
