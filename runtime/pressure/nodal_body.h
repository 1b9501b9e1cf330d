#pragma once

#include <memory>

#include "runtime/cut_cells/nodal_surface.h"
#include "runtime/solid/constrained_inverse.h"
#include "runtime/solid/nodal_inverse.h"

namespace archetide {

/// What a body of nodes answers to the k rows that are held of those on it (NodalRows): columns H^-1
/// J^T. Transposed they take forces to the velocities z of these rows.
struct RowAnswers {
  std::vector<int> which;  // of the K of NodalRows, ascending
  MatX whole;              // (6 + 3 n) x k
  MatX in_solve;           // NodalSurface::to_solve of it; empty without water
};

/// A body of nodes inside a coupled solve: its surface and its inverse mass.
class NodalBody {
 public:
  /// `surface`: null without water.
  NodalBody(std::shared_ptr<const NodalSurface> surface, NodalInverse inverse)
      : surface_(std::move(surface)), inverse_(std::move(inverse)) {}

  bool meets_water() const { return surface_ != nullptr; }
  const NodalSurface& surface() const { return *surface_; }
  const NodalInverse& inverse() const { return inverse_; }
  /// The same body with its answers to some rows of contacts and joints, those that a
  /// ConstrainedInverse holds.
  std::shared_ptr<const NodalBody> with_rows(std::shared_ptr<const RowAnswers> rows) const;
  const RowAnswers* rows() const { return rows_.get(); }  // null without

  /// H^-1 f, 6 + 3 n rows.
  MatX answer(const MatX& f) const { return inverse_.solve(f); }
  /// Velocities that forces of the solve (NodalSurface::rows()) make, of each body, in place; all
  /// bodies at once, since those of one kind share the passes over their factor.
  static void answer_in_solve(const std::vector<const NodalBody*>& bodies, std::vector<MatX>& f);

 private:
  std::shared_ptr<const NodalSurface> surface_;
  NodalInverse inverse_;
  std::shared_ptr<const RowAnswers> rows_;
};

/// What rows take from responses of bodies (H^-1 f times `scale`) to f. nodal(b): of body b, if of
/// nodes, its answers, and columns(answers) those in the coordinates of f; else null.
template <class Matrix, class Nodal, class Columns>
void constrain_responses(const ConstrainedInverse& rows, const Nodal& nodal, const Columns& columns,
                         double scale, const std::vector<Matrix>& f,
                         std::vector<Matrix>& response) {
  std::vector<char> as_forces(response.size(), 0);
  bool any = false;
  for (const int b : rows.bodies())
    if (nodal(b)) as_forces[b] = 1, any = true;
  if (!any) return rows.constrain(response);
  std::vector<Matrix> z(response.size());
  for (const int b : rows.bodies()) {
    if (!as_forces[b]) {
      z[b].swap(response[b]);
      continue;
    }
    z[b] = scale * (columns(*nodal(b)).transpose() * f[b]);
  }
  rows.constrain(z, as_forces);
  for (const int b : rows.bodies())
    if (as_forces[b])
      response[b].noalias() -= columns(*nodal(b)) * z[b];
    else
      response[b].swap(z[b]);
}

}  // namespace archetide
