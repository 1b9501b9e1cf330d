#pragma once

#include <vector>

#include "runtime/cut_cells/cell_box.h"
#include "runtime/cut_cells/dual_faces.h"

namespace archetide {

/// What a surface leaves in each cell of a box, lengths in cells.
struct CellMoments {
  Vec3 area = Vec3::Zero();    // integral of n
  double size = 0.0;           // area
  double moment_x = 0.0;       // integral of (x - cell centre) n_x
  double curvature = 0.0;      // integral of the mean curvature
  double volume = 0.0;         // of the solid (filled by sweep_surface)
  Vec3 moment = Vec3::Zero();  // of the solid's volume about the cell centre

  /// A planar piece of vector area `a`, centroid abscissa x - cell centre, mean squares of the
  /// coordinates about the cell centre, mean curvature kappa.
  void add(const Vec3& a, double x, const Vec3& squares, double kappa);
};

/// What a surface leaves in the cells of its box that it touches.
class SurfaceCells {
 public:
  explicit SurfaceCells(const CellBox& box) : slots_(box) {}
  const CellBox& box() const { return slots_.box(); }
  CellMoments& at(const Vec3i& cell) {
    const auto slot = static_cast<std::size_t>(slots_.slot(cell));
    if (slot == moments_.size()) moments_.emplace_back();
    return moments_[slot];
  }
  /// Null where the surface does not come.
  CellMoments* find(const Vec3i& cell) {
    const int slot = slots_.find(cell);
    return slot < 0 ? nullptr : &moments_[slot];
  }
  const std::vector<Vec3i>& cells() const { return slots_.cells(); }
  /// Of each of the cells.
  const std::vector<CellMoments>& moments() const { return moments_; }

 private:
  CellSlots slots_;
  std::vector<CellMoments> moments_;
};

/// What a surface leaves in the cells; `curvature`: of its vertices, 1/m.
SurfaceCells cell_moments(const Grid& g, const std::vector<Vec3>& points,
                          const std::vector<Vec3i>& triangles,
                          const std::vector<double>& curvature);

/// Mean curvature at the vertices of a closed outward surface, positive where it is convex, 1/m:
/// grad (area) / 2 along the normal, per area of the vertex.
std::vector<double> mean_curvature(const std::vector<Vec3>& points,
                                   const std::vector<Vec3i>& triangles);

/// Solid fractions by the divergence theorem: along each axis the solid fraction of a face is that
/// of the previous face minus the surface's projected area in the cell between them. Adds them to
/// `fractions` and returns the faces in the grid whose dual cell the surface crosses, columns -1.
/// Open areas of faces as the coefficients at walls: [NMG09].
std::vector<DualFace> sweep_surface(const Grid& g, SurfaceCells& surface,
                                    SolidFractions& fractions);

}  // namespace archetide
