#include "runtime/coupling/water_motion.h"

#include <vector>

namespace archetide {
namespace {

// Sums of m u, m u^2 and of m u times the position along the rows of the faces of one plane.
struct RowSum {
  double flux = 0.0, twice = 0.0, moment = 0.0;  // moment: of i
  void add(double mass, double u, int i) {
    flux += mass * u, twice += mass * u * u, moment += mass * u * i;
  }
};

// Share of the face of `axis` below cell `high` that is water's: 1, theta, or 0.
double share(const Grid& g, const PressureSystem& s, int axis, const Vec3i& high) {
  const Array3<CellKind>& kind = s.matrix.kind;
  const auto wet = [&](const Vec3i& c) {
    return kind.contains(c[0], c[1], c[2]) && kind(c[0], c[1], c[2]) == CellKind::kUnknown;
  };
  const Vec3i low = high - Vec3i::Unit(axis);
  const bool low_wet = wet(low), high_wet = wet(high);
  if (low_wet && high_wet) return 1.0;
  if (!low_wet && !high_wet) return 0.0;
  const Vec3i& c = low_wet ? low : high;
  return surface_face(g, s.surface, *s.open, s.hydrostatics, c, axis, low_wet ? 1 : -1).theta;
}

// Whether no solid cuts any face of the cells beside a face.
bool uncut(const Grid& g, const FaceField<double>& open, int axis, const Vec3i& high) {
  for (int side = 0; side < 2; ++side) {
    Vec3i c = high;
    c[axis] -= side;
    for (int a = 0; a < 3; ++a)
      for (int up = 0; up < 2; ++up) {
        Vec3i f = c;
        f[a] += up;
        const bool tank_side = f[a] == 0 || f[a] == g.size(a);
        if (!tank_side && open[a](f[0], f[1], f[2]) < 1.0) return false;
      }
  }
  return true;
}

// What there is of the water on a face, in e: by what its cells hold where no solid cuts them.
double face_share(const Grid& g, const PressureSystem& s, const Array3<double>* held, int axis,
                  const Vec3i& above) {
  const double e = s.matrix.w[axis](above[0], above[1], above[2]);
  if (!held || e != 1.0 || above[axis] == 0 || above[axis] == g.size(axis))
    return share(g, s, axis, above);
  const Vec3i below = above - Vec3i::Unit(axis);
  const double mean =
      0.5 * ((*held)(above[0], above[1], above[2]) + (*held)(below[0], below[1], below[2]));
  const bool known = mean == 0.0 || mean == 1.0 || uncut(g, *s.open, axis, above);
  return known ? mean : share(g, s, axis, above);
}

// Adds the faces of component `axis` on the low sides of row (j, k) of cells.
void add_row(const Grid& g, const PressureSystem& s, const Array3<double>* held, const MacField& u,
             int axis, int j, int k, Motion& sum) {
  const bool has_low = axis == 0 || (axis == 1 ? j : k) > 0,
             has_high = axis == 0 || (axis == 1 ? j < g.ny : k < g.nz);
  const RowKind low = has_low ? s.row(j - (axis == 1), k - (axis == 2)) : RowKind::kAir,
                high = has_high ? s.row(j, k) : RowKind::kAir;
  if (low == RowKind::kAir && high == RowKind::kAir && !held) return;
  const double *e = &s.matrix.w[axis](0, j, k), *v = &u[axis](0, j, k);
  const int count = u[axis].nx();
  const int begin = axis == 0, end = count - (axis == 0);  // of an x row the ends have one cell
  RowSum row;
  const double* filled = nullptr;  // shares of faces whose cells are both full, or both empty
  if (held && has_low && has_high) {
    const double *above = &(*held)(0, j, k),
                 *below = above - (axis == 0   ? 1
                                   : axis == 1 ? g.nx
                                               : static_cast<std::ptrdiff_t>(g.nx) * g.ny);
    int other = 0;
#pragma omp simd reduction(| : other)
    for (int i = begin; i < end; ++i)
      other |= (above[i] != below[i]) | ((above[i] != 1.0) & (above[i] != 0.0)) | (e[i] != 1.0);
    if (!other) filled = above;
  }
  const auto add = [&](int i) {
    if (e[i] != 0.0) row.add(e[i] * face_share(g, s, held, axis, {i, j, k}), v[i], i);
  };
  if (filled) {
    double flux = 0.0, twice = 0.0, moment = 0.0;
#pragma omp simd reduction(+ : flux, twice, moment)
    for (int i = begin; i < end; ++i) {
      const double p = filled[i] * v[i];
      flux += p, twice += p * v[i], moment += p * i;
    }
    row = {flux, twice, moment};
  } else {
    for (int i = begin; i < end; ++i) add(i);
  }
  if (axis == 0) add(0), add(count - 1);
  const Vec3 first = g.face_centre(axis, 0, j, k);
  sum.P[axis] += row.flux;
  sum.kinetic += 0.5 * row.twice;
  // sum of x m u, by x = first + dx i along x
  const Vec3 arm = row.flux * first + g.dx * row.moment * Vec3::UnitX();
  sum.L += arm.cross(Vec3::Unit(axis));
}

}  // namespace

Motion water_motion(const Grid& g, const PressureSystem& system, const Array3<double>* held,
                    const MacField& u) {
  std::vector<Motion> planes(g.nz + 1);
#pragma omp parallel for schedule(dynamic, 4)
  for (int k = 0; k <= g.nz; ++k)
    for (int j = 0; j <= g.ny; ++j) {
      if (j < g.ny && k < g.nz) add_row(g, system, held, u, 0, j, k, planes[k]);
      if (k < g.nz) add_row(g, system, held, u, 1, j, k, planes[k]);
      if (j < g.ny) add_row(g, system, held, u, 2, j, k, planes[k]);
    }
  Motion total;
  for (const Motion& plane : planes) total += plane;
  const double mass = system.hydrostatics.density * g.dx * g.dx * g.dx;
  return {mass * total.P, mass * total.L, mass * total.kinetic};
}

}  // namespace archetide
