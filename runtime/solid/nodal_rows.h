#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "runtime/solid/nodal_inverse.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

/// How much of the displacement of a place of the body is that of a vertex of its surface.
struct VertexShare {
  int vertex = -1;
  double weight = 0.0;
};
using VertexShares = std::vector<VertexShare>;

/// Displacement of a place of a body of nodes that moves with these vertices, body frame, m.
Vec3 displacement_of(const ReducedBody& body, const VertexShares& moved);
/// The same of other displacements u of the nodes, 3 n.
Vec3 displacement_of(const ReducedBody& body, const VertexShares& moved, const VecX& u);
/// deformed_arm() of such a place, world, m.
Vec3 deformed_arm(const ReducedBody& body, const Vec3& rest, const VertexShares& moved);

/// A body of nodes as contacts and joints see it (docs/method.md, C17b): by the velocities z = J y
/// of its points in their frames, K of them, three a point. What the points answer to impulses on
/// them, J H^-1 J^T, is a small dense matrix, and in these coordinates a row of a contact or a
/// joint is a unit vector. J itself is never formed: each point moves with a few nodes and with
/// seven numbers of all.
///
/// First all points are added, then the inverse mass is given.
class NodalRows {
 public:
  /// `terms`: of the configuration of the points. Both must live until the inverse mass is given.
  NodalRows(const ReducedBody& body, const ConfigurationTerms& terms);

  /// Three rows more, frame times the velocity of a point at this arm (world, m) from the centre of
  /// mass. `item`: the contact or joint that they are of, ascending; several points may be of one.
  void add(int item, const Mat3& frame, const Vec3& arm, VertexShares moved);
  int size() const { return 3 * static_cast<int>(points_.size()); }  // K
  /// The rows of an item in coordinates z: units from `first_row` on, 3 points x K.
  MatX rows_of(int item) const;
  int first_row(int item) const;

  void set_inverse(NodalInverse inverse);
  /// From here on with the inverse mass.
  MatX velocity(const MatX& y) const { return forces_.velocities(y); }  // J y, columns side by side
  MatX force(const MatX& g) const { return forces_.forces(g); }         // J^T g, (6 + 3 n) rows
  const MatX& inverse_mass() const { return inverse_mass_; }            // J H^-1 J^T, K x K
  MatX answer(const MatX& g) const { return inverse_->solve(force(g)); }  // H^-1 J^T g
  MatX answers(const std::vector<int>& rows) const;  // those columns of H^-1 J^T
  MatX reduced() const;  // NodalSpace::reduced_velocity of H^-1 J^T, (6 + r) x K

 private:
  struct Point {
    int item;
    Mat3 frame;
    Vec3 arm;  // world, m
    VertexShares moved;
  };

  RowForces forces_of_points() const;

  const ReducedBody* body_;
  const ConfigurationTerms* terms_;
  std::vector<Point> points_;
  RowForces forces_;  // J^T
  std::optional<NodalInverse> inverse_;
  MatX inverse_mass_;
};

/// Of each body; null: its rows are written in its own velocities.
using RowsOfNodes = std::vector<std::unique_ptr<NodalRows>>;

/// Gives them the inverses of these masses.
void set_inverses(const std::vector<const GeneralisedMass*>& H, const RowsOfNodes& rows);

}  // namespace archetide
