#pragma once

#include "common/base/types.h"

namespace archetide {

/// Energy density of a compressible neo-Hookean solid, Pa:
///     psi(F) = mu/2 (tr F^T F - 3) + h(det F),
///     h(J) = -mu ln J + lambda/8 (J^2 + J^-2 - 2),
/// which is linear elasticity with Lame's constants at F = 1. Below kLeastVolume h goes on as its
/// parabola there, so that energy, stress and stiffness are finite (and large) in every pose.
struct NeoHookean {
  static constexpr double kLeastVolume = 0.15;  // of det F

  /// h'(J), Pa.
  static double slope(double lambda, double mu, double J) {
    const double at = J > kLeastVolume ? J : kLeastVolume, inverse = 1.0 / at;
    const double square = inverse * inverse;
    return -mu * inverse + 0.25 * lambda * (at - square * inverse) +
           (J - at) * (mu * square + 0.25 * lambda * (1.0 + 3.0 * square * square));
  }
  /// h and its derivatives by J, Pa.
  struct Volumetric {
    double h, slope, curvature;
  };
  static Volumetric volumetric(double lambda, double mu, double J);
};

/// Elastic energy of a reduced body by cubature [AKJ08]: V(q) = sum_p w_p psi(1 + sum_i q_i grad
/// phi_i(x_p)), P points. O(P r) for energy and force, O(P r^2) for the stiffness; the mesh is not
/// needed. docs/method.md, P9.
class ElasticCubature {
 public:
  static constexpr int kVersion = 1;

  ElasticCubature() = default;
  /// `gradients`: 9 P x r, 1 per unit q; row (3 c + a) P + p: d(phi_i)_a / dx_c at point p.
  /// `weights` (m^3), `lambda`, `mu` (Pa): P.
  ElasticCubature(MatX gradients, VecX weights, VecX lambda, VecX mu);

  bool empty() const { return weights.size() == 0; }
  Eigen::Index points() const { return weights.size(); }

  double energy(const VecX& q) const;   // J
  VecX force(const VecX& q) const;      // r, dV/dq, N m per unit q
  MatX stiffness(const VecX& q) const;  // r x r, d2V/dq2
  /// Of every column of q (r x k): dV/dq, r x k.
  MatX forces(const MatX& q) const;
  /// What each point gives to force(q), r x P.
  MatX force_of_points(const VecX& q) const;
  /// det F at every point, P.
  VecX volumes(const VecX& q) const;

  MatX gradients;
  VecX weights, lambda, mu;

 private:
  MatX stresses(const MatX& q) const;

  MatX shear_;  // r x r, sum w mu grad^T grad: the part of the stiffness that no pose changes
};

}  // namespace archetide
