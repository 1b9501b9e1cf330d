#include "runtime/grid/grid.h"

#include <algorithm>
#include <cmath>

namespace archetide {
namespace {

// Cell of the interpolation lattice and the fractions in it, clamped to the lattice.
struct Stencil {
  int i, j, k;
  double fx, fy, fz;
};

inline void locate(double s, int n, int& i, double& f) {
  s = std::clamp(s, 0.0, static_cast<double>(n - 1));
  i = std::min(static_cast<int>(s), std::max(n - 2, 0));
  f = s - i;
}

template <class T>
Stencil stencil(const Array3<T>& a, const Vec3& s) {
  Stencil t;
  locate(s[0], a.nx(), t.i, t.fx);
  locate(s[1], a.ny(), t.j, t.fy);
  locate(s[2], a.nz(), t.k, t.fz);
  return t;
}

// The eight corner values; a lattice with one point along an axis repeats it.
template <class T>
void corners(const Array3<T>& a, const Stencil& t, double c[8]) {
  const std::size_t sx = a.nx() > 1 ? 1 : 0;
  const std::size_t sy = a.ny() > 1 ? a.nx() : 0;
  const std::size_t sz = a.nz() > 1 ? static_cast<std::size_t>(a.nx()) * a.ny() : 0;
  const T* p = a.data() + a.index(t.i, t.j, t.k);
  c[0] = p[0], c[1] = p[sx], c[2] = p[sy], c[3] = p[sx + sy];
  c[4] = p[sz], c[5] = p[sz + sx], c[6] = p[sz + sy], c[7] = p[sz + sx + sy];
}

template <class T>
double trilinear(const Array3<T>& a, const Vec3& s) {
  const Stencil t = stencil(a, s);
  double c[8];
  corners(a, t, c);
  const double c00 = c[0] + t.fx * (c[1] - c[0]), c10 = c[2] + t.fx * (c[3] - c[2]);
  const double c01 = c[4] + t.fx * (c[5] - c[4]), c11 = c[6] + t.fx * (c[7] - c[6]);
  const double c0 = c00 + t.fy * (c10 - c00), c1 = c01 + t.fy * (c11 - c01);
  return c0 + t.fz * (c1 - c0);
}

}  // namespace

double interpolate(const Grid& g, const Array3<double>& values, const Vec3& x) {
  return trilinear(values, (x - g.origin) / g.dx - Vec3::Constant(0.5));
}

Vec3 interpolate_gradient(const Grid& g, const Array3<double>& values, const Vec3& x) {
  const Stencil t = stencil(values, (x - g.origin) / g.dx - Vec3::Constant(0.5));
  double c[8];
  corners(values, t, c);
  const auto lerp = [](double a, double b, double f) { return a + f * (b - a); };
  const double gx =
      lerp(lerp(c[1] - c[0], c[3] - c[2], t.fy), lerp(c[5] - c[4], c[7] - c[6], t.fy), t.fz);
  const double gy =
      lerp(lerp(c[2] - c[0], c[3] - c[1], t.fx), lerp(c[6] - c[4], c[7] - c[5], t.fx), t.fz);
  const double gz =
      lerp(lerp(c[4] - c[0], c[5] - c[1], t.fx), lerp(c[6] - c[2], c[7] - c[3], t.fx), t.fy);
  return Vec3(gx, gy, gz) / g.dx;
}

double interpolate_component(const Grid& g, const MacField& u, int axis, const Vec3& x) {
  Vec3 s = (x - g.origin) / g.dx - Vec3::Constant(0.5);
  s[axis] += 0.5;
  return trilinear(u[axis], s);
}

Vec3 interpolate(const Grid& g, const MacField& u, const Vec3& x) {
  return {interpolate_component(g, u, 0, x), interpolate_component(g, u, 1, x),
          interpolate_component(g, u, 2, x)};
}

void close_sides(const Grid& g, const Sides& open_side, FaceField<double>& field) {
  for (int side = 0; side < 6; ++side) {
    if (open_side[side]) continue;
    const int axis = side / 2, b = (axis + 1) % 3, c = (axis + 2) % 3;
    Array3<double>& component = field[axis];
#pragma omp parallel for schedule(static)
    for (int n = 0; n < g.size(c); ++n) {
      Vec3i f;
      f[axis] = side % 2 ? g.size(axis) : 0;
      f[c] = n;
      for (f[b] = 0; f[b] < g.size(b); ++f[b]) component(f[0], f[1], f[2]) = 0.0;
    }
  }
}

double max_speed(const MacField& u) {
  double m = 0.0;
  for (const auto& component : u.axis)
    for (std::size_t n = 0; n < component.size(); ++n) m = std::max(m, std::abs(component[n]));
  return m;
}

}  // namespace archetide
