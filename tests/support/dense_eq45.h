#pragma once

#include <vector>

#include "tests/support/coupled_tank.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {

/// The literal Eq. 45 on voxel faces with the true projections of Sections 3 to 5 (n x n objects on
/// the particles), as the oracle of the fast path. Small systems only.
struct DenseSolution {
  VecX pressure;  // water cells in grid order: phi = p^ / (rho dx), p^ = dt p
  struct Face {
    int axis;
    Vec3i at;
    double velocity;  // m/s
  };
  std::vector<Face> faces;  // those next to water, constraint faces included
  std::vector<VecX> body;   // per body 6 + r: v = P/m, w = I^-1 L, q_dot after the solve
};
DenseSolution solve_eq45(const CoupledTank& tank, const std::vector<const SyntheticBody*>& bodies,
                         double dt);

/// A point joint of Section 7: surface vertex `p` of body a and `c` of body b (b < 0: the world).
struct DenseJoint {
  int a = -1, p = -1;
  int b = -1, c = -1;
};
/// The literal Eq. 49, lambda_a included (least norm where rows are redundant); a tank without
/// water leaves a_33 lambda_a = rhs_a.
DenseSolution solve_eq49(const CoupledTank& tank, const std::vector<const SyntheticBody*>& bodies,
                         double dt, const std::vector<DenseJoint>& joints);

/// K_lambda of Eq. 43 of one body, 3n x 3n, from the projections; M_hat as the stage has it.
MatX dense_impulse_factor(const ReducedBody& body, const SyntheticBody& shape, const MatX& M_hat);

/// [J_rigid, P_d^T R S] of one body, 3n x (6 + r): particle velocities per unit y.
MatX dense_motion(const ReducedBody& body, const SyntheticBody& shape);

/// A solution of A x = b, A symmetric positive semi-definite and b in its range.
VecX solve_semi_definite(const MatX& A, const VecX& b);

}  // namespace archetide
