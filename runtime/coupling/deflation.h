#pragma once

#include <Eigen/Cholesky>
#include <cstdint>
#include <vector>

#include "runtime/coupling/coupled_operator.h"

namespace archetide {

enum class DeflationChoice { kAuto, kNever, kAlways };

/// Deflation of the pressures that light bodies answer to (formulation section 3). A differs from
/// the water's operator by eigenvalues 1 + (added mass / body mass), up to 6 + r per body; they cost
/// iterations where bodies are light. Y = one V-cycle of a box around each body applied to the
/// columns of F, combined to the directions whose added mass exceeds kKept of the body's own. With
/// E = Y^T A Y, `correct` after a cycle is the A-DEF2 form of deflated conjugate gradients [Tang,
/// Nabben, Vuik, Erlangga 2009]: it needs Y^T r = 0 at the start, which `start` brings about.
class Deflation {
 public:
  /// Builds Y and E, or nothing where that would cost more than the iterations it saves.
  void setup(const CoupledOperator& op, DeflationChoice choice);

  bool empty() const { return columns_ == 0; }
  int columns() const { return columns_; }
  std::size_t bytes() const;

  /// v += Y E^-1 Y^T t, with t = r - A v given by the caller.
  void correct(const double* t, double* v);

  /// Iterations that the light bodies are expected to cost without deflation, and what building it
  /// costs in iterations.
  struct Expectation {
    double saved = 0.0, cost = 0.0;
  };
  static Expectation expect(const CoupledOperator& op);

 private:
  static constexpr int kBlock = 16;  // columns worked on at once
  using Block = std::vector<float>;  // cells of the patch x kBlock

  /// The unknowns of a row of a patch: `length` from grid cell `cell` on, from place `at` of blocks.
  struct Run {
    std::int64_t cell;
    int length;
    std::size_t at;
  };
  /// Y of one body: columns first .. first + columns - 1 on a box of cells.
  struct Patch {
    int body = 0;
    Vec3i low = Vec3i::Zero(), size = Vec3i::Zero();
    std::vector<Run> runs;
    std::size_t cells = 0;  // unknowns
    int first = 0, columns = 0;
    std::vector<Block> y;
  };
  class Local;

  static Patch box_of(const CoupledOperator& op, std::size_t b);
  void assemble(const CoupledOperator& op);
  void add_product(const CoupledOperator& op, const Patch& p, int block, MatX& E,
                   std::vector<MatX>& flux) const;

  std::vector<Patch> patches_;
  int columns_ = 0;
  Eigen::LLT<MatX> factor_;  // of E
  VecX weight_;
};

}  // namespace archetide
