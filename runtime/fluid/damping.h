#pragma once

#include <algorithm>
#include <array>

#include "runtime/grid/grid.h"

namespace archetide {

/// What brings water to rest, which without viscosity would slosh on: du/dt = -(drag + rate s^2) u.
/// The second part are absorbing ends of the tank, as wave tanks have them: s goes from 0 at
/// `width` from a side to 1 at the side (waves whose length is several widths are absorbed over
/// many periods only). Still water feels neither.
struct Damping {
  double drag = 0.0;              // 1/s, everywhere
  std::array<double, 4> width{};  // m, of the beaches at xmin, xmax, ymin, ymax; 0: none
  double rate = 0.0;              // 1/s, at the end of a beach

  bool any() const { return drag > 0.0 || beaches(); }
  bool beaches() const { return rate > 0.0 && *std::max_element(width.begin(), width.end()) > 0.0; }
};

/// u after the time dt, on faces with target != 0. Where two beaches overlap the stronger counts.
/// Returns what that takes of the kinetic energy of the water, over its density, m^5/s^2: with the
/// mean of what the cells of a face hold (dx^3).
double damp(const Grid& g, const Damping& damping, double dt,
            const FaceField<unsigned char>& target, const Array3<double>& held, MacField& u);

}  // namespace archetide
