#pragma once

// Shared by the CHOLMOD translation units only.

#include <fmt/core.h>
#include <suitesparse/cholmod.h>

#include "common/base/input_error.h"
#include "precompute/modal/elasticity.h"

namespace archetide {

/// A CHOLMOD workspace that prints nothing and uses only the supernodal method on a given ordering.
struct CholmodCommon {
  cholmod_common common;
  CholmodCommon() {
    cholmod_start(&common);
    common.print = 0;
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_GIVEN;
    common.postorder = 1;
  }
  ~CholmodCommon() { cholmod_finish(&common); }
  CholmodCommon(const CholmodCommon&) = delete;
  CholmodCommon& operator=(const CholmodCommon&) = delete;

  /// Throws unless the last call succeeded.
  void require(bool good, const char* what) const {
    if (good && common.status == CHOLMOD_OK) return;
    if (common.status == CHOLMOD_OUT_OF_MEMORY || common.status == CHOLMOD_TOO_LARGE)
      throw MachineError(std::string(what) + ": out of memory; use fewer tets");
    throw NumericsError(fmt::format("{} failed (CHOLMOD status {})", what, common.status));
  }
};

/// The lower triangle of a symmetric matrix as CHOLMOD sees it; borrows, never owns.
inline cholmod_sparse cholmod_view(const SparseMatrix& matrix) {
  cholmod_sparse view{};
  view.nrow = std::size_t(matrix.rows());
  view.ncol = std::size_t(matrix.cols());
  view.nzmax = std::size_t(matrix.nonZeros());
  view.p = const_cast<int*>(matrix.outerIndexPtr());
  view.i = const_cast<int*>(matrix.innerIndexPtr());
  view.x = const_cast<double*>(matrix.valuePtr());
  view.stype = -1;
  view.itype = CHOLMOD_INT;
  view.xtype = CHOLMOD_REAL;
  view.dtype = CHOLMOD_DOUBLE;
  view.sorted = 1;
  view.packed = 1;
  return view;
}

}  // namespace archetide
