#pragma once

#include <vector>

#include "runtime/solid/reduced_body.h"

namespace archetide {

/// The generalised mass of a body held at m points of a wall, C y = target: what the coupled solve
/// uses instead of H so that a body lying on the floor is at rest to round-off under any load,
/// water included.
///
///   1. rows C of the points (contact_rows), reduced to pressing_rows(H, C, y*, target): those
///      that the load before the coupled solve presses on the wall;
///   2. K(H, C, target); the coupled solve starts from K.project(y*) and uses K.solve for H⁻¹;
///   3. with y_free = y* + H⁻¹ Fᵀ p, y = K.project(y_free) (what the solve has found); P and L
///      change by the first six entries of Cᵀ K.impulses(y_free). A negative impulse is a point
///      that is pulled: drop it and solve again, or let push_apart(y_free) release it (and add
///      friction) after the solve.
///
/// Redundant rows (four corners of a rigid box) are ordinary: eigenvalues of C H⁻¹ Cᵀ below 1e-10
/// of the largest count as zero, and the impulses are those of least norm.
class ConstrainedMass {
 public:
  /// `inverse_mass`: H⁻¹, or that of H with the water's dual-cell mass. `target`: m, separating
  /// speeds at the points, m/s; empty: zero.
  ConstrainedMass(const MatX& inverse_mass, MatX rows, VecX target = VecX());
  /// The same of a mass that is never formed; `response`: H⁻¹ Cᵀ. inverse() stays empty.
  struct Response {
    MatX of_rows;  // (6 + r) x m
  };
  ConstrainedMass(Response response, MatX rows, VecX target);

  const MatX& rows() const { return rows_; }
  /// H⁻¹ − H⁻¹ Cᵀ (C H⁻¹ Cᵀ)⁺ C H⁻¹ itself.
  const MatX& inverse() const { return inverse_; }

  /// inverse() f: symmetric, positive semi-definite.
  VecX solve(const VecX& f) const { return inverse_ * f; }
  /// H⁻¹ Cᵀ and (C H⁻¹ Cᵀ)⁺, what inverse() takes away.
  const MatX& response() const { return response_; }
  const MatX& gram_inverse() const { return gram_inverse_; }
  /// The velocity nearest to y in the energy norm that gives every point its target.
  VecX project(const VecX& y) const;
  /// λ = (C H⁻¹ Cᵀ)⁺ (target − C y), m, N s along the normals: project(y) = y + H⁻¹ Cᵀ λ.
  VecX impulses(const VecX& y) const;

 private:
  MatX inverse_;       // (6 + r) x (6 + r)
  MatX rows_;          // C, m x (6 + r)
  VecX target_;        // m
  MatX response_;      // H⁻¹ Cᵀ, (6 + r) x m
  MatX gram_inverse_;  // (C H⁻¹ Cᵀ)⁺, m x m
};

/// Rows that are tight when impulses may only push: C y' ≤ target + 1e-12 of the largest speed
/// after the unilateral solve. Redundant rows all stay. An empty target is zero.
std::vector<int> pressing_rows(const GeneralisedMass& H, const MatX& rows, const VecX& y,
                               const VecX& target = VecX());

}  // namespace archetide
