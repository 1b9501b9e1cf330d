#pragma once

#include <optional>
#include <string>

#include "common/archetype/archetype.h"
#include "common/base/input_error.h"
#include "common/base/profile.h"
#include "precompute/modal/elasticity.h"
#include "precompute/modal/patch_loads.h"
#include "precompute/modal/static_responses.h"

namespace archetide {

struct ModesOptions {
  /// Elastic modes wanted, >= 0 (0 = a rigid body: integrals only). The result never ends inside a
  /// cluster of equal frequencies: it has up to kExtraModes more when that completes the cluster,
  /// else up to as many fewer.
  int count = 10;
  /// Instead of `count`: every elastic motion of the mesh, 3 n - 6 modes by a dense solver. Not
  /// together with static responses (there is nothing left for them) or a clamp.
  bool every_motion = false;
  double residual = 1e-8;        // largest accepted |K phi - omega^2 M phi| / |K phi|
  std::optional<MassKind> mass;  // default: lumped for linear tets, consistent for quadratic ones
  double shift_scale = 0.1;      // sigma = -shift_scale E / (rho L^2), L the bounding-box diagonal
  bool sturm_check =
      true;  // count eigenvalues below the last one (Sylvester's law): no mode was missed
  bool whole_clusters = true;  // false: exactly `count`
  StaticLoads loads;           // static response vectors behind the modes
  /// Uniform strains and modal derivatives behind them, for nonlinear elasticity. Not together with
  /// a clamp or `every_motion`.
  bool nonlinear = false;
  int derivatives = 20;  // directions of the modal derivatives
  /// Nodes held still. The modes are then those of the held body: nothing rigid is taken out, they
  /// carry momentum, and they vanish at these nodes. Not together with static responses.
  std::vector<int> clamped;
};

/// Computed beyond the count, to see where a cluster ends.
inline constexpr int kExtraModes = 5;

/// Elastic modes of the free body and what was checked about them. n nodes; r columns: vibration
/// modes, then static response vectors.
struct ModesResult {
  VecX omega2;           // r, 1/s^2, ascending
  VecX residuals;        // r, |K phi - omega^2 M phi| / |K phi|; not small for static vectors
  MatX node_modes;       // 3n x r, m per unit q; largest |component| of each positive
  int static_count = 0;  // the last columns: static response vectors, strains, modal derivatives
  MatX M_r, K_r;         // r x r: Phi^T M Phi (kg), Phi^T K Phi (N/m)
  /// Over the mass of the modes (lumped or consistent), but Sxx over the consistent mass: the exact
  /// inertia of the tets; the lumped inertia would be too large by order h^2. Those of a free body
  /// are then of nodes at Sigma x (match_moments): T = 1/2 w.I(q) w + w.D(q) q' + 1/2 q'.M_r q' stays
  /// a sum of squares.
  MomentumIntegrals integrals;
  MassKind mass = MassKind::kConsistent;
  std::string blas;           // name of the BLAS that did the work
  bool slow_blas = false;     // reference BLAS: 4 to 10 times slower than OpenBLAS; worth a warning
  double rigid_energy = 0.0;  // largest K-energy of the M-orthonormal rigid vectors, 1/s^2
  double orthonormality = 0.0;  // max |Phi^T M Phi - 1|
  double rigid_content = 0.0;   // max momentum of a mode, relative (sum m phi, sum m x cross phi)
  double next_omega2 = 0.0;     // first eigenvalue that was not kept, 1/s^2 (0: all were)
  double cluster_gap = 0.0;     // relative gap in omega between the last kept and the next mode
  bool cluster_cut = false;     // no gap in reach: the basis is arbitrary at the cut, warn
  double sturm_shift = 0.0;     // mu of the eigenvalue count, 1/s^2 (0 = not counted)
  int sturm_count = 0;          // eigenvalues of (K, M) below mu, 6 rigid ones included
  int operator_calls = 0;       // solves with the factor
  /// Static deflections under patch_loads against those of all nodes, and the mean of that with the
  /// first 1, 2 ... vibration modes alone; of free bodies with modes.
  DeflectionError patch_error;
  std::vector<double> patch_error_of_modes;

  int vibration_modes() const { return int(omega2.size()) - static_count; }
};

/// A mode has a larger residual than ModesOptions allow: by round-off, in slender bodies above all.
struct ResidualTooLarge : NumericsError {
  using NumericsError::NumericsError;
};

/// `mesh` must have its centre of mass at the origin (move_to_centre_of_mass). Phases go to
/// `profile` as assemble, order, factor, iterate, static, integrals, sturm. Throws NumericsError
/// naming the failed check, InputError when the mesh has too few nodes for the count or is in
/// several loose parts.
/// Vibration modes as the coordinates of a body: [PW89].
ModesResult compute_modes(const TetMesh& mesh, const MaterialField& material,
                          const ModesOptions& options, Profile& profile);

/// How many of the ascending eigenvalues `all` to keep when `wanted` are requested: the end of a
/// cluster at or above `wanted`, else one below, else (clusters everywhere) the widest gap in
/// reach.
int cut_between_clusters(const VecX& all, int wanted);

}  // namespace archetide
