#pragma once

#include <string>

#include "common/files/surface_io.h"

namespace archetide {

/// What may be done to a surface that does not bound a body. Only on request, never a default.
enum class Repair {
  kNone,
  kFill,   // weld and split nearly coinciding edges, then close every hole
  kUnion,  // merge overlapping closed shells
  kWrap    // shrink-wrap whatever is there from outside
};

struct RepairOptions {
  Repair kind = Repair::kNone;
  double alpha = 0.0;   // wrap: gaps narrower than twice this close, m; 0 = a fiftieth of the
                        // diagonal, and cones over the holes first
  double offset = 0.0;  // wrap: how far outside the input it lies, m; 0 = alpha / 30
};

/// What a repair did to the shape; lengths in the unit of the file.
struct RepairReport {
  Repair kind = Repair::kNone;
  int holes = 0, welded = 0, split = 0, dropped = 0;  // filled; vertices, faces, faces
  int shells = 0;                                     // merged by a union
  double alpha = 0.0, offset = 0.0;                   // used by a wrap
  double volume_before = 0.0;        // of the input, holes closed by cones, overlaps counted twice
  bool volume_before_known = false;  // false when the input cannot be oriented
  double volume_after = 0.0;
  double hausdorff =
      0.0;  // larger of the two distances below, sampled at vertices and face centres
  double from_input = 0.0, from_result = 0.0;  // farthest point of one from the other
  std::string note() const;                    // one line for the log; "" when nothing was done
};

const char* name_of(Repair kind);

/// The repaired surface in file coordinates; its faces are numbered anew. Throws InputError when
/// this repair does not fit, with what would. `scale`: file unit to m (for alpha and offset).
SurfaceFile repair_surface(const SurfaceFile& file, double scale, const RepairOptions& options,
                           RepairReport& report);

}  // namespace archetide
