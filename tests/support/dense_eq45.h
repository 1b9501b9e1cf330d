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

/// K_lambda of Eq. 43 of one body, 3n x 3n, from the projections; M_hat as the stage has it.
MatX dense_impulse_factor(const ReducedBody& body, const SyntheticBody& shape, const MatX& M_hat);

}  // namespace archetide
