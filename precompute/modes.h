#pragma once

#include <string>

#include "common/archetype.h"
#include "common/profile.h"
#include "precompute/elasticity.h"

namespace archetide {

struct ModesOptions {
  int count = 10;          // elastic modes wanted, >= 0 (0 = a rigid body: integrals only)
  double residual = 1e-8;  // largest accepted |K phi - omega^2 M phi| / |K phi|
  MassKind mass = MassKind::kConsistent;
  double shift_scale = 0.1;  // sigma = -shift_scale E / (rho L^2), L the bounding-box diagonal
  bool sturm_check = true;   // count eigenvalues below the last one by inertia: no mode was missed
};

/// Elastic modes of the free body and what was checked about them. r modes, n nodes.
struct ModesResult {
  VecX omega2;      // r, 1/s^2, ascending
  VecX residuals;   // r, |K phi - omega^2 M phi| / |K phi|
  MatX node_modes;  // 3n x r, m per unit q; largest |component| of each positive
  MatX M_r, K_r;    // r x r: Phi^T M Phi (kg), Phi^T K Phi (N/m)
  MomentumIntegrals integrals;
  std::string blas;           // name of the BLAS that did the work
  bool slow_blas = false;     // reference BLAS: 4 to 10 times slower than OpenBLAS; worth a warning
  double rigid_energy = 0.0;  // largest K-energy of the M-orthonormal rigid vectors, 1/s^2
  double orthonormality = 0.0;  // max |Phi^T M Phi - 1|
  double rigid_content = 0.0;   // max momentum of a mode, relative (sum m phi, sum m x cross phi)
  double next_omega2 = 0.0;     // first eigenvalue that was not kept, 1/s^2
  double cluster_gap = 0.0;     // relative gap in omega between the last kept and the next mode
  bool cluster_cut = false;     // the cut goes through a cluster: rotation-dependent basis, warn
  double sturm_shift = 0.0;     // mu of the inertia count, 1/s^2 (0 = not counted)
  int sturm_count = 0;          // eigenvalues of (K, M) below mu, 6 rigid ones included
  int operator_calls = 0;       // solves with the factor
};

/// `mesh` must have its centre of mass at the origin (move_to_centre_of_mass). Phases go to
/// `profile` as assemble, order, factor, iterate, integrals, sturm. Throws NumericsError naming the
/// failed check, InputError when the mesh has too few nodes for the count or is in several loose
/// parts.
ModesResult compute_modes(const TetMesh& mesh, const Material& material,
                          const ModesOptions& options, Profile& profile);

}  // namespace archetide
