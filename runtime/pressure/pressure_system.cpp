#include "runtime/pressure/pressure_system.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "common/base/exception_carrier.h"
#include "runtime/fluid/cell_list.h"
#include "runtime/fluid/time_splitting.h"

namespace archetide {
namespace {

Vec3i neighbour(Vec3i c, int axis, int sign) {
  c[axis] += sign;
  return c;
}

bool in_grid(const Grid& g, const Vec3i& c) {
  return (c.array() >= 0).all() && c[0] < g.nx && c[1] < g.ny && c[2] < g.nz;
}

double face_value(const FaceField<double>& f, const Vec3i& c, int axis, int sign) {
  Vec3i n = c;
  if (sign > 0) ++n[axis];
  return f[axis](n[0], n[1], n[2]);
}

CellKind classify(const Grid& g, const Array3<double>& phi, const FaceField<double>& open,
                  const Vec3i& c) {
  double w = 0.0;
  for (int a = 0; a < 3; ++a) w += face_value(open, c, a, -1) + face_value(open, c, a, 1);
  constexpr double kClosed = 1e-9;  // a cell whose openings are round-off holds no water
  if (w < kClosed) return CellKind::kOutside;
  if (w == 6.0) return phi(c[0], c[1], c[2]) < 0.0 ? CellKind::kUnknown : CellKind::kDirichlet;
  return wet_point(g, phi, open, c).phi < 0.0 ? CellKind::kUnknown : CellKind::kDirichlet;
}

// Slope of phi from cell c along an axis to the side where the water lies: mirror images have
// mirrored ones, and none where no cell is.
double slope_towards(const Grid& g, const Array3<double>& phi, const Vec3i& c, int axis,
                     double direction) {
  const int side = direction < 0.0 ? -1 : 1;
  for (const int sign : {side, -side}) {
    const Vec3i n = neighbour(c, axis, sign);
    if (in_grid(g, n)) return sign * (phi(n[0], n[1], n[2]) - phi(c[0], c[1], c[2])) / g.dx;
  }
  return 0.0;
}

// The interface carries grad p' times the way that it is moved back; where that is not the same all
// around, it makes the next grad p', way / dx times the last one. Beyond this way, cells along an
// axis, it is therefore less, as 1 / way: only thin jets go as far. (A ring falling into a tub of
// 192^3, CFL 3 for all but 1e-4 of the water: cut off at 1 or 2 cells, the jets blew up.)
constexpr double kFarthestPush = 1.0;

}  // namespace

// Eq. C10.
double carried_pressure(const Grid& g, const FreeSurface& surface, const Vec3& gravity,
                        const Vec3& x) {
  if (!surface.carrier) return 0.0;
  double sum = 0.0, pushed = 0.0, farthest = 0.0, square = 0.0;  // square: of grad p' / rho
  for (int axis = 0; axis < 3; ++axis) {
    if (gravity[axis] == 0.0 && !surface.push) continue;
    const double u = interpolate_component(g, *surface.carrier, axis, x), way = surface.shift * u;
    if (surface.push) {
      const double a = interpolate_component(g, *surface.push, axis, x) / surface.push_seconds;
      pushed += a * way;
      square += a * a;
      farthest = std::max(farthest, std::abs(way) / g.dx);
    }
    if (gravity[axis] == 0.0) continue;
    sum += gravity[axis] * way;
  }
  // In impacts the pressure would feed on itself [D38].
  const double usual = surface.usual_acceleration;
  const double share = usual > 0.0 ? share_without_impact(std::sqrt(square) / usual) : 1.0;
  const double beyond = farthest / kFarthestPush;
  return share * (sum + (beyond > 1.0 ? pushed / (beyond * beyond) : pushed));
}

WetPoint wet_point(const Grid& g, const Array3<double>& phi, const FaceField<double>& open,
                   const Vec3i& c) {
  WetPoint p{g.cell_centre(c[0], c[1], c[2]), phi(c[0], c[1], c[2])};
  // Mean opening of the six faces and its imbalance, the direction in which the water lies. A
  // closed side of the tank is no solid: it counts like the face opposite to it.
  Vec3 towards;
  double mean = 0.0;
  for (int a = 0; a < 3; ++a) {
    double low = face_value(open, c, a, -1), high = face_value(open, c, a, 1);
    if (c[a] == 0 && low == 0.0) low = high;
    if (c[a] == g.size(a) - 1 && high == 0.0) high = low;
    towards[a] = high - low;
    mean += (low + high) / 6.0;
  }
  const double largest = towards.cwiseAbs().maxCoeff();
  if (mean >= 1.0 || largest == 0.0) return p;
  const Vec3 offset = 0.5 * g.dx * (1.0 - mean) / largest * towards;
  p.x += offset;
  for (int a = 0; a < 3; ++a) p.phi += offset[a] * slope_towards(g, phi, c, a, offset[a]);
  return p;
}

namespace {

// Where the interface crosses the segment between the wet points on both sides of a face; on an
// open side of the tank: the face, or before it.
struct Crossing {
  double theta;          // cells from the water's point, 0 to 1
  Vec3 point;            // m
  bool is_side = false;  // the open side itself, which stays where it is [D80]
};
Crossing crossing(const Grid& g, const Array3<double>& phi, const FaceField<double>& open,
                  const Vec3i& c, int axis, int sign) {
  const Vec3i n = neighbour(c, axis, sign);
  const WetPoint inside = wet_point(g, phi, open, c);
  if (!in_grid(g, n)) {
    const double theta = std::clamp(-inside.phi / g.dx, 0.0, 0.5);
    return {theta, inside.x + sign * theta * g.dx * Vec3::Unit(axis), theta == 0.5};
  }
  const WetPoint outside = wet_point(g, phi, open, n);
  const double theta = std::clamp(inside.phi / (inside.phi - outside.phi), 0.0, 1.0);
  return {theta, inside.x + theta * (outside.x - inside.x)};
}

}  // namespace

double surface_theta(const Grid& g, const Array3<double>& phi, const FaceField<double>& open,
                     const Vec3i& c, int axis, int sign) {
  return std::max(crossing(g, phi, open, c, axis, sign).theta, kThetaMin);
}

// Eq. C12.
SurfaceFace surface_face(const Grid& g, const FreeSurface& surface, const FaceField<double>& open,
                         const Hydrostatics& hydrostatics, const Vec3i& c, int axis, int sign) {
  const Crossing at = crossing(g, *surface.phi, open, c, axis, sign);
  const bool water = at.is_side && surface.water_beyond[2 * axis + (sign > 0)];
  double value = hydrostatics.surface_value(water ? surface.level : at.point);
  if (!at.is_side) value += carried_pressure(g, surface, hydrostatics.gravity, at.point);
  return {std::max(at.theta, kThetaMin), value};
}

namespace {

// One plane of cells. Sums are added in plane order so that the result does not depend on threads.
struct PlaneSums {
  double value = 0.0;
  std::size_t faces = 0, unknowns = 0;
  std::vector<std::size_t> at_surface;  // cells with a prescribed value beside them
};

// The four rows beside row (j, k) of cells, towards low and high y and z, by what row(axis, sign)
// is.
template <class T, class RowOf>
std::array<const T*, 4> rows_beside(const RowOf& row) {
  return {row(1, -1), row(1, 1), row(2, -1), row(2, 1)};
}

// Row of the faces of cells (., j, k) across `axis` on the side of `sign`.
const double* face_row(const FaceField<double>& f, int j, int k, int axis, int sign) {
  return &f[axis](0, j + (axis == 1 && sign > 0), k + (axis == 2 && sign > 0));
}

// The kinds of row (j, k); returns whether a solid cuts any of its cells. Cells that no solid cuts
// are sampled at their centre; the closed sides of the tank cut nothing. `ones`: nx times 1,
// `whole`: nx numbers to work on.
bool classify_row(const Grid& g, const Array3<double>& phi, const FaceField<double>& open,
                  const Sides& open_side, int j, int k, const double* ones, unsigned char* whole,
                  CellKind* kind) {
  const auto faces = rows_beside<double>([&](int axis, int sign) {
    const int n = axis == 1 ? j : k;
    const bool at_side = sign < 0 ? n == 0 : n == g.size(axis) - 1;
    const bool closed = at_side && !open_side[2 * axis + (sign > 0)];
    return closed ? ones : face_row(open, j, k, axis, sign);
  });
  const double *x = &open[0](0, j, k), *level = &phi(0, j, k);
  const int nx = g.nx;
  int cut = 0;
#pragma omp simd reduction(| : cut)
  for (int i = 0; i < nx; ++i) {
    const bool low = (x[i] == 1.0) | ((i == 0) & !open_side[kXMin]),
               high = (x[i + 1] == 1.0) | ((i == nx - 1) & !open_side[kXMax]);
    whole[i] = low & high & (faces[0][i] == 1.0) & (faces[1][i] == 1.0) & (faces[2][i] == 1.0) &
               (faces[3][i] == 1.0);
    kind[i] = level[i] < 0.0 ? CellKind::kUnknown : CellKind::kDirichlet;
    cut |= !whole[i];
  }
  for (int i = 0; cut && i < nx; ++i)
    if (!whole[i]) kind[i] = classify(g, phi, open, {i, j, k});
  return cut != 0;
}

// Rows whose openings or coefficients may differ from those of the last assembly, and their
// neighbours.
std::vector<char> touched_rows(const Grid& g, const std::vector<DualFaces*>& solids,
                               const std::vector<CellBox>* changed) {
  std::vector<char> rows(static_cast<std::size_t>(g.ny) * g.nz, changed == nullptr);
  if (!changed) return rows;
  const auto touch = [&](int j0, int j1, int k0, int k1) {
    for (int k = std::max(k0 - 1, 0); k <= std::min(k1 + 1, g.nz - 1); ++k)
      for (int j = std::max(j0 - 1, 0); j <= std::min(j1 + 1, g.ny - 1); ++j)
        rows[j + static_cast<std::size_t>(g.ny) * k] = 1;
  };
  for (const CellBox& box : *changed)
    touch(box.low[1], box.low[1] + box.size[1], box.low[2], box.low[2] + box.size[2]);
  int last_j = -1, last_k = -1;  // faces of one row follow each other
  for (const DualFaces* faces : solids)
    for (const DualFace& f : *faces) {
      if (f.face[1] != last_j || f.face[2] != last_k)
        touch(f.face[1], f.face[1], f.face[2], f.face[2]);
      last_j = f.face[1], last_k = f.face[2];
    }
  return rows;
}

// Kinds of a row that no solid cuts, and what it is as a whole; nothing is written where that is
// what it was `before`.
RowKind classify_whole_row(const Grid& g, const double* phi, RowKind before, CellKind* kind) {
  const int nx = g.nx;
  int wet = 0;
#pragma omp simd reduction(+ : wet)
  for (int i = 0; i < nx; ++i) wet += phi[i] < 0.0;
  if (wet == nx) {
    if (before != RowKind::kWater && before != RowKind::kInner)
      std::fill_n(kind, nx, CellKind::kUnknown);
    return RowKind::kWater;
  }
  if (wet == 0) {
    if (before != RowKind::kAir) std::fill_n(kind, nx, CellKind::kDirichlet);
    return RowKind::kAir;
  }
#pragma omp simd
  for (int i = 0; i < nx; ++i) kind[i] = phi[i] < 0.0 ? CellKind::kUnknown : CellKind::kDirichlet;
  return RowKind::kMixed;
}

// Whether row (j, k) and the four beside it are water, or sides of the tank that are closed.
bool is_inner(const Grid& g, const Sides& open_side, const std::vector<RowKind>& rows, int j,
              int k) {
  const auto water = [&](int jj, int kk, int side) {
    if (jj < 0 || kk < 0 || jj == g.ny || kk == g.nz) return !open_side[side];
    return rows[jj + static_cast<std::size_t>(g.ny) * kk] >= RowKind::kWater;
  };
  return water(j, k, kXMin) && !open_side[kXMin] && !open_side[kXMax] && water(j - 1, k, kYMin) &&
         water(j + 1, k, kYMax) && water(j, k - 1, kZMin) && water(j, k + 1, kZMax);
}

// Eq. 23 at the surface [GFCK02]: diagonal and right-hand side of an unknown that has, or may have,
// a prescribed value beside it.
void assemble_at_surface(const Grid& g, const Vec3i& c, PressureSystem& s, PlaneSums& sums) {
  PoissonMatrix& A = s.matrix;
  const std::size_t n = A.kind.index(c[0], c[1], c[2]);
  A.diag[n] = 0.0;
  for (int axis = 0; axis < 3; ++axis)
    for (int sign = -1; sign <= 1; sign += 2) {
      const double w = face_value(A.w, c, axis, sign);
      if (w == 0.0) continue;
      const Vec3i m = neighbour(c, axis, sign);
      if (in_grid(g, m) && A.kind(m[0], m[1], m[2]) != CellKind::kDirichlet) {
        A.diag[n] += w;
        continue;
      }
      const SurfaceFace x = surface_face(g, s.surface, *s.open, s.hydrostatics, c, axis, sign);
      A.diag[n] += w / x.theta;
      s.surface_weight[n] += w / x.theta;
      s.surface_rhs[n] += w / x.theta * x.value;
      sums.value += x.value;
      ++sums.faces;
    }
  sums.at_surface.push_back(n);
}

// Eq. 23: diagonal and surface terms of row (j, k). `air`: nx times kDirichlet, what lies beyond
// the tank; `beside`: nx numbers to work on (C13).
void assemble_row(const Grid& g, int j, int k, const CellKind* air, unsigned char* beside,
                  PressureSystem& s, PlaneSums& sums) {
  const PoissonMatrix& A = s.matrix;
  const auto w =
      rows_beside<double>([&](int axis, int sign) { return face_row(A.w, j, k, axis, sign); });
  const auto kinds = rows_beside<CellKind>([&](int axis, int sign) {
    const Vec3i m = neighbour({0, j, k}, axis, sign);
    return in_grid(g, m) ? &A.kind(0, m[1], m[2]) : air;
  });
  const double* x = &A.w[0](0, j, k);
  const CellKind* kind = &A.kind(0, j, k);
  double* diag = &s.matrix.diag(0, j, k);
  int unknowns = 0;
#pragma omp simd reduction(+ : unknowns)
  for (int i = 0; i < g.nx; ++i) {
    const bool unknown = kind[i] == CellKind::kUnknown;
    bool air_beside = false;
    for (int n = 0; n < 4; ++n)
      air_beside |= (w[n][i] != 0.0) & (kinds[n][i] == CellKind::kDirichlet);
    beside[i] = unknown & air_beside;
    const double sum = x[i] + x[i + 1] + w[0][i] + w[1][i] + w[2][i] + w[3][i];
    diag[i] = unknown ? sum : 0.0;
    unknowns += unknown;
  }
  sums.unknowns += unknowns;
  for (int i = 0; i < g.nx; ++i) {
    if (kind[i] != CellKind::kUnknown) continue;
    const bool at_end = i == 0 || i == g.nx - 1;
    if (beside[i] || at_end || kind[i - 1] == CellKind::kDirichlet ||
        kind[i + 1] == CellKind::kDirichlet)
      assemble_at_surface(g, {i, j, k}, s, sums);
  }
}

// Sizes of the system; true if the grid is another than before, and nothing is known of it.
bool fit_to_grid(const Grid& g, PressureSystem& s) {
  PoissonMatrix& A = s.matrix;
  if (A.nx == g.nx && A.ny == g.ny && A.nz == g.nz) return false;
  A.nx = g.nx, A.ny = g.ny, A.nz = g.nz;
  A.kind.resize(g.nx, g.ny, g.nz);
  A.diag.resize(g.nx, g.ny, g.nz);
  s.surface_rhs.resize(g.nx, g.ny, g.nz);
  s.surface_weight.resize(g.nx, g.ny, g.nz);
  s.at_surface.clear();
  s.rows.assign(static_cast<std::size_t>(g.ny) * g.nz, RowKind::kMixed);
  return true;
}

// The matrix has the openings of the faces, until dual faces share theirs.
void take_openings(const FaceField<double>& open, const std::vector<DualFaces*>& solids,
                   const std::vector<CellBox>* changed, PoissonMatrix& A) {
  if (changed)
    for (const CellBox& box : *changed) copy_box(open, box, A.w);
  else
    copy_values(open, A.w);
  for (const DualFaces* faces : solids)
#pragma omp parallel for schedule(static) if (faces->size() > kParallelFrom)
    for (const DualFace& f : *faces) {
      const Vec3i& at = f.face;
      A.w[f.axis](at[0], at[1], at[2]) = open[f.axis](at[0], at[1], at[2]);
    }
}

// Which cells hold unknowns. Rows of one kind that nothing has `touched` since they were classified
// `before` stay as they are.
void classify_rows(const Grid& g, const FreeSurface& surface, const FaceField<double>& open,
                   const Sides& open_side, const std::vector<char>& touched,
                   const std::vector<RowKind>& before, PressureSystem& s) {
  const std::vector<double> ones(g.nx, 1.0);
  ExceptionCarrier carrier;
#pragma omp parallel
  {
    std::vector<unsigned char> whole;
    carrier.run([&] { whole.resize(g.nx); });
#pragma omp for schedule(dynamic, 4)
    for (int k = 0; k < g.nz; ++k)
      for (int j = 0; j < g.ny && !carrier.caught(); ++j) {
        const std::size_t r = j + static_cast<std::size_t>(g.ny) * k;
        CellKind* kind = &s.matrix.kind(0, j, k);
        const bool known = !touched[r] && before[r] != RowKind::kMixed;
        const bool cut = !known && classify_row(g, *surface.phi, open, open_side, j, k, ones.data(),
                                                whole.data(), kind);
        s.rows[r] = touched[r] || cut
                        ? RowKind::kMixed
                        : classify_whole_row(g, &(*surface.phi)(0, j, k), before[r], kind);
      }
  }
  carrier.rethrow();
}

// Diagonal and surface terms of all rows, but of those that are what they were `before`. Returns
// the sums of each plane.
std::vector<PlaneSums> assemble_rows(const Grid& g, const Sides& open_side,
                                     const std::vector<RowKind>& before, PressureSystem& s) {
  const std::vector<CellKind> air(g.nx, CellKind::kDirichlet);
  std::vector<PlaneSums> sums(g.nz);
  std::vector<RowKind> next(s.rows.size());
  ExceptionCarrier carrier;
#pragma omp parallel
  {
    std::vector<unsigned char> beside;
    carrier.run([&] { beside.resize(g.nx); });
#pragma omp for schedule(dynamic, 4)
    for (int k = 0; k < g.nz; ++k)
      for (int j = 0; j < g.ny && !carrier.caught(); ++j) {
        const std::size_t r = j + static_cast<std::size_t>(g.ny) * k;
        const bool inner = is_inner(g, open_side, s.rows, j, k);
        next[r] = inner ? RowKind::kInner : s.rows[r];
        if (next[r] == before[r] && (inner || next[r] == RowKind::kAir)) {
          sums[k].unknowns += inner ? g.nx : 0;
          continue;  // its diagonal is what it was
        }
        const CellKind* row = &s.matrix.kind(0, j, k);
        if (std::find(row, row + g.nx, CellKind::kUnknown) != row + g.nx)
          assemble_row(g, j, k, air.data(), beside.data(), s, sums[k]);
        else
          std::fill_n(&s.matrix.diag(0, j, k), g.nx, 0.0);
      }
  }
  carrier.rethrow();
  s.rows.swap(next);
  return sums;
}

// Takes the mean of the surface's values out of the right-hand side.
void take_out_mean(const std::vector<PlaneSums>& sums, PressureSystem& s) {
  double total = 0.0;
  std::size_t faces = 0;
  s.unknowns = 0;
  s.at_surface.clear();
  for (const PlaneSums& p : sums) {
    total += p.value, faces += p.faces, s.unknowns += p.unknowns;
    s.at_surface.insert(s.at_surface.end(), p.at_surface.begin(), p.at_surface.end());
  }
  s.meets_air = faces > 0;
  s.surface_mean = faces ? total / static_cast<double>(faces) : 0.0;
  for (const std::size_t n : s.at_surface) s.surface_rhs[n] -= s.surface_mean * s.surface_weight[n];
}

}  // namespace

void assemble_pressure_system(const Grid& g, const FreeSurface& surface,
                              const FaceField<double>& open, const Sides& open_side,
                              const Hydrostatics& hydrostatics,
                              const std::vector<DualFaces*>& solids, PressureSystem& s,
                              const std::vector<CellBox>* changed) {
  s.surface = surface;
  s.hydrostatics = hydrostatics;
  s.open = &open;
  s.matrix.open_side = open_side;
  if (fit_to_grid(g, s)) changed = nullptr;
  take_openings(open, solids, changed, s.matrix);
  const std::vector<RowKind> before = s.rows;
  classify_rows(g, surface, open, open_side, touched_rows(g, solids, changed), before, s);
  for (DualFaces* faces : solids) share_dual_faces(s.matrix.kind, open, *faces, s.matrix.w);

  for (const std::size_t n : s.at_surface) s.surface_rhs[n] = s.surface_weight[n] = 0.0;
  take_out_mean(assemble_rows(g, open_side, before, s), s);
}

}  // namespace archetide
