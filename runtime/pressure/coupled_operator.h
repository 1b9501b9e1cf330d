#pragma once

#include <cstdint>
#include <vector>

#include "runtime/cut_cells/body_flux.h"
#include "runtime/numerics/components.h"
#include "runtime/numerics/poisson_operator.h"
#include "runtime/pressure/nodal_body.h"
#include "runtime/pressure/pressure_system.h"
#include "runtime/solid/constrained_inverse.h"

namespace archetide {

/// One body inside a coupled solve: in its flux, its mass and uncoupled velocity; out its velocity.
/// Of a body of nodes `inverse_mass` is the reduced block (NodalInverse::block) and
/// `nodes` the whole, y has 6 + 3 n entries.
struct CoupledBody {
  BodyFlux flux;      // F; columns of cells without an unknown are ignored
  MatX inverse_mass;  // (6 + r)^2: H^-1, or its constrained form: symmetric, semi-definite
  VecX y_star;        // 6 + r, velocity without the dynamic pressure; keeps the rows, if any
  VecX y;             // result: y* - H^-1 F^T dt p' (with rows their constrained inverse)
  VecX impulse;       // result: -F^T dt p', generalised impulse of the dynamic pressure, N s
  std::shared_ptr<const NodalBody> nodes = nullptr;  // a body of nodes
  VecX y_before = VecX();  // 6 + r, of the step's start where closed water asks for it; else empty

  /// H^-1 f, 6 + r.
  VecX answer(const VecX& f) const { return nodes ? VecX(nodes->answer(f)) : inverse_mass * f; }
  /// F^T y of column m of the flux, m^3/s, with `motion`: y, or NodalSurface::to_solve of it.
  double pushed(std::size_t m, const VecX& motion) const;
  VecX motion(const VecX& v) const { return nodes ? VecX(nodes->surface().to_solve(v)) : v; }
};

/// CoupledBody::answer of every body to f[b]; bodies of nodes of one kind share their passes.
std::vector<VecX> answers(const std::vector<CoupledBody>& bodies, const std::vector<VecX>& f);
/// The same where rows tie the bodies; null: none.
std::vector<VecX> answers(const std::vector<CoupledBody>& bodies, const std::vector<VecX>& f,
                          const ConstrainedInverse* rows);

/// Eq. 45 with the constraint impulses lambda eliminated (docs/method.md, C14): an operator on the
/// pressure alone, scaled like PoissonMatrix:
///     A = A_water + sum over bodies  rho dx^3 Fhat H^-1 Fhat^T,   Fhat = F / dx^2.
/// Symmetric positive (semi-)definite; rank 6 + r per body, never formed. Bodies that rows tie
/// together answer as one: H^-1 is then their constrained inverse (Eq. 49 with lambda_a
/// eliminated).
/// The system before bodies are reduced: [RMSF11].
class CoupledOperator {
 public:
  /// Of the next setup().
  void setup_water(const PressureSystem& system);
  /// `rows`: of these bodies' inverse masses, must stay as they are as long as the operator is
  /// used; null: none. `same_water`: the water and the fluxes are those of the last setup.
  void setup(const Grid& g, const PressureSystem& system, double density,
             const std::vector<CoupledBody>& bodies, const ConstrainedInverse* rows = nullptr,
             bool same_water = false);

  std::size_t size() const { return water_.size(); }
  const Blocks& blocks() const { return water_.blocks(); }
  void apply(const double* x, double* y) const;
  /// Removes the null space: constants on closed water regions that no body's motion can answer.
  void project(double* v) const;
  /// Largest sum over a closed region of what project takes from v.
  double incompatible(const double* v) const;

  const PoissonOperator& water() const { return water_; }
  const ClosedComponents& closed() const { return closed_; }
  /// Whether b leaves this part of the water, open to air, as it is: no body beside it, and with x the
  /// constant that is returned no entry of A x - b above `most`.
  bool stands_still(const Blocks& part, const double* b, double most, double& constant) const;
  /// Whether any body lies beside a cell with an unknown; if not, the solve is that of water alone.
  bool touches_bodies() const;
  /// z += E (E^T A E)^+ E^T r over the indicators E of closed regions; the constants themselves.
  void add_closed_correction(const double* r, double* z) const;
  VecX closed_correction(const double* r) const;

  struct Body {
    std::vector<std::int64_t> cell;                   // m, with an unknown, ascending
    MatX flux;                                        // (6 + r) x m, Fhat
    MatX inverse_mass;                                // rho dx^3 H^-1
    Vec3i low = Vec3i::Zero(), high = Vec3i::Zero();  // box around the cells
    MatX added_mass;                                  // over rho dx^3, roughly: from the flux alone

    // A body of nodes: flux, inverse and added mass are the reduced ones. In the solve
    // its forces and velocities have rows() entries, those of NodalSurface::to_body and to_solve.
    std::shared_ptr<const NodalBody> nodes = nullptr;
    SurfaceFlux surface = {};  // over dx^2, columns of the same cells
    Eigen::Index rows() const { return nodes ? nodes->surface().rows() : flux.rows(); }
    /// Forces of columns of pressures at its cells, m x k.
    MatX gather(const MatX& values) const;
  };
  /// What the water sees of a body.
  static Body body_of(const Grid& g, const PressureSystem& system, double density,
                      const CoupledBody& coupled);
  const std::vector<Body>& bodies() const { return bodies_; }

  /// What rows take from rho dx^3 H^-1 f; of bodies that none touch nothing is looked at.
  template <class Matrix>
  void hold(const std::vector<Matrix>& f, std::vector<Matrix>& response) const;
  /// rho dx^3 H^-1 f of every body, in place, rows kept.
  void respond(std::vector<VecX>& f) const;
  /// The same of the bodies of nodes alone.
  void respond_nodes(const std::vector<VecX>& f, std::vector<VecX>& response) const;
  /// rho dx^3 H^-1 of body b, without rows, times columns of forces.
  MatX respond_alone(std::size_t b, const MatX& f) const;
  /// The generalised force (6 + r) that f stands for in the solve.
  VecX on_body(std::size_t b, const VecX& f) const;
  /// The bodies' own blocks of that inverse.
  MatX own_inverse(std::size_t b) const;
  /// Null where no rows are.
  const ConstrainedInverse* rows() const { return rows_; }

  /// Fhat^T x of body b, rows().
  VecX gather(std::size_t b, const double* x) const;
  /// The same of x at other places than its cells.
  VecX gather(std::size_t b, const std::vector<std::size_t>& place, const float* x) const;
  std::vector<VecX> gather(const double* x) const;  // of all
  /// y += factor Fhat v[b] of every body b; the same numbers for any count of threads.
  void scatter(const std::vector<VecX>& v, double factor, double* y) const;

  /// Of a solution A x = b: x^T A_water x, the kinetic energy that the pressure gives to the water,
  /// and v^T M v with the bodies' added masses M, that of the water which has to follow the bodies
  /// with the velocities v = y - H^-1 F^T x that they are left with.
  struct Energies {
    double water = 0.0, bodies = 0.0;
  };
  Energies energies(const double* x, const double* b, const std::vector<VecX>& y) const;

 private:
  VecX closed_norms() const;
  VecX along_constants(const double* v) const;
  VecX null_part(const double* v) const;
  void setup_closed_regions();
  void share_cells();

  PoissonOperator water_;
  ClosedComponents closed_;
  const Array3<double>* surface_weight_ = nullptr;  // of the system
  std::vector<Body> bodies_;
  // The cells of the grid that each thread adds to, [part_[t], part_[t + 1]): as many of bodies.
  std::vector<std::int64_t> part_;
  double to_scaled_mass_ = 0.0;  // rho dx^3
  const ConstrainedInverse* rows_ = nullptr;
  MatX null_vectors_;    // closed regions x null directions
  MatX closed_inverse_;  // (E^T A E)^+, E normalised
};

}  // namespace archetide
