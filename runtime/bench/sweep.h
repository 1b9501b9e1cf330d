#pragma once

#include <string>
#include <vector>

#include "runtime/scene/scene_spec.h"

namespace archetide {

/// One swept key of a scene and its values as TOML text.
struct Sweep {
  std::string key;
  std::vector<std::string> values;
};

/// "key=v1,v2,...": a comma inside brackets, braces or quotes belongs to its value. Throws
/// InputError.
Sweep parse_sweep(const std::string& text);

/// One run of a sweep: a value for every swept key, and what that overrides in the scene.
struct SweepPoint {
  std::vector<std::string> values;
  std::vector<std::string> overrides;  // key=value
  std::string name;                    // of its folder
};

/// The product of all sweeps, the first key varying slowest. A value of fluid.cell comes with the
/// fluid.grid that keeps the tank of `base` (an edge of one cell stays one cell), unless
/// `keep_grid` or fluid.grid is swept too. Throws InputError when the tank's edges are no multiples
/// of the cell.
std::vector<SweepPoint> sweep_points(const std::vector<Sweep>& sweeps, const SceneSpec& base,
                                     bool keep_grid);

/// One point of these values (of the keys of `sweeps`, in their order).
SweepPoint sweep_point(const std::vector<Sweep>& sweeps, const std::vector<std::string>& values,
                       const SceneSpec& base, bool keep_grid);

/// The number in a value: "0.01", "1/64" (quoted or not), or 1 / n of a grid "[n, ...]"; NaN when
/// it is a word.
double sweep_number(const std::string& value);

}  // namespace archetide
