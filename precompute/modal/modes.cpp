#include "precompute/modal/modes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "common/archetype/matched_moments.h"
#include "common/archetype/mode_cluster.h"
#include "common/base/check.h"
#include "common/base/input_error.h"
#include "precompute/base/bounding_diagonal.h"
#include "precompute/base/joined.h"
#include "precompute/modal/canonical_basis.h"
#include "precompute/modal/complete_modes.h"
#include "precompute/modal/eigen_solver.h"
#include "precompute/modal/momentum_integrals.h"
#include "precompute/modal/nonlinear_modes.h"
#include "precompute/modal/ordering.h"
#include "precompute/modal/patch_loads.h"

namespace archetide {
namespace {

constexpr double kLooseParts = 1e-8;   // lowest omega2 of one connected body, in E / (rho L^2)
constexpr double kRigidEnergy = 1e-9;  // K-energy of rigid vectors, in units of the lowest omega2
constexpr double kOrthonormality = 1e-10;
constexpr double kRigidContent = 1e-12;
constexpr double kSturmGap = 1e-6;  // smallest relative gap in which an eigenvalue count is trusted

/// The six rigid motions of the rest shape, M-orthonormal, 3n x 6: translations, then rotations
/// about the principal axes.
MatX rigid_vectors(const std::vector<Vec3>& nodes, const SparseMatrix& mass) {
  const MomentumIntegrals rest = momentum_integrals(nodes, mass, MatX(3 * nodes.size(), 0));
  const Mat3 inertia = rest.Sxx.trace() * Mat3::Identity() - rest.Sxx;
  const Eigen::SelfAdjointEigenSolver<Mat3> principal(inertia);
  MatX rigid(3 * nodes.size(), 6);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const Vec3 axis = principal.eigenvectors().col(k);
      rigid.block<3, 1>(3 * i, k) = Vec3::Unit(k) / std::sqrt(rest.mass);
      rigid.block<3, 1>(3 * i, 3 + k) =
          axis.cross(nodes[i]) / std::sqrt(principal.eigenvalues()[k]);
    }
  // Take the last round-off out of their orthonormality.
  const MatX gram = rigid.transpose() * apply_mass(mass, rigid);
  return gram.llt().matrixL().solve(rigid.transpose()).transpose();
}

/// phi -= R R^T M phi, twice for round-off.
void remove_rigid(const MatX& rigid, const MatX& weighted_rigid, MatX& modes) {
  for (int pass = 0; pass < 2; ++pass) modes -= rigid * (weighted_rigid.transpose() * modes);
}

void require_solvable(const TetMesh& mesh, const ModesOptions& options) {
  const int held = options.clamped.empty() ? 6 : 3 * int(options.clamped.size());
  const int free = 3 * int(mesh.nodes.size()) - held,
            needed = 2 * (options.count + kExtraModes) + 1;
  if (needed > free)
    throw InputError(joined("modes.count = ", options.count, " is too much for a tet mesh of ",
                            mesh.nodes.size(), " nodes"),
                     joined("ask for at most ", std::max(0, (free - 1) / 2 - kExtraModes),
                            " modes, or raise tet.target"));
}

/// Refuses loose parts and hinges: one connected body has no zero-energy motion besides the rigid
/// ones.
void require_one_body(const VecX& omega2, double scale, double rigid_energy) {
  const Eigen::Index zeros = (omega2.array() < kLooseParts * scale).count();
  if (zeros > 0)
    throw NumericsError(
        joined("rigid check: ", zeros, zeros == omega2.size() ? " or more" : "",
               " motions without energy besides the six rigid ones (omega^2 down to ", omega2[0],
               " 1/s^2): the body has loose parts or parts that share "
               "only an edge or a corner\n  join the parts, or make one body of each"));
  if (!(rigid_energy < kRigidEnergy * omega2[0]))
    throw NumericsError(joined("rigid check: rigid motions have the energy ", rigid_energy,
                               " 1/s^2, against ", omega2[0], " 1/s^2 of the lowest mode (limit ",
                               kRigidEnergy, ")\n  a far too slender body or badly shaped tets"));
}

/// |K phi - omega^2 M phi| / |K phi| of each column.
VecX residuals(const SparseMatrix& K, const SparseMatrix& mass, const VecX& omega2,
               const MatX& modes) {
  const MatX forces = K * modes;
  const MatX misfit = forces - apply_mass(mass, modes) * omega2.asDiagonal();
  return (misfit.colwise().norm().array() / forces.colwise().norm().array()).transpose();
}

void require_accuracy(const ModesResult& result, double limit) {
  for (Eigen::Index k = 0; k < result.vibration_modes(); ++k)
    if (!(result.residuals[k] <= limit))
      throw ResidualTooLarge(joined("residual check: mode ", k + 1,
                                    " has |K phi - w2 M phi| / |K phi| = ", result.residuals[k],
                                    ", more than modes.residual = ", limit));
  if (!(result.orthonormality <= kOrthonormality))
    throw NumericsError(joined("orthonormality check: |Phi^T M Phi - 1| = ", result.orthonormality,
                               ", more than ", kOrthonormality));
  if (!(result.rigid_content <= kRigidContent))
    throw NumericsError(joined("momentum check: a mode carries the relative momentum ",
                               result.rigid_content, ", more than ", kRigidContent));
}

/// Counts eigenvalues below a shift in the widest gap at or above the last kept mode. `all`:
/// ascending, the kept modes and the extra ones.
void sturm_check(const SparseMatrix& K, const SparseMatrix& mass, const std::vector<int>& ordering,
                 const VecX& all, int kept, int rigid, ModesResult& result) {
  int below = kept;  // modes of `all` below the shift
  for (int k = kept; k < all.size(); ++k)
    if (all[k] / all[k - 1] > all[below] / all[below - 1]) below = k;
  if (all[below] < (1.0 + kSturmGap) * all[below - 1])
    throw NumericsError(
        joined("Sturm check: modes ", kept, " to ", all.size(),
               " are equal to round-off, nothing separates them\n  change modes.count"));
  result.sturm_shift = 0.5 * (all[below - 1] + all[below]);
  result.sturm_count = count_eigenvalues_below(K, mass, result.sturm_shift, ordering);
  if (result.sturm_count != rigid + below)
    throw NumericsError(joined("Sturm check: ", result.sturm_count, " eigenvalues below ",
                               result.sturm_shift, " 1/s^2, but ", rigid, " rigid and ", below,
                               " elastic ones were found: the eigensolver missed some"));
}

/// Eqs. 7 and 9: the reduced matrices M_r = S^T M S and K_r = S^T K S.
void reduce(const SparseMatrix& K, const SparseMatrix& mass, ModesResult& result) {
  const MatX& modes = result.node_modes;
  result.M_r = modes.transpose() * apply_mass(mass, modes);
  result.K_r = modes.transpose() * (K * modes);
}

/// Integrals over the mass of the modes, with the exact inertia; see ModesResult. Modes of a body that
/// is not free keep the angular momentum that they have.
MomentumIntegrals integrate(const TetMesh& mesh, const MaterialField& material,
                            const SparseMatrix& mass, bool free, const ModesResult& modes) {
  MomentumIntegrals integrals = momentum_integrals(mesh.nodes, mass, modes.node_modes);
  if (modes.mass == MassKind::kLumped) {
    const SparseMatrix exact = mass_matrix(mesh, material, MassKind::kConsistent);
    const Mat3 Sxx =
        momentum_integrals(mesh.nodes, exact, MatX(3 * Eigen::Index(mesh.nodes.size()), 0)).Sxx;
    if (free)
      match_moments(Sxx, integrals);
    else
      integrals.Sxx = Sxx;
  }
  return integrals;
}

/// Puts vectors that solve no eigenproblem behind the modes.
void append_static(const MatX& vectors, const SparseMatrix& K, ModesResult& result) {
  const Eigen::Index r = result.omega2.size(), s = vectors.cols();
  result.node_modes.conservativeResize(Eigen::NoChange, r + s);
  result.node_modes.rightCols(s) = vectors;
  result.omega2.conservativeResize(r + s);
  for (Eigen::Index k = 0; k < s; ++k)
    result.omega2[r + k] = vectors.col(k).dot(K * vectors.col(k));
  result.static_count += int(s);
}

/// Lowest E / (rho L^2), the scale of omega^2.
double frequency_scale(const TetMesh& mesh, const MaterialField& material) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Material& m : material.materials) lowest = std::min(lowest, m.young / m.density);
  return lowest / std::pow(bounding_diagonal(mesh.nodes), 2);
}

void require_centred(const std::vector<Vec3>& nodes, const SparseMatrix& mass) {
  const VecX share = mass * VecX::Ones(mass.cols());
  Vec3 moment = Vec3::Zero();
  for (std::size_t i = 0; i < nodes.size(); ++i) moment += share[Eigen::Index(i)] * nodes[i];
  ARCHETIDE_CHECK_OP(moment.norm(), <=, 1e-10 * share.sum() * bounding_diagonal(nodes));
}

}  // namespace

int cut_between_clusters(const VecX& all, int wanted) {
  // Gap in omega behind the first k, relative.
  const auto gap = [&](int k) { return std::sqrt(all[k] / all[k - 1]) - 1.0; };
  const int last = int(all.size()) - 1, first = std::max(1, wanted - kExtraModes);
  for (int k = wanted; k <= last; ++k)
    if (gap(k) >= kClusterGap) return k;
  for (int k = wanted - 1; k >= first; --k)
    if (gap(k) >= kClusterGap) return k;
  int widest = wanted;
  for (int k = first; k <= last; ++k)
    if (gap(k) > gap(widest)) widest = k;
  return widest;
}

namespace {

/// The system that is solved: all of the body, or what the clamp leaves free.
struct Problem {
  SparseMatrix K, mass;        // 3m x 3m, m x m
  MatX rigid, weighted_rigid;  // 3m x 6 (x 0 when clamped): M-orthonormal, and M times it
  std::vector<int> nodes;      // m: of the mesh
};

/// Rows and columns of the kept nodes, `d` dofs each; `kept` is ascending.
SparseMatrix restricted(const SparseMatrix& matrix, const std::vector<int>& kept, int d) {
  std::vector<int> place(std::size_t(matrix.rows()), -1);
  for (int i = 0; i < int(kept.size()); ++i)
    for (int a = 0; a < d; ++a) place[d * kept[i] + a] = d * i + a;
  const int size = d * int(kept.size());
  SparseMatrix result(size, size);
  result.reserve(matrix.nonZeros());
  for (int c = 0; c < matrix.cols(); ++c) {
    if (place[c] < 0) continue;
    result.startVec(place[c]);
    for (SparseMatrix::InnerIterator a(matrix, c); a; ++a)
      if (place[a.row()] >= 0) result.insertBack(place[a.row()], place[c]) = a.value();
  }
  result.finalize();
  return result;
}

Problem set_up(const TetMesh& mesh, const MaterialField& material, const ModesOptions& options,
               const SparseMatrix& mass) {
  Problem p;
  p.K = stiffness_matrix(mesh, material);
  std::vector<char> held(mesh.nodes.size(), 0);
  for (const int node : options.clamped) held[node] = 1;
  for (int i = 0; i < int(mesh.nodes.size()); ++i)
    if (!held[i]) p.nodes.push_back(i);
  if (options.clamped.empty()) {
    p.mass = mass;
    p.rigid = rigid_vectors(mesh.nodes, mass);
  } else {
    p.K = restricted(p.K, p.nodes, 3);
    p.mass = restricted(mass, p.nodes, 1);
    p.rigid.resize(p.K.rows(), 0);
  }
  p.weighted_rigid = apply_mass(p.mass, p.rigid);
  return p;
}

/// Zero at the clamped nodes.
MatX spread(const MatX& modes, const Problem& p, std::size_t nodes) {
  MatX all = MatX::Zero(3 * Eigen::Index(nodes), modes.cols());
  for (std::size_t i = 0; i < p.nodes.size(); ++i)
    all.middleRows<3>(3 * p.nodes[i]) = modes.middleRows<3>(3 * Eigen::Index(i));
  return all;
}

std::vector<Vec3> positions(const TetMesh& mesh, const Problem& p) {
  std::vector<Vec3> x;
  for (const int node : p.nodes) x.push_back(mesh.nodes[node]);
  return x;
}

double largest(const MatX& m) { return m.size() > 0 ? m.cwiseAbs().maxCoeff() : 0.0; }

/// Reduces the matrices and demands that the modes are what they should be.
void check_modes(const Problem& p, const ModesOptions& options, ModesResult& result) {
  // The sums Σ m φ and Σ m x × φ below Eq. 1 are zero.
  result.rigid_content = largest(p.weighted_rigid.transpose() * result.node_modes);
  result.residuals = residuals(p.K, p.mass, result.omega2, result.node_modes);
  reduce(p.K, p.mass, result);
  const Eigen::Index r = result.omega2.size();
  result.orthonormality = largest(result.M_r - MatX::Identity(r, r));
  require_accuracy(result, options.residual);
}

/// All that a mesh can do: nothing is cut, and none can be missed.
void find_every_motion(const TetMesh& mesh, const MaterialField& material,
                       const ModesOptions& options, const Problem& p, ModesResult& result) {
  ARCHETIDE_CHECK(options.clamped.empty() && !options.loads.any());
  EigenResult found = every_eigenpair(p.K, p.mass, p.rigid);
  result.rigid_energy = largest(p.rigid.transpose() * (p.K * p.rigid));
  require_one_body(found.values, frequency_scale(mesh, material), result.rigid_energy);
  result.omega2 = found.values;
  result.node_modes = std::move(found.vectors);
  remove_rigid(p.rigid, p.weighted_rigid, result.node_modes);
  canonicalise(mesh.nodes, p.mass, result.omega2, result.node_modes);
  check_modes(p, options, result);
}

/// What the basis, and the first modes of it alone, tell of the static answers to `loads` (3n x k).
void find_patch_errors(const MatX& loads, const Problem& p, ShiftedCholesky& factor,
                       ModesResult& result) {
  const int vibration = result.vibration_modes();
  const MatX modes = result.node_modes.leftCols(vibration);
  const MatX basis = side_by_side(p.rigid, modes);
  const StaticSolver beyond_modes(p.K, p.mass, factor, basis);
  const Eigen::LDLT<MatX> stiffness(result.K_r);
  std::vector<DeflectionError> of_modes(static_cast<std::size_t>(vibration));
  for (Eigen::Index l = 0; l < loads.cols(); ++l) {
    const VecX q = (modes.transpose() * loads.col(l)).cwiseQuotient(result.omega2.head(vibration));
    const VecX whole = modes * q + beyond_modes.respond(loads.col(l));
    VecX part = VecX::Zero(whole.size());
    for (int k = 0; k < vibration; ++k) {
      part += q[k] * modes.col(k);
      of_modes[static_cast<std::size_t>(k)].add(part, whole, loads.cols());
    }
    result.patch_error.add(
        result.node_modes * stiffness.solve(result.node_modes.transpose() * loads.col(l)), whole,
        loads.cols());
  }
  for (const DeflectionError& error : of_modes) result.patch_error_of_modes.push_back(error.mean);
}

}  // namespace

ModesResult compute_modes(const TetMesh& mesh, const MaterialField& material,
                          const ModesOptions& options, Profile& profile) {
  ModesResult result;
  const BlasInfo blas = prepare_blas();
  result.blas = blas.name;
  result.slow_blas = blas.slow;
  result.mass =
      options.mass.value_or(mesh.order() == 1 ? MassKind::kLumped : MassKind::kConsistent);

  std::optional<ScopedTimer> timer(std::in_place, profile, "assemble");
  const SparseMatrix mass = mass_matrix(mesh, material, result.mass);
  require_centred(mesh.nodes, mass);
  if (options.count == 0 && !options.every_motion) {
    result.node_modes.resize(3 * Eigen::Index(mesh.nodes.size()), 0);
    result.integrals = integrate(mesh, material, mass, options.clamped.empty(), result);
    return result;
  }
  if (!options.every_motion) require_solvable(mesh, options);
  const Problem p = set_up(mesh, material, options, mass);
  if (options.every_motion) {
    timer.emplace(profile, "dense");
    find_every_motion(mesh, material, options, p, result);
    timer.emplace(profile, "integrals");
    result.integrals = integrate(mesh, material, mass, options.clamped.empty(), result);
    return result;
  }

  timer.emplace(profile, "order");
  const std::vector<int> ordering = nested_dissection(p.K);

  timer.emplace(profile, "factor");
  const double scale = frequency_scale(mesh, material);
  EigenOptions eigen;
  eigen.count = options.count + kExtraModes;
  eigen.sigma = -options.shift_scale * scale;
  std::optional<ShiftedCholesky> factor(std::in_place, shifted(p.K, p.mass, -eigen.sigma),
                                        ordering);

  timer.emplace(profile, "iterate");
  EigenResult found = lowest_eigenpairs(*factor, p.mass, p.rigid, eigen);
  result.operator_calls = found.operator_calls;
  result.rigid_energy = largest(p.rigid.transpose() * (p.K * p.rigid));
  require_one_body(found.values, scale, result.rigid_energy);

  // Keep whole clusters, free of momentum.
  const int kept =
      options.whole_clusters ? cut_between_clusters(found.values, options.count) : options.count;
  result.omega2 = found.values.head(kept);
  result.node_modes = found.vectors.leftCols(kept);
  found.vectors.resize(0, 0);
  remove_rigid(p.rigid, p.weighted_rigid, result.node_modes);
  canonicalise(positions(mesh, p), p.mass, result.omega2, result.node_modes);

  if (options.loads.any()) {
    ARCHETIDE_CHECK(options.clamped.empty());
    timer.emplace(profile, "static");
    append_static(
        static_responses(mesh, options.loads, p.K, p.mass, *factor, p.rigid, result.node_modes),
        p.K, result);
  }
  if (options.nonlinear) {
    ARCHETIDE_CHECK(options.clamped.empty());
    timer.emplace(profile, "derivatives");
    append_static(nonlinear_vectors(mesh, material, options.derivatives, p.K, p.mass, *factor,
                                    p.rigid, result.node_modes, result.omega2, kept),
                  p.K, result);
  }

  timer.emplace(profile, "integrals");
  check_modes(p, options, result);
  if (options.clamped.empty()) {
    timer.emplace(profile, "patches");
    find_patch_errors(patch_loads(mesh), p, *factor, result);
  }
  factor.reset();

  // What was left out.
  result.next_omega2 = found.values[kept];
  result.cluster_gap = std::sqrt(result.next_omega2 / found.values[kept - 1]) - 1.0;
  result.cluster_cut = result.cluster_gap < kClusterGap;
  if (options.sturm_check) {
    timer.emplace(profile, "sturm");
    sturm_check(p.K, p.mass, ordering, found.values, kept, int(p.rigid.cols()), result);
  }

  timer.emplace(profile, "integrals");
  result.node_modes = spread(result.node_modes, p, mesh.nodes.size());
  result.integrals = integrate(mesh, material, mass, options.clamped.empty(), result);
  return result;
}

}  // namespace archetide
