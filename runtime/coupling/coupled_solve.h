#pragma once

#include <vector>

#include "runtime/coupling/body_flux.h"
#include "runtime/coupling/pressure_system.h"
#include "runtime/numerics/components.h"
#include "runtime/numerics/multigrid.h"
#include "runtime/numerics/pcg.h"

namespace archetide {

/// One body inside a coupled solve: in its flux, its mass and uncoupled velocity; out its velocity.
struct CoupledBody {
  BodyFlux flux;      // F; columns of cells without an unknown are ignored
  MatX inverse_mass;  // (6 + r)^2: H^-1, or its constrained form (contact, joints): symmetric,
                      // semi-definite
  VecX y_star;        // 6 + r, velocity without the dynamic pressure
  VecX y;             // result: y* - H^-1 F^T dt p'
  VecX impulse;       // result: -F^T dt p', generalised impulse of the dynamic pressure, N s
};

struct CoupledSolveOptions {
  double tolerance = 1e-8;  // relative residual
  int max_iterations = 200;
};

/// The full operator of formulation sections 3 and 4 on pressure alone, scaled like PoissonMatrix:
///     A = A_water + sum over bodies  rho dx^3 Fhat H^-1 Fhat^T,   Fhat = F / dx^2.
/// Symmetric positive (semi-)definite; rank 6 + r per body, never formed.
class CoupledOperator {
 public:
  void setup(const Grid& g, const PressureSystem& system, double density,
             const std::vector<CoupledBody>& bodies);

  std::size_t size() const { return water_.size(); }
  const Blocks& blocks() const { return water_.blocks(); }
  void apply(const double* x, double* y) const;
  /// Removes the null space: constants on closed water regions that no body's motion can answer.
  void project(double* v) const;

  const PoissonOperator& water() const { return water_; }
  const ClosedComponents& closed() const { return closed_; }
  /// z += E (E^T A E)^+ E^T r over the indicators E of closed regions.
  void add_closed_correction(const double* r, double* z) const;

  /// Fhat^T x of body b, 6 + r, and y += Fhat v.
  VecX gather(std::size_t b, const double* x) const;
  void scatter(std::size_t b, const VecX& v, double* y) const;

 private:
  struct Body {
    std::vector<std::int64_t> cell;  // m, with an unknown
    MatX flux;                       // (6 + r) x m, Fhat
    MatX inverse_mass;               // rho dx^3 H^-1
  };
  void setup_closed_regions();

  PoissonOperator water_;
  ClosedComponents closed_;
  std::vector<Body> bodies_;
  MatX null_vectors_;    // closed regions x null directions
  MatX closed_inverse_;  // (E^T A E)^+, E normalised
};

/// Solves for the pressure that makes water and bodies agree, and applies it to both.
class CoupledSolver {
 public:
  /// `u` holds u* and receives u on the faces of unknown cells with an opening. valid = 1 on those
  /// of them whose opening is large enough for the velocity to mean something, 0 elsewhere.
  /// `pressure` (phi = dt p'/(rho dx) minus its surface mean) is the first guess and the result.
  SolveReport solve(const Grid& g, const PressureSystem& system, double dt,
                    std::vector<CoupledBody>& bodies, const CoupledSolveOptions& options,
                    MacField& u, FaceField<unsigned char>& valid, Array3<double>& pressure);

  std::size_t bytes() const;

  /// Of the last solve that had water.
  const CoupledOperator& last_operator() const { return operator_; }
  const std::vector<double>& last_right_hand_side() const { return rhs_; }

 private:
  CoupledOperator operator_;
  Multigrid multigrid_;
  PcgWorkspace workspace_;
  std::vector<double> rhs_;
};

/// Largest |sum sign w u - Fhat y| / dx over unknown cells, 1/s.
double max_divergence(const Grid& g, const PressureSystem& system, const MacField& u,
                      const std::vector<CoupledBody>& bodies);

}  // namespace archetide
