#pragma once

#include "runtime/solid/reduced_body.h"

namespace archetide {

/// How deep two bodies stand in one another, m; 0 when they do not, or when an archetype has no
/// distances. The centre, the corners and the middles of the faces of each are looked for in the
/// other; shapes are those at rest, where the bodies are. O(vertices of both), O(1) far apart.
double overlap_depth(const ReducedBody& a, const ReducedBody& b);

/// The depth from which on an overlap is none that contact is meant to resolve, m: a cell of
/// `cell` m (infinite: there are none), or a tenth of the smaller body.
double deepest_start(const ReducedBody& a, const ReducedBody& b, double cell);

}  // namespace archetide
