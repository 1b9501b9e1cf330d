#pragma once

#include <omp.h>

#include <cmath>
#include <cstring>

#include "runtime/fluid/fluid_state.h"

namespace archetide::test {

/// Nothing but water and air.
inline const Array3<unsigned char> kNoSolid;

inline Grid unit_grid(int nx, int ny, int nz, double dx) {
  Grid g;
  g.nx = nx, g.ny = ny, g.nz = nz, g.dx = dx;
  return g;
}

template <class F>
Array3<double> sample_cells(const Grid& g, const F& f) {
  Array3<double> a(g.nx, g.ny, g.nz);
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) a(i, j, k) = f(g.cell_centre(i, j, k));
  return a;
}

/// f(axis, x) at the centre of every face.
template <class F>
MacField sample_faces(const Grid& g, const F& f) {
  MacField u(g);
  for (int a = 0; a < 3; ++a)
    for (int k = 0; k < u[a].nz(); ++k)
      for (int j = 0; j < u[a].ny(); ++j)
        for (int i = 0; i < u[a].nx(); ++i) u[a](i, j, k) = f(a, g.face_centre(a, i, j, k));
  return u;
}

template <class T>
bool same_bits(const Array3<T>& a, const Array3<T>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0;
}
inline bool same_bits(const MacField& a, const MacField& b) {
  return same_bits(a[0], b[0]) && same_bits(a[1], b[1]) && same_bits(a[2], b[2]);
}
inline bool same_bits(const Particles& a, const Particles& b) {
  return a.position == b.position && a.radius == b.radius && a.sign == b.sign;
}

/// Runs f with a number of threads and restores the old one.
template <class F>
void with_threads(int threads, const F& f) {
  const int before = omp_get_max_threads();
  omp_set_num_threads(threads);
  f();
  omp_set_num_threads(before);
}

/// Signed distance to a sphere.
inline double sphere(const Vec3& x, const Vec3& centre, double radius) {
  return (x - centre).norm() - radius;
}

}  // namespace archetide::test
