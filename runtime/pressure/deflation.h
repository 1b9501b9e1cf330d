#pragma once

#include <Eigen/Cholesky>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "runtime/numerics/lanes.h"
#include "runtime/numerics/multigrid.h"
#include "runtime/numerics/padded_layout.h"
#include "runtime/pressure/coupled_operator.h"

namespace archetide {

enum class DeflationChoice { kAuto, kNever, kAlways };

/// Deflation of the pressures that light bodies answer to (docs/method.md, C20; [D42]). A differs
/// from the water's operator by eigenvalues 1 + (added mass / body mass), up to 6 + r per body;
/// they cost iterations where bodies are light. Y = one V-cycle of a box around each body applied
/// to the columns of F, combined to the directions whose added mass exceeds kKept of the body's
/// own. With E = Y^T A Y, `correct` after a cycle is the A-DEF2 form of deflated conjugate
/// gradients [TNVE09]: it needs Y^T r = 0 at the start, which `start` brings about.
class Deflation {
 public:
  /// Builds Y and E, or nothing where that would cost more than the iterations to `tolerance` that
  /// it saves: fewer where the first guess is good (warm_start). `water`: of the operator's water.
  void setup(const CoupledOperator& op, const Multigrid& water, DeflationChoice choice,
             double tolerance, bool warm_start);

  bool empty() const { return columns_ == 0; }
  int columns() const { return columns_; }
  std::size_t bytes() const;

  /// z += Y E^-1 Y^T (scale r - A z), r per cell of the grid, z padded; response[c] is H^-1
  /// Fhat^T z of body c.
  void correct(const PoissonOperator& water, const PaddedLayout& layout, const double* r,
               double scale, const std::vector<VecX>& response, float* z);

  /// Iterations that the light bodies are expected to cost without deflation, and what building it
  /// costs in iterations.
  struct Expectation {
    double saved = 0.0, cost = 0.0;
  };

 private:
  /// A stretch of unknowns of a patch, within segment number `segment` of its plane.
  struct Run {
    int i, j, k;  // its first cell
    int length;
    std::size_t segment;
    std::size_t at;  // unknowns of the patch before it
  };
  /// Y of one body: columns first .. first + columns - 1 on a box of cells.
  struct Patch {
    int body = 0;
    Vec3i low = Vec3i::Zero(), size = Vec3i::Zero();
    std::vector<Run> runs;               // planes ascending
    std::vector<std::size_t> first_run;  // of each plane of the box, and the end
    std::size_t cells = 0;               // unknowns
    int first = 0, columns = 0;
    std::vector<float> y;                            // run by run: its columns one after the other
    std::vector<std::pair<std::size_t, MatX>> flux;  // body c near it, Fhat_c^T Y: dofs x columns

    std::size_t place(const Run& run, int c) const {
      return run.at * columns + static_cast<std::size_t>(c) * run.length;
    }
    const float* column(const Run& run, int c) const { return y.data() + place(run, c); }
    float* column(const Run& run, int c) { return y.data() + place(run, c); }
    std::span<const Run> plane(int k) const;  // runs of plane k of the grid
    /// The n-th run after one of these, null beyond the last.
    const Run* after(const Run& run, std::size_t n) const {
      const std::size_t at = static_cast<std::size_t>(&run - runs.data()) + n;
      return at < runs.size() ? &runs[at] : nullptr;
    }
  };
  class Dots;
  struct Local;
  class Spread;

  static Patch box_of(const CoupledOperator& op, std::size_t b);
  /// Directions of a body that are worth deflating, and its largest added mass / body mass.
  struct Light {
    MatX S;  // (6 + r) x directions
    double ratio = 0.0;
  };
  static Light light_directions(const CoupledOperator& op, const Patch& p);
  static Expectation expect(std::size_t unknowns, const std::vector<Patch>& patches,
                            const std::vector<Light>& light, double tolerance);
  void fill(const CoupledOperator& op, const Multigrid& water, const MatX& S, Local& local,
            Patch& p) const;
  void assemble(const CoupledOperator& op);
  using Near = std::vector<std::pair<const Patch*, const MatX*>>;  // patches, their Fhat^T Y
  static void add_answers(const CoupledOperator& op, std::size_t c, const Near& near, MatX& E);
  void add_rows(const CoupledOperator& op, const std::vector<Near>& near, MatX& E) const;
  static void find_flux(const CoupledOperator& op, Patch& p);
  void add_products(const CoupledOperator& op, Patch& p, MatX& E) const;
  MatX products(const PoissonMatrix& a, const Spread& y, const Patch& other) const;
  static void add_products_of_plane(const PoissonMatrix& a, const Spread& y, const Patch& other,
                                    int k, std::vector<Lanes>& sums);
  /// Enough of them for all threads: each takes whole ones. Otherwise threads share each.
  bool many_patches() const;
  static VecX gather(const PoissonOperator& water, const PaddedLayout& layout, const Patch& p,
                     int k, int end, const double* r, double scale, const float* z);
  static void scatter(const PaddedLayout& layout, const Patch& p, int k, const float* share,
                      float* z);

  std::vector<Patch> patches_;
  int columns_ = 0;
  Eigen::LLT<MatX> factor_;  // of E
  VecX weight_;
};

}  // namespace archetide
