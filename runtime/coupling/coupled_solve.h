#pragma once

#include <vector>

#include "runtime/coupling/narrow_faces.h"
#include "runtime/numerics/multigrid.h"
#include "runtime/pressure/coupled_operator.h"
#include "runtime/pressure/coupled_pcg.h"
#include "runtime/pressure/deflation.h"

namespace archetide {

struct CoupledSolveOptions {
  double tolerance = 1e-8;  // relative, of the residual and of the velocities (energy norm)
  int max_iterations = 200;
  DeflationChoice deflation = DeflationChoice::kAuto;
  bool warm_start = false;  // the first guess is the pressure of a step before
};

/// Solves for the pressure that makes water and bodies agree, and applies it to both.
class CoupledSolver {
 public:
  /// `u` holds u* and receives u on the faces of unknown cells with an opening. valid = 1 on those
  /// of them that are not narrow, 0 elsewhere.
  /// `rows` tie bodies together (their y* keeps them already). `pressure` (phi = dt p'/(rho dx)
  /// minus its surface mean) is the first guess and the result.
  SolveReport solve(const Grid& g, const PressureSystem& system, double dt,
                    std::vector<CoupledBody>& bodies, const CoupledSolveOptions& options,
                    MacField& u, FaceField<unsigned char>& valid, Array3<double>& pressure,
                    const ConstrainedInverse* rows = nullptr);

  /// The first part of that: pressure and bodies. `same_water`: the system is that of the last call
  /// and only bodies or rows differ; what was prepared for the water is used again.
  SolveReport find_pressure(const Grid& g, const PressureSystem& system, double dt,
                            std::vector<CoupledBody>& bodies, const CoupledSolveOptions& options,
                            const MacField& u, Array3<double>& pressure,
                            const ConstrainedInverse* rows = nullptr, bool same_water = false);
  /// The second: u* becomes u.
  void move_water(const Grid& g, const PressureSystem& system, double dt,
                  const Array3<double>& pressure, MacField& u, FaceField<unsigned char>& valid);

  std::size_t bytes() const;

  /// Of the last solve: the narrow faces that it solved for, in the order of planes.
  const std::vector<NarrowFace>& narrow_faces() const { return narrow_; }
  /// Of the last solve that had water.
  const CoupledOperator& last_operator() const { return operator_; }
  int deflated_columns() const { return deflation_.columns(); }
  const std::vector<double>& last_right_hand_side() const { return rhs_; }

 private:
  VecX mean_push(std::size_t b, double impulse) const;

  CoupledOperator operator_;
  Multigrid multigrid_;
  Deflation deflation_;
  CoupledPcg pcg_;
  std::vector<double> rhs_;
  std::vector<NarrowFace> narrow_;
  std::vector<std::vector<NarrowFace>> narrow_planes_;  // work space
};

/// Largest |sum sign w u - Fhat y| / dx over unknown cells, 1/s; `where`: its cell.
double max_divergence(const Grid& g, const PressureSystem& system, const MacField& u,
                      const std::vector<CoupledBody>& bodies, Vec3i* where = nullptr);

}  // namespace archetide
