#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include <Eigen/SparseCore>

#include "common/archetype/archetype.h"
#include "common/archetype/tet_elasticity.h"
#include "runtime/solid/block_cholesky.h"

namespace archetide {

/// sum a_p b_p^T over nodes, a and b 3 n.
Mat3 outer_sum(const VecX& a, const VecX& b);

/// Every node of an archetype's tets as a degree of freedom: what modes are to a reduced body, with
/// S = 1 (docs/method.md, S20). Displacements u of the n nodes, 3 n numbers in the body frame, m,
/// without rigid motion of the rest shape: J_0^T M u = 0. Made once and shared by all instances.
class NodalSpace {
 public:
  /// The archetype must have its tets and their matrices (keep = "tets").
  explicit NodalSpace(std::shared_ptr<const Archetype> archetype);

  int size() const { return static_cast<int>(rest_.size()); }  // 3 n
  const Archetype& archetype() const { return *archetype_; }
  /// x of the nodes, 3 n, m, where the exact inertia puts their mass (P6a), and M x.
  const VecX& rest_of_mass() const { return rest_; }
  const VecX& rest_moments() const { return rest_moments_; }  // kg m
  /// u as the mass has it, without the rotation of rest_of_mass() that gives it angular momentum
  /// (P6b), 3 n; and the transpose, for forces, columns side by side.
  VecX of_mass(const VecX& u) const;
  MatX from_mass(const MatX& f) const;
  int first_dof(int vertex) const {  // of the node at a vertex of the surface
    return 3 * archetype_->surface_to_node[static_cast<std::size_t>(vertex)];
  }
  /// What the water, tables and error tests see of the nodes: the amplitudes q of the archetype's r
  /// stored modes, u = modes() q + rest with the rest M-orthogonal to them. Generalised velocities
  /// (6 + 3 n) as (v, w, q_dot), 6 + r, columns side by side; and the transpose, for forces.
  const MatX& modes() const { return archetype_->node_modes; }  // 3 n x r
  int reduced_dofs() const { return 6 + static_cast<int>(mode_moments_.cols()); }
  VecX amplitudes(const VecX& u) const { return mode_moments_.transpose() * u; }  // r
  MatX reduced_velocity(const MatX& y) const;
  MatX from_reduced_force(const MatX& f) const;
  const MatX& mode_moments() const { return mode_moments_; }  // M modes M_r^-1, 3 n x r

  VecX at_surface(const VecX& u) const;    // 3 ns
  VecX from_surface(const VecX& f) const;  // its transpose, 3 n
  /// Of displacements of the surface's vertices; empty: the shape is not corrected.
  const LinearShape& linear_shape() const { return linear_shape_; }

  /// (a M + b K) u, K at rest.
  VecX product(double a, double b, const VecX& u) const;
  /// The same of other blocks, of the pattern of TetMatrices.
  VecX product(const std::vector<Mat3>& blocks, const VecX& u) const;
  /// Elastic energy of the nodes, J, and force dV/du without its rigid part, 3 n, N. Of a nonlinear
  /// archetype NeoHookean, else 1/2 u K u.
  double elastic_energy(const VecX& u) const;
  VecX elastic_force(const VecX& u) const;
  /// blocks += factor d2V/du2, N/m; of a nonlinear archetype only.
  void add_stiffness(const VecX& u, double factor, std::vector<Mat3>& blocks) const;
  std::size_t blocks() const { return archetype_->matrices.column.size(); }
  /// Pi = 1 - J_0 (J_0^T M J_0)^-1 J_0^T M and its transpose, on columns of displacements and of
  /// forces.
  void take_rigid_motion(MatX& u) const;
  void take_rigid_force(MatX& f) const;

  /// M J_0 (J_0^T M J_0)^-1, 3 n x 6: the forces that rigid motions take up.
  const MatX& rigid_momentum() const { return rigid_momentum_; }
  const MatX& rigid_motions() const { return rigid_; }  // J_0, 3 n x 6

  /// Factor of M + ratio K (ratio in s^2). The last few are kept: steps come in few lengths, and
  /// both stages of one have the same.
  std::shared_ptr<const BlockCholesky> factor(double ratio) const;
  /// Of M + ratio B, B other blocks; null where that is not definite. Not kept.
  std::shared_ptr<const BlockCholesky> factor(const std::vector<Mat3>& blocks, double ratio) const;
  static constexpr std::size_t kKeptFactors = 3;
  /// (M + ratio K)^-1 mode_moments() without rigid motion, 3 n x r; kept with the factor.
  std::shared_ptr<const MatX> answers_of_modes(double ratio) const;

  std::size_t factor_bytes() const { return pattern_->factor_bytes(); }  // of one
  /// Of the archetype's matrices and of as many factors as are kept once steps have had several
  /// lengths.
  std::size_t bytes() const;

 private:
  void match_inertia();

  std::shared_ptr<const Archetype> archetype_;
  VecX rest_, rest_moments_;
  MatX spin_;            // 3 x 3 n: of the rotation that of_mass takes, or empty: none
  MatX rotations_;       // 3 n x 3, of rest_of_mass() about each axis, m
  MatX rigid_;           // J_0, 3 n x 6
  MatX rigid_momentum_;  // M J_0 (J_0^T M J_0)^-1, 3 n x 6
  MatX mode_moments_;
  LinearShape linear_shape_;
  std::unique_ptr<TetElasticity> elasticity_;  // of a nonlinear archetype
  std::vector<int> places_;                    // of its blocks
  std::shared_ptr<const FactorPattern> pattern_;
  mutable std::mutex lock_;
  struct Kept {
    double ratio;  // s^2
    std::shared_ptr<const BlockCholesky> factor;
    std::shared_ptr<const MatX> of_modes;  // null: not asked for yet
  };
  Kept& kept(double ratio) const;
  mutable std::vector<Kept> factors_;  // the one that was used last stands last
};

/// How a load follows the nodes of a body, -d f / du, N/m: what is between neighbours, 3 n x 3 n, and
/// V W^T + W V_of_rows^T + W G W^T by the turn of the frame, W: 3 n x 3. Where it is symmetric V_of_rows
/// is V.
struct NodalStiffness {
  Eigen::SparseMatrix<double> near;
  MatX V, V_of_rows, W;
  Mat3 G = Mat3::Zero();

  VecX operator*(const VecX& u) const;
};

/// Mhat of a body of nodes: a M + b K + T + sum U C U^T with few columns U, on displacements without
/// rigid motion (Woodbury); T: what a nonlinear body has beside, or none.
class NodalMass {
 public:
  /// a > 0 (1), b >= 0 (s^2).
  NodalMass(std::shared_ptr<const NodalSpace> space, double a, double b);
  /// T = elastic (blocks of the space, kg) + unit load (unit in s^2; null: none). Where that is not
  /// definite, elastic gains as much of K as it needs, in units of `unit`.
  NodalMass(std::shared_ptr<const NodalSpace> space, double a, double b, std::vector<Mat3> elastic,
            const NodalStiffness* load, double unit);
  /// += U C U^T; C (k x k) symmetric.
  void add(const MatX& U, const MatX& C);

  int size() const { return space_->size(); }
  const NodalSpace& space() const { return *space_; }
  bool is_nonlinear() const { return !elastic_.empty(); }
  VecX product(const VecX& u) const;
  /// That of `elastic` alone, without its rigid part.
  VecX elastic_product(const VecX& u) const;
  /// Mhat^-1 f, columns side by side: displacements of the part of f that is no rigid force.
  MatX solve(MatX f) const;
  /// The same of many bodies, f[b] through masses[b]: all that have one factor pass through it at
  /// once.
  static void solve(const std::vector<const NodalMass*>& masses, std::vector<MatX>& f);
  /// Mhat^-1 of the space's mode_moments(), 3 n x r.
  MatX answers_of_modes() const;
  /// E^T Mhat^-1 E, k x k, of forces E (3 n x k) on a few nodes each (BlockCholesky::compliance).
  MatX compliance(const Eigen::SparseMatrix<double>& E) const;

 private:
  struct Addition {
    MatX U, C;
    MatX W, G;  // W = Mhat^-1 U of what was there before, G = C (1 + U^T W C)^-1
  };
  static void solve_alike(const std::vector<const NodalMass*>& masses,
                          const std::vector<std::size_t>& which, std::vector<MatX>& f);
  void take_rigid_motion(MatX& u) const;
  void take_additions(MatX& u) const;

  std::shared_ptr<const NodalSpace> space_;
  double a_, b_;
  std::shared_ptr<const BlockCholesky> factor_;
  std::vector<Mat3> elastic_, blocks_;  // blocks_: b K + T; both empty without T
  // Of a factor of its own: Z = factor^-1 N (N^T factor^-1 N)^-1, N = rigid_momentum(), and
  // N^T factor^-1 N.
  MatX rigid_answers_, rigid_block_;
  std::vector<Addition> additions_;
};

}  // namespace archetide
