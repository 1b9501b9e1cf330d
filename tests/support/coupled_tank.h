#pragma once

#include "runtime/coupling/coupling.h"

namespace archetide {

/// A tank with one or more bodies at rest in still water, for tests of a single coupled solve.
struct CoupledTank {
  CouplingOptions options;
  Array3<double> phi;  // cells; full tank unless changed
  std::vector<ReducedBody> bodies;
  std::vector<TriMesh> obstacles;
  MacField u;  // u* in, u out
  std::vector<StageResult> results;
  double divergence = 0.0;

  /// A cubic tank [-half, half]^3 of n^3 cells, full of water, all sides closed, no gravity.
  CoupledTank(int n, double half);
  /// The same in this grid.
  explicit CoupledTank(const Grid& grid);

  SolveReport solve(double dt, Stage stage = Stage::kVelocityFull);
};

/// Icosphere scaled to the volume of the sphere of this radius.
TriMesh volume_true_sphere(int subdivisions, double radius);

}  // namespace archetide
