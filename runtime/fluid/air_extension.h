#pragma once

#include "runtime/grid/grid.h"

namespace archetide {

/// Makes the velocity that was continued from the water into the air free of divergence in the air
/// cells within `reach` (m) of the surface: the smallest change of the faces that no pressure was
/// solved for (solved != 1), the farther from the surface the easier, u += ease grad psi with
/// psi = 0 beyond, to a relative residual of 1e-3. No face becomes faster than `most_speedup`
/// times the fastest face of its cells was: pockets that close keep a divergence. A
/// rising surface is carried by this velocity; where it diverges, water is lost or made: waves of
/// 0.1 m in a tank of 1 m and 32 cells lost 0.7 % in 3 s without this, now less than 0.2 % in 2 s
/// (`bench_water waves`). Cells that a solid cuts keep what they have. Returns the number of
/// iterations.
int make_air_divergence_free(const Grid& g, const Array3<double>& phi,
                             const FaceField<double>& open, const FaceField<unsigned char>& solved,
                             double reach, double most_speedup, MacField& u);

}  // namespace archetide
