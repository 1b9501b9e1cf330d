#pragma once

#include <cstddef>
#include <vector>

#include "runtime/numerics/poisson_operator.h"
#include "runtime/numerics/vector_ops.h"

namespace archetide {

/// The connected components of unknowns (connected through faces with w > 0) that touch no
/// Dirichlet cell and no open side. On each of them A is singular: its indicator vector is in the
/// null space.
class ClosedComponents {
 public:
  void setup(const PoissonMatrix& matrix);
  /// The same, faster, from an operator that is set up for the matrix.
  void setup(const PoissonOperator& op);

  /// Where the water is in several parts: those that touch air or an open side.
  const std::vector<Blocks>& open_parts() const { return open_; }

  bool empty() const { return cells_of_.empty(); }
  std::size_t count() const { return cells_of_.size(); }
  /// The cells of component c as index ranges, in order.
  const Blocks& cells(std::size_t c) const { return cells_of_[c]; }
  /// Number of cells of component c.
  std::size_t size(std::size_t c) const { return cells_of_[c].entries; }

  /// The component that holds the cell, or -1.
  int region(std::size_t cell) const;

  /// The mean of v over component c.
  double mean(std::size_t c, const double* v) const;
  /// v = v - (mean of its component), cell by cell: the part of v in the range of A.
  void project(double* v) const;
  /// Adds s to v on component c.
  void add_constant(std::size_t c, double s, double* v) const;

 private:
  std::vector<Blocks> cells_of_, open_;
};

/// A closed tank as a solvable operator for pcg: A with its null space, for water without moving
/// bodies.
template <class Op>
class ProjectedOperator {
 public:
  ProjectedOperator(const Op& op, const ClosedComponents& closed) : op_(op), closed_(closed) {}
  std::size_t size() const { return op_.size(); }
  void apply(const double* x, double* y) const { op_.apply(x, y); }
  const Blocks& blocks() const { return op_.blocks(); }
  void project(double* v) const { closed_.project(v); }

 private:
  const Op& op_;
  const ClosedComponents& closed_;
};

}  // namespace archetide
