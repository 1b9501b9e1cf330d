#include "runtime/coupling/water_motion.h"

#include <cmath>
#include <vector>

namespace archetide {
namespace {

// Sums of m u, m u^2 and of m u times the position along the rows of the faces of one plane; each
// face in the lane of its place, so that the result does not depend on who adds it, and how.
struct RowSum {
  static constexpr int kLanes = 8;
  double flux[kLanes] = {}, twice[kLanes] = {}, moment[kLanes] = {};  // moment: of i
  void add(int lane, double mass, double u, int i) {
    const double p = mass * u;
    flux[lane] += p, twice[lane] += p * u, moment[lane] += p * i;
  }
  void add(double mass, double u, int i) { add(i % kLanes, mass, u, i); }
  static double whole(const double* lanes) {
    return ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) +
           ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
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
  return surface_theta(g, *s.surface.phi, *s.open, c, axis, low_wet ? 1 : -1);
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

// What there is of the water on a face, in e, in both measures.
struct Shares {
  double held, solved;
};
Shares shares(const Grid& g, const PressureSystem& s, const Array3<double>* held, int axis,
              const Vec3i& above) {
  const double e = s.matrix.w[axis](above[0], above[1], above[2]),
               solved = e == 0.0 ? 0.0 : e * share(g, s, axis, above);
  if (!held || e != 1.0 || above[axis] == 0 || above[axis] == g.size(axis)) return {solved, solved};
  const Vec3i below = above - Vec3i::Unit(axis);
  const double mean =
      0.5 * ((*held)(above[0], above[1], above[2]) + (*held)(below[0], below[1], below[2]));
  const bool known = mean == 0.0 || mean == 1.0 || uncut(g, *s.open, axis, above);
  return {known ? mean : solved, solved};
}

// The faces of component `axis` on the low sides of row (j, k) of cells.
class FaceRow {
 public:
  FaceRow(const Grid& grid, const PressureSystem& system, const Array3<double>* in_cells,
          const MacField& velocity, int component, int row, int layer)
      : g(grid), s(system), held(in_cells), u(velocity), axis(component), j(row), k(layer) {}

  void add_to(WaterMotion& sum) const {
    const RowKind low =
                      kind(axis == 0 || (axis == 1 ? j : k) > 0, j - (axis == 1), k - (axis == 2)),
                  high = kind(axis == 0 || (axis == 1 ? j < g.ny : k < g.nz), j, k);
    const bool all_air = low == RowKind::kAir && high == RowKind::kAir;
    if (all_air && !held) return;
    const auto water = [](RowKind r) { return r == RowKind::kWater || r == RowKind::kInner; };
    if (const double* filled = filled_row(); filled && (all_air || (water(low) && water(high)))) {
      const RowSum row = row_sum(filled, first(), last());
      add(row, sum.held);
      if (!all_air) add(row, sum.solved);
      return;
    }
    const int faces = u[axis].nx();
    std::vector<double> by_held(faces);
    const std::vector<unsigned char> plain = plain_shares(by_held.data());
    std::vector<double> by_solve = by_held;
    for (int i = 0; i < faces; ++i) {
      if (plain[i]) continue;
      const Shares of = shares(g, s, held, axis, {i, j, k});
      by_held[i] = of.held, by_solve[i] = of.solved;
    }
    add(row_sum(by_held.data(), 0, faces), sum.held);
    add(row_sum(by_solve.data(), 0, faces), sum.solved);
  }

 private:
  RowKind kind(bool exists, int at_j, int at_k) const {
    return exists ? s.row(at_j, at_k) : RowKind::kAir;
  }

  // Sets the shares, 1 or 0 in both measures, of faces that are open between full cells, closed, or
  // between empty cells; returns which ones.
  std::vector<unsigned char> plain_shares(double* share) const {
    std::vector<unsigned char> plain(u[axis].nx(), 0);
    if (at_side()) return plain;
    const std::ptrdiff_t below = step_below();
    const double *e = &s.matrix.w[axis](0, j, k), *full = held ? &(*held)(0, j, k) : nullptr;
    const CellKind* kinds = &s.matrix.kind(0, j, k);
    const auto wet = [&](std::ptrdiff_t n) { return kinds[n] == CellKind::kUnknown; };
    const auto both_hold = [&](int i, double water) {
      return !full || (full[i] == water && full[i - below] == water);
    };
    for (int i = first(); i < last(); ++i) {
      const bool above = wet(i), under = wet(i - below);
      const bool filled = e[i] == 1.0 && above && under && both_hold(i, 1.0);
      const bool empty = e[i] == 0.0 || (!above && !under && both_hold(i, 0.0));
      share[i] = filled ? 1.0 : 0.0;
      plain[i] = filled || empty;
    }
    return plain;
  }

  bool at_side() const {  // of the tank, the whole row
    return (axis == 1 && (j == 0 || j == g.ny)) || (axis == 2 && (k == 0 || k == g.nz));
  }
  std::ptrdiff_t step_below() const {  // from a cell to the one below the face on its low side
    return axis == 0 ? 1 : axis == 1 ? g.nx : static_cast<std::ptrdiff_t>(g.nx) * g.ny;
  }

  // What the cells above hold, if everywhere both are full, or both are empty, and no solid cuts.
  const double* filled_row() const {
    if (!held || at_side()) return nullptr;
    const double *e = &s.matrix.w[axis](0, j, k), *above = &(*held)(0, j, k),
                 *below = above - step_below();
    int other = 0;
#pragma omp simd reduction(| : other)
    for (int i = first(); i < last(); ++i)
      other |= (above[i] != below[i]) | ((above[i] != 1.0) & (above[i] != 0.0)) | (e[i] != 1.0);
    // along x the tank's sides are faces of the row as well
    const bool open_end = axis == 0 && (e[0] != 0.0 || e[g.nx] != 0.0);
    return other || open_end ? nullptr : above;
  }
  int first() const { return axis == 0; }
  int last() const { return u[axis].nx() - (axis == 0); }

  // Of faces begin <= i < end.
  RowSum row_sum(const double* share, int begin, int end) const {
    const double* v = &u[axis](0, j, k);
    RowSum sum;
    int i = begin;
    for (; i < end && i % RowSum::kLanes != 0; ++i) sum.add(share[i], v[i], i);
    for (; i + RowSum::kLanes <= end; i += RowSum::kLanes)
#pragma omp simd
      for (int lane = 0; lane < RowSum::kLanes; ++lane)
        sum.add(lane, share[i + lane], v[i + lane], i + lane);
    for (; i < end; ++i) sum.add(share[i], v[i], i);
    return sum;
  }

  void add(const RowSum& row, Motion& sum) const {
    const double flux = RowSum::whole(row.flux);
    sum.P[axis] += flux;
    sum.kinetic += 0.5 * RowSum::whole(row.twice);
    // sum of x m u, by x = first face + dx i along x
    const Vec3 arm =
        flux * g.face_centre(axis, 0, j, k) + g.dx * RowSum::whole(row.moment) * Vec3::UnitX();
    sum.L += arm.cross(Vec3::Unit(axis));
  }

  const Grid& g;
  const PressureSystem& s;
  const Array3<double>* held;
  const MacField& u;
  const int axis, j, k;
};

}  // namespace

WaterMotion water_motion(const Grid& g, const PressureSystem& system, const Array3<double>* held,
                         const MacField& u) {
  std::vector<WaterMotion> planes(g.nz + 1);
#pragma omp parallel for schedule(dynamic, 4)
  for (int k = 0; k <= g.nz; ++k)
    for (int j = 0; j <= g.ny; ++j)
      for (int axis = 0; axis < 3; ++axis)
        if ((axis == 1 || j < g.ny) && (axis == 2 || k < g.nz))
          FaceRow(g, system, held, u, axis, j, k).add_to(planes[k]);
  WaterMotion total;
  for (const WaterMotion& plane : planes) total += plane;
  const double mass = system.hydrostatics.density * g.dx * g.dx * g.dx;
  for (Motion* m : {&total.held, &total.solved}) m->P *= mass, m->L *= mass, m->kinetic *= mass;
  return total;
}

double energy_above(const Grid& g, const PressureSystem& s, const Array3<double>& held,
                    const FaceField<unsigned char>& valid, double most, const MacField& u) {
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const Array3<double>& speed = u[axis];
    std::vector<double> planes(speed.nz(), 0.0);
#pragma omp parallel for schedule(static, 1)
    for (int k = 0; k < speed.nz(); ++k)
      for (int j = 0; j < speed.ny(); ++j)
        for (int i = 0; i < speed.nx(); ++i) {
          const double v = speed(i, j, k);
          if (std::abs(v) <= most || valid[axis](i, j, k) != 1) continue;
          const double mass = shares(g, s, &held, axis, {i, j, k}).held;
          planes[k] += 0.5 * mass * (v * v - most * most);
        }
    for (const double plane : planes) sum += plane;
  }
  return s.hydrostatics.density * g.dx * g.dx * g.dx * sum;
}

}  // namespace archetide
