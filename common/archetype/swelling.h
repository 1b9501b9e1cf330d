#pragma once

#include <array>

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// What linear modes add at second order to the volume V that a surface encloses and to its
/// centroid c: ln V(q) = ln V(0) + a.q / V(0) + q^T E q + O(q^3), and, once the shape is scaled
/// about the origin so that E is undone, c_k(q) = c_k(0) + b_k.q + q^T C_k q + O(q^3). A turn by an
/// angle t drawn as straight displacements swells a body by t^2, and no strain energy resists it: E
/// and C are what undoes it. All r x r, symmetric; empty: not known.
struct Swelling {
  MatX volume;                   // E, 1
  std::array<MatX, 3> centroid;  // C, m
};

/// `modes`: 3 n x r, of the vertices, row 3 v + axis. O(nf r + n r^2).
Swelling second_order_swelling(const TriMesh& surface, const MatX& modes);

/// The same without modes: of displacements of the vertices, for bodies of nodes. O(nf) a use.
class SurfaceSwelling {
 public:
  explicit SurfaceSwelling(const TriMesh& surface);
  /// E u and C_k u for displacements u of the vertices, 3 n, m: 1/m and 1.
  struct Products {
    VecX volume;
    std::array<VecX, 3> centroid;
  };
  Products operator*(const VecX& u) const;

 private:
  Products second_order(const VecX& u) const;

  std::vector<Vec3i> triangles_;
  std::vector<Vec3> rest_;     // m
  double volume_ = 0.0;        // m^3
  VecX rate_;                  // d ln V / du, 1/m
  Vec3 middle_;                // c(0), m
  std::array<VecX, 3> first_;  // of the moments over V(0), 1
};

}  // namespace archetide
