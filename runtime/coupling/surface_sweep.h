#pragma once

#include <vector>

#include "runtime/coupling/dual_faces.h"

namespace archetide {

/// Box of cells around a surface and one layer of cells more, clamped to one layer outside the
/// grid.
struct CellBox {
  Vec3i low = Vec3i::Zero(), size = Vec3i::Zero();
  std::size_t index(const Vec3i& c) const {
    const Vec3i d = c - low;
    return d[0] +
           static_cast<std::size_t>(size[0]) * (d[1] + static_cast<std::size_t>(size[1]) * d[2]);
  }
  std::size_t count() const { return static_cast<std::size_t>(size[0]) * size[1] * size[2]; }
};
CellBox cell_box(const Grid& g, const std::vector<Vec3>& points);

/// What a surface leaves in each cell of a box, lengths in cells.
struct CellMoments {
  Vec3 area = Vec3::Zero();  // integral of n
  double size = 0.0;         // area
  double moment_x = 0.0;     // integral of (x - cell centre) n_x
  double curvature = 0.0;    // integral of the mean curvature
  double volume = 0.0;       // of the solid (filled by sweep_surface)

  /// A planar piece of vector area `a`, centroid abscissa x - cell centre, mean curvature kappa.
  void add(const Vec3& a, double x, double kappa);
};

/// What a surface leaves in each cell of its box; `curvature`: of its vertices, 1/m.
std::vector<CellMoments> cell_moments(const Grid& g, const CellBox& box,
                                      const std::vector<Vec3>& points,
                                      const std::vector<Vec3i>& triangles,
                                      const std::vector<double>& curvature);

/// Mean curvature at the vertices of a closed outward surface, positive where it is convex, 1/m:
/// grad (area) / 2 along the normal, per area of the vertex.
std::vector<double> mean_curvature(const std::vector<Vec3>& points,
                                   const std::vector<Vec3i>& triangles);

/// Solid fractions by the divergence theorem: along each axis the solid fraction of a face is that
/// of the previous face minus the surface's projected area in the cell between them. Adds them to
/// `fractions` and returns the faces in the grid whose dual cell the surface crosses, columns -1.
std::vector<DualFace> sweep_surface(const Grid& g, const CellBox& box,
                                    std::vector<CellMoments>& moments, SolidFractions& fractions);

}  // namespace archetide
