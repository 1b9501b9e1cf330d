#pragma once

#include <cstdint>
#include <vector>

#include "runtime/grid/grid.h"

namespace archetide {

/// Faces of which solids leave less than this open are narrow [D45]. The flux through one is as
/// right as through any other, but the velocity is not that of the water around it (measured beside
/// a falling torus: up to 400 m/s through 1e-5 of a face, where water and body moved at 2 m/s).
constexpr double kTrustedOpening = 0.5;
/// So are faces of which the surface leaves less than this in the water (theta times the opening)
/// [D46]: a little water that a pressure pushes far. What is shown to advection becomes the
/// velocity of all the water that comes there next. (A dam of 0.6 x 1 m in a tank of 2 x 1.5 m, 32
/// cells/m: with it 14 m/s at most and an energy that never rises by more than 0.05 % of the first,
/// without 21 m/s and 7 %; two pools beside a wall, into one of which a block of water falls, blew
/// up.)
constexpr double kTrustedDepth = 0.75;

/// A narrow face beside an unknown, before and after a solve.
struct NarrowFace {
  int axis = 0;
  std::size_t face = 0;              // index in the component's array
  double open = 0.0;                 // w, times theta at the surface
  double before = 0.0, after = 0.0;  // m/s
};

/// What narrow faces carry beyond the velocity that advection is shown there. The next solve starts
/// from both, so that a velocity which is free of divergence is left as it is. (When the velocity
/// of narrow faces was dropped, and continued from the faces around after each solve, a ball of 4
/// cells a radius coasting in still water lost 0.06 to 0.44 % of the energy in every step, however
/// short.)
struct NarrowFlow {  // structure of arrays
  std::vector<signed char> axis;
  std::vector<std::int64_t> face;
  std::vector<double> open;    // w of the solve that left it
  std::vector<double> excess;  // m/s
  std::size_t size() const { return axis.size(); }
  void add(const NarrowFace& f, double beyond);
};

/// After a solve whose velocity u is continued into narrow faces: u takes over what was solved for
/// there, as far as it is likely; the rest is returned.
NarrowFlow settle_after(const std::vector<NarrowFace>& faces, MacField& u);
/// The same where the next solve starts from u + push, the velocity before this one; both are
/// continued.
NarrowFlow settle_before(const std::vector<NarrowFace>& faces, MacField& u, MacField& push);

/// u += excess on faces with an opening. Where a face has opened further the water of the whole
/// opening shares it: its momentum w excess stays.
void add_narrow_flow(const NarrowFlow& flow, const FaceField<double>& open, MacField& u);

}  // namespace archetide
