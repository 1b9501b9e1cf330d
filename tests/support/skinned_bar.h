#pragma once

#include <vector>

#include "runtime/articulation/skinning.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {

/// A square bar along x, cut into parts across it, under one skin: the bar's surface, whose weights
/// hand over smoothly from part to part.
struct SkinnedBar {
  static constexpr double kLength = 0.6, kWidth = 0.2;  // m

  std::vector<SyntheticBody> shapes;  // of deformable parts
  std::vector<ReducedBody> bodies;    // of the parts
  SkinnedBodies skin;
};

/// Parts [ends[k], ends[k + 1]] longer by `overlap` (m) at each cut; with an overlap of half the
/// `blend` the skin's vertices are particles of all the parts that move them. r = 0: rigid parts,
/// exact solids. The bar's centre is at `place` (m), turned by `rotation`.
SkinnedBar skinned_bar(const std::vector<double>& ends, double blend, double overlap, int r,
                       double density, const Vec3& place, const Quat& rotation);

/// A skin over one body alone: its own surface.
SkinnedBodies own_skin(const ReducedBody& body, int index);

}  // namespace archetide
