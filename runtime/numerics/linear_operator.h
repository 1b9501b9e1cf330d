#pragma once

#include <concepts>
#include <cstddef>

namespace archetide {

/// Anything that maps a vector to a vector: y = A x, both with size() entries, x and y distinct.
/// An operator may also offer
///   blocks():    the pieces of a vector that matter (vector_ops.h); everything else is neither
///                read nor written
///   project(v):  removes the null space of A from v (a singular A, a right-hand side that may be
///                incompatible)
template <class Op>
concept LinearOperator = requires(const Op& op, const double* x, double* y) {
  { op.size() } -> std::convertible_to<std::size_t>;
  op.apply(x, y);
};

/// Anything with apply(r, z), z approximately A^-1 r; symmetric positive definite for pcg.
template <class M>
concept Preconditioner = requires(M& m, const double* r, double* z) {
  m.apply(r, z);
};

}  // namespace archetide
