#pragma once

#include <array>

#include "common/base/types.h"
#include "runtime/grid/array3.h"

namespace archetide {

/// The box of cubic cells that holds the tank. Cell (i,j,k) covers origin + dx [i,i+1] x [j,j+1] x
/// [k,k+1].
struct Grid {
  int nx = 0, ny = 0, nz = 0;
  double dx = 0.0;             // m
  Vec3 origin = Vec3::Zero();  // low corner of the tank, m

  std::size_t cells() const { return static_cast<std::size_t>(nx) * ny * nz; }
  Vec3 cell_centre(int i, int j, int k) const {
    return origin + dx * Vec3(i + 0.5, j + 0.5, k + 0.5);
  }
  Vec3 low() const { return origin; }
  Vec3 high() const { return origin + dx * Vec3(nx, ny, nz); }
  int size(int axis) const { return axis == 0 ? nx : axis == 1 ? ny : nz; }
  /// Position of the centre of MAC face (i,j,k) of `axis` (the low face of cell (i,j,k)).
  Vec3 face_centre(int axis, int i, int j, int k) const {
    Vec3 offset(i + 0.5, j + 0.5, k + 0.5);
    offset[axis] -= 0.5;
    return origin + dx * offset;
  }
};

/// The six sides of the tank in the order xmin, xmax, ymin, ymax, zmin, zmax.
enum Side : int { kXMin, kXMax, kYMin, kYMax, kZMin, kZMax };
using Sides = std::array<bool, 6>;

/// One value per MAC face; component a has one more face than cells along axis a.
template <class T>
struct FaceField {
  std::array<Array3<T>, 3> axis;

  FaceField() = default;
  explicit FaceField(const Grid& g, T value = T()) { resize(g, value); }
  void resize(const Grid& g, T value = T()) {
    for (int a = 0; a < 3; ++a)
      axis[a].resize(g.nx + (a == 0), g.ny + (a == 1), g.nz + (a == 2), value);
  }
  /// The same field with nz layers of cells: those that it has stay, further ones hold `value`.
  void set_layers(int nz, T value = T()) {
    for (int a = 0; a < 3; ++a) axis[a].set_layers(nz + (a == 2), value);
  }
  Array3<T>& operator[](int a) { return axis[a]; }
  const Array3<T>& operator[](int a) const { return axis[a]; }
};

/// to = from, on all threads.
template <class T>
void copy_values(const FaceField<T>& from, FaceField<T>& to) {
  for (int a = 0; a < 3; ++a) copy_values(from[a], to[a]);
}

/// Face-normal velocities on the staggered grid [HW65], m/s.
using MacField = FaceField<double>;

/// Trilinear interpolation of cell-centred values at world position x, clamped to the outermost
/// centres.
double interpolate(const Grid& g, const Array3<double>& cell_values, const Vec3& x);

/// Trilinear gradient of cell-centred values at world position x (derivative of `interpolate`).
Vec3 interpolate_gradient(const Grid& g, const Array3<double>& cell_values, const Vec3& x);

/// Trilinear interpolation of one component / all components of a MAC field, clamped at the
/// boundary.
double interpolate_component(const Grid& g, const MacField& u, int axis, const Vec3& x);
Vec3 interpolate(const Grid& g, const MacField& u, const Vec3& x);

/// Sets the field to zero on the faces that lie in closed sides of the tank.
void close_sides(const Grid& g, const Sides& open_side, FaceField<double>& field);

/// Largest |component| over all faces, m/s.
double max_speed(const MacField& u);

}  // namespace archetide
