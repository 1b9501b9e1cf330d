#include "runtime/coupling/pressure_system.h"

#include <algorithm>
#include <vector>

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

// Sums of one plane of cells, added in plane order so that the result does not depend on threads.
struct PlaneSums {
  double value = 0.0;
  std::size_t faces = 0, unknowns = 0;
};

// Carrier component `axis` at x, filtered by 1/4, 1/2, 1/4 over a cell along the two axes across
// `up`: nothing is left of waves of two cells.
double without_chop(const Grid& g, const MacField& carrier, int axis, int up, const Vec3& x) {
  const int b = (up + 1) % 3, c = (up + 2) % 3;
  double sum = 0.0;
  for (int p = -1; p <= 1; ++p)
    for (int q = -1; q <= 1; ++q) {
      Vec3 at = x;
      at[b] += p * g.dx, at[c] += q * g.dx;
      sum += (p ? 0.25 : 0.5) * (q ? 0.25 : 0.5) * interpolate_component(g, carrier, axis, at);
    }
  return sum;
}

}  // namespace

double carried_pressure(const Grid& g, const FreeSurface& surface, const Vec3& gravity,
                        const Vec3& x) {
  if (!surface.carrier) return 0.0;
  int up = 0;
  gravity.cwiseAbs().maxCoeff(&up);
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (gravity[axis] == 0.0 && !surface.push) continue;
    const double u = interpolate_component(g, *surface.carrier, axis, x);
    if (surface.push)
      sum += interpolate_component(g, *surface.push, axis, x) / surface.push_seconds *
             surface.shift * u;
    if (gravity[axis] == 0.0) continue;
    sum += gravity[axis] * surface.shift * u;
    if (surface.chop_damping > 0.0)
      sum -= gravity[axis] * surface.chop_damping *
             (u - without_chop(g, *surface.carrier, axis, up, x));
  }
  return sum;
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

SurfaceFace surface_face(const Grid& g, const FreeSurface& surface, const FaceField<double>& open,
                         const Hydrostatics& hydrostatics, const Vec3i& c, int axis, int sign) {
  const Vec3i n = neighbour(c, axis, sign);
  const WetPoint inside = wet_point(g, *surface.phi, open, c);
  double theta = 0.5;  // an open side of the tank: the value sits on the face
  Vec3 point = inside.x + sign * theta * g.dx * Vec3::Unit(axis);
  if (in_grid(g, n)) {
    const WetPoint outside = wet_point(g, *surface.phi, open, n);
    theta = std::clamp(inside.phi / (inside.phi - outside.phi), 0.0, 1.0);
    point = inside.x + theta * (outside.x - inside.x);
  }
  const double value =
      hydrostatics.surface_value(point) + carried_pressure(g, surface, hydrostatics.gravity, point);
  return {std::max(theta, kThetaMin), value};
}

void assemble_pressure_system(const Grid& g, const FreeSurface& surface,
                              const FaceField<double>& open, const Sides& open_side,
                              const Hydrostatics& hydrostatics,
                              const std::vector<DualFaces*>& solids, PressureSystem& s) {
  s.surface = surface;
  s.hydrostatics = hydrostatics;
  s.open = &open;
  PoissonMatrix& A = s.matrix;
  if (A.nx != g.nx || A.ny != g.ny || A.nz != g.nz) {
    A.nx = g.nx, A.ny = g.ny, A.nz = g.nz;
    A.kind.resize(g.nx, g.ny, g.nz);
    A.diag.resize(g.nx, g.ny, g.nz);
    s.surface_rhs.resize(g.nx, g.ny, g.nz);
    s.surface_weight.resize(g.nx, g.ny, g.nz);
  }
  A.w = open;
  A.open_side = open_side;

#pragma omp parallel for schedule(static)
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i)
        A.kind(i, j, k) = classify(g, *surface.phi, open, Vec3i(i, j, k));
  for (DualFaces* faces : solids) share_dual_faces(A.kind, open, *faces, A.w);

  // Diagonal and surface terms; the mean of the surface values is taken out once it is known.
  std::vector<PlaneSums> sums(g.nz);
#pragma omp parallel for schedule(dynamic, 4)
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) {
        const std::size_t n = A.kind.index(i, j, k);
        A.diag[n] = s.surface_rhs[n] = s.surface_weight[n] = 0.0;
        if (A.kind[n] != CellKind::kUnknown) continue;
        ++sums[k].unknowns;
        const Vec3i c(i, j, k);
        for (int axis = 0; axis < 3; ++axis)
          for (int sign = -1; sign <= 1; sign += 2) {
            const double w = face_value(A.w, c, axis, sign);
            if (w == 0.0) continue;
            const Vec3i m = neighbour(c, axis, sign);
            if (in_grid(g, m) && A.kind(m[0], m[1], m[2]) != CellKind::kDirichlet) {
              A.diag[n] += w;
              continue;
            }
            const SurfaceFace x = surface_face(g, surface, open, hydrostatics, c, axis, sign);
            A.diag[n] += w / x.theta;
            s.surface_weight[n] += w / x.theta;
            s.surface_rhs[n] += w / x.theta * x.value;
            sums[k].value += x.value;
            ++sums[k].faces;
          }
      }
  double total = 0.0;
  std::size_t faces = 0;
  s.unknowns = 0;
  for (const PlaneSums& p : sums) total += p.value, faces += p.faces, s.unknowns += p.unknowns;
  s.surface_mean = faces ? total / static_cast<double>(faces) : 0.0;
  for (std::size_t n = 0; n < A.size(); ++n)
    s.surface_rhs[n] -= s.surface_mean * s.surface_weight[n];
}

}  // namespace archetide
