#pragma once

#include "runtime/cut_cells/body_flux.h"
#include "runtime/numerics/components.h"
#include "runtime/numerics/poisson_matrix.h"

namespace archetide {

/// Whether the flux into a cell of BodyFlux meets an unknown.
inline bool holds_unknown(const PoissonMatrix& matrix, std::int64_t cell) {
  return cell >= 0 && matrix.kind[static_cast<std::size_t>(cell)] == CellKind::kUnknown;
}

/// What a surface pushes into cells without an unknown (closed by what it touches, or beyond the
/// tank) is lost. Where all the water that the surface meets is `closed`, the sum of it goes to the
/// nearest of the surface's own cells that have an unknown: a motion that keeps the volume then
/// still pushes no net flux into water that cannot give way [D86]. (The sum: a cylinder between two walls
/// has lost its ends, which push nothing together.) Elsewhere what is beyond the tank is left out,
/// and the solve ignores the others.
void settle_lost_flux(const PoissonMatrix& matrix, const ClosedComponents& closed, BodyFlux& flux);

}  // namespace archetide
