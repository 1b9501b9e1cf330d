#pragma once

#include <Eigen/Cholesky>

#include "common/mesh/tet_mesh.h"

namespace archetide {

/// A free elastic body of linear tets in nodal coordinates, dense: the full finite element model
/// that a complete basis must reproduce. n nodes about the centre of mass; dof 3 node + axis.
struct SmallFem {
  MatX K;             // 3n x 3n, N/m
  MatX scalar_mass;   // n x n, consistent, kg
  double beta = 0.0;  // C = beta K, s

  MatX mass() const;  // 3n x 3n, kg
};

/// Isotropic material: density kg/m^3, Young's modulus Pa, Poisson's ratio.
SmallFem small_fem(const TetMesh& mesh, double density, double young, double poisson);

/// Every elastic eigenvector of (K, M), 3n x (3n - 6), lowest first, and its frequencies, rad/s.
struct ElasticModes {
  MatX shapes;
  VecX omega;
};
ElasticModes elastic_modes(const SmallFem& fem);

/// One step of the trapezoidal rule of M u'' + C u' + K u = f, f held constant over the step.
struct NodalState {
  VecX u, u_dot;  // 3n, m and m/s
};
class NodalStepper {
 public:
  NodalStepper(const SmallFem& fem, double dt);
  void step(const VecX& f, NodalState& state) const;

 private:
  MatX mass_, implicit_, K_;  // implicit_ = dt/2 C + dt^2/4 K
  Eigen::LDLT<MatX> factor_;
  double dt_;
};

}  // namespace archetide
