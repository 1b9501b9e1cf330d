#pragma once

#include "common/archetype/elastic_cubature.h"
#include "precompute/modal/elasticity.h"

namespace archetide {

/// How a cubature is found.
struct CubatureOptions {
  int points_per_vector = 4;    // points are at most this many times the vectors of the basis
  double tolerance = 2e-3;      // of the training forces, relative: enough points
  int poses = 60;               // in static balance under random loads, for training
  int candidates = 2000;        // points to choose from
  double largest_strain = 0.4;  // that the loads of the strongest poses aim at
};

/// A cubature, and how well it repeats the forces that it was trained with.
struct TrainedCubature {
  ElasticCubature energy;
  double error = 0.0;  // of the training forces, root mean square, relative, weighted as trained
};

/// Chooses points and weights >= 0 such that the reduced elastic forces of NeoHookean material are
/// those of all tets [AKJ08]: in the linear range, and in poses that are in balance under random
/// loads, compression included; where tets are inside out, only roughly. `basis`: 3n x r, its
/// stiffness `K_r` (r x r), r > 0. The same input gives the same points.
TrainedCubature train_cubature(const TetMesh& mesh, const MaterialField& material,
                               const MatX& basis, const MatX& K_r, const CubatureOptions& options);

}  // namespace archetide
