#pragma once

#include <memory>

#include "runtime/cut_cells/nodal_surface.h"
#include "runtime/solid/constrained_inverse.h"
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
  /// The same body with its answers to rows of contacts and joints (NodalRows::answers), which a
  /// ConstrainedInverse may then hold.
  std::shared_ptr<const NodalBody> with_rows(std::shared_ptr<const MatX> answers) const;

  bool has_rows() const { return row_answers_ != nullptr; }
  /// Those answers, (6 + 3 n) x K, and as the solve sees them, NodalSurface::rows() x K. Transposed
  /// they take forces to the velocities z of the rows.
  const MatX& row_answers() const { return *row_answers_; }
  const MatX& row_answers_in_solve() const { return *row_answers_in_solve_; }

  /// H^-1 f, 6 + 3 n rows.
  MatX answer(const MatX& f) const { return inverse_.solve(f); }
  /// Velocities that forces of the solve (NodalSurface::rows()) make, of each body, in place; all
  /// bodies at once, since those of one kind share the passes over their factor.
  static void answer_in_solve(const std::vector<const NodalBody*>& bodies, std::vector<MatX>& f);

 private:
  std::shared_ptr<const NodalSurface> surface_;
  NodalInverse inverse_;
  std::shared_ptr<const MatX> row_answers_, row_answers_in_solve_;  // null without rows
};

/// What rows take from responses of bodies (H^-1 f times `scale`) to f. answers(b): of body b, if of
/// nodes, its answers to the rows in the coordinates of f, else null.
template <class Matrix, class Answers>
void constrain_responses(const ConstrainedInverse& rows, const Answers& answers, double scale,
                         const std::vector<Matrix>& f, std::vector<Matrix>& response) {
  std::vector<char> nodal(response.size(), 0);
  bool any = false;
  for (const int b : rows.bodies())
    if (answers(b)) nodal[b] = 1, any = true;
  if (!any) return rows.constrain(response);
  std::vector<Matrix> z(response.size());
  for (const int b : rows.bodies())
    if (nodal[b])
      z[b] = scale * (answers(b)->transpose() * f[b]);
    else
      z[b].swap(response[b]);
  rows.constrain(z, nodal);
  for (const int b : rows.bodies())
    if (nodal[b])
      response[b].noalias() -= *answers(b) * z[b];
    else
      response[b].swap(z[b]);
}

}  // namespace archetide
