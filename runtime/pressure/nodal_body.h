#pragma once

#include <memory>

#include "runtime/cut_cells/nodal_surface.h"
#include "runtime/solid/nodal_inverse.h"

namespace archetide {

/// A body of nodes inside a coupled solve: its surface and its inverse mass.
class NodalBody {
 public:
  /// `surface`: null without water.
  NodalBody(std::shared_ptr<const NodalSurface> surface, NodalInverse inverse)
      : surface_(std::move(surface)), inverse_(std::move(inverse)) {}

  const NodalSurface& surface() const { return *surface_; }
  const NodalInverse& inverse() const { return inverse_; }
  /// The same body with X G X^T less of its inverse mass, X (6 + 3 n) x k: what walls hold.
  std::shared_ptr<const NodalBody> held(const MatX& X, const MatX& G) const;

  /// H^-1 f, 6 + 3 n rows.
  MatX answer(const MatX& f) const { return inverse_.solve(f); }
  /// Velocities that forces of the solve (NodalSurface::rows()) make, of each body, in place; all
  /// bodies at once, since those of one kind share the passes over their factor.
  static void answer_in_solve(const std::vector<const NodalBody*>& bodies, std::vector<MatX>& f);

 private:
  std::shared_ptr<const NodalSurface> surface_;
  NodalInverse inverse_;
};

}  // namespace archetide
