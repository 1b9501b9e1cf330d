#include "runtime/coupling/coupled_solve.h"

#include <algorithm>
#include <cmath>

#include "common/base/exception_carrier.h"
#include "runtime/coupling/returned_flux.h"
#include "runtime/cut_cells/flux_columns.h"
#include "runtime/cut_cells/lost_flux.h"
#include "runtime/numerics/parallel.h"

namespace archetide {
namespace {

// out = net inflow of the water through the open part of the faces of cells begin <= i < end of
// row (j, k), m/s (per dx^2) (C5).
void inflow_row(const FaceField<double>& w, const MacField& u, int j, int k, int begin, int end,
                double* out) {
  const double *wx = &w[0](0, j, k), *ux = &u[0](0, j, k);
  const double *ws = &w[1](0, j, k), *us = &u[1](0, j, k);
  const double *wn = &w[1](0, j + 1, k), *un = &u[1](0, j + 1, k);
  const double *wd = &w[2](0, j, k), *ud = &u[2](0, j, k);
  const double *wu = &w[2](0, j, k + 1), *uu = &u[2](0, j, k + 1);
#pragma omp simd
  for (int i = begin; i < end; ++i)
    out[i] = (wx[i] * ux[i] - wx[i + 1] * ux[i + 1]) + (ws[i] * us[i] - wn[i] * un[i]) +
             (wd[i] * ud[i] - wu[i] * uu[i]);
}

// The same of a segment, of whose inner cells all six faces are open.
void inflow_segment(const FaceField<double>& w, const MacField& u, const Segment& s, int k,
                    double* out) {
  if (s.inner != 6) return inflow_row(w, u, s.j, k, s.begin, s.end, out);
  const int begin = s.begin + 1, end = s.end - 1;
  inflow_row(w, u, s.j, k, s.begin, begin, out);
  const double *ux = &u[0](0, s.j, k), *us = &u[1](0, s.j, k), *un = &u[1](0, s.j + 1, k),
               *ud = &u[2](0, s.j, k), *uu = &u[2](0, s.j, k + 1);
#pragma omp simd
  for (int i = begin; i < end; ++i)
    out[i] = (ux[i] - ux[i + 1]) + (us[i] - un[i]) + (ud[i] - uu[i]);
  inflow_row(w, u, s.j, k, end, s.end, out);
}

// One row of faces of an axis: the cells on its low and high side (null: beyond the grid).
struct FaceRow {
  const double* w;
  const CellKind *low, *high;
  const double *x_low, *x_high;
};

// Eqs. 24 and 36: v -= x_high - x_low between unknowns; marks valid faces. Returns whether a face
// is left that lies between an unknown and something else (C15).
bool apply_between_unknowns(const FaceRow& row, int begin, int end, double* v,
                            unsigned char* valid) {
  int left = 0;
#pragma omp simd reduction(| : left)
  for (int i = begin; i < end; ++i) {
    const bool open = row.w[i] != 0.0, low = row.low[i] == CellKind::kUnknown,
               high = row.high[i] == CellKind::kUnknown;
    v[i] -= open & low & high ? row.x_high[i] - row.x_low[i] : 0.0;
    valid[i] = (low | high) & (row.w[i] >= kTrustedOpening);
    left |= open & (low != high);
  }
  return left != 0;
}

// The same where all cells are unknowns and all faces open.
void apply_in_water(const double* x_low, const double* x_high, int begin, int end, double* v,
                    unsigned char* valid) {
#pragma omp simd
  for (int i = begin; i < end; ++i) v[i] -= x_high[i] - x_low[i];
  std::fill(valid + begin, valid + end, 1);
}

// Eqs. 24 and 36: u = u* - (p_high - p_low) / theta on every open face of an unknown, p the unknown
// of the solve.
class PressureGradient {
 public:
  PressureGradient(const Grid& grid, const PressureSystem& system, double scale,
                   const Array3<double>& solution, MacField& velocity,
                   FaceField<unsigned char>& solved, std::vector<std::vector<NarrowFace>>& planes)
      : g(grid), s(system), to_phi(scale), x(solution), u(velocity), valid(solved), narrow(planes) {
    narrow.resize(g.nz + 1);
    for (std::vector<NarrowFace>& plane : narrow) plane.clear();
  }

  // Row by row all three components, which read the same pressures.
  void apply() {
    ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic, 4)
    for (int k = 0; k <= g.nz; ++k)
      carrier.run([&] {
        for (int j = 0; j <= g.ny; ++j) {
          if (j < g.ny && k < g.nz) apply_to_row(0, j, k);
          if (k < g.nz) apply_to_row(1, j, k);
          if (j < g.ny) apply_to_row(2, j, k);
        }
      });
    carrier.rethrow();
  }

  // The narrow faces that were solved for.
  void collect_narrow(std::vector<NarrowFace>& all) const {
    all.clear();
    for (const std::vector<NarrowFace>& plane : narrow)
      all.insert(all.end(), plane.begin(), plane.end());
    for (NarrowFace& f : all) f.after = u[f.axis][f.face];
  }

 private:
  bool unknown(const Vec3i& c) const {
    return kind.contains(c[0], c[1], c[2]) && kind(c[0], c[1], c[2]) == CellKind::kUnknown;
  }

  // A face between water and a prescribed value, or a side of the tank.
  void apply_at_surface(int axis, const Vec3i& high) {
    Array3<double>& v = u[axis];
    const std::size_t f = v.index(high[0], high[1], high[2]);
    if ((*s.open)[axis][f] == 0.0) return;
    const Vec3i low = high - Vec3i::Unit(axis);
    const bool high_water = unknown(high), low_water = unknown(low);
    if (high_water == low_water) return;
    const Vec3i& c = low_water ? low : high;
    const SurfaceFace face =
        surface_face(g, s.surface, *s.open, s.hydrostatics, c, axis, low_water ? 1 : -1);
    const double here = x(c[0], c[1], c[2]), there = to_phi * (face.value - s.surface_mean);
    const double before = v[f], w = (*s.open)[axis][f];
    v[f] -= (low_water ? there - here : here - there) / face.theta;
    if (w >= kTrustedOpening && w * face.theta < kTrustedDepth) {  // else remember_narrow did
      valid[axis][f] = 0;
      narrow[high[2]].push_back({axis, f, w * face.theta, before, NAN});
    }
  }

  // Narrow faces of row (j, k) beside unknowns, as they are before the solve.
  void remember_narrow(int axis, int j, int k, const double* w) {
    const int count = u[axis].nx();
    int any = 0;
#pragma omp simd reduction(| : any)
    for (int i = 0; i < count; ++i) any |= (w[i] > 0.0) & (w[i] < kTrustedOpening);
    if (!any) return;
    const std::size_t row = u[axis].index(0, j, k);
    for (int i = 0; i < count; ++i) {
      const Vec3i high(i, j, k);
      if (w[i] > 0.0 && w[i] < kTrustedOpening &&
          (unknown(high) || unknown(high - Vec3i::Unit(axis))))
        narrow[k].push_back({axis, row + i, w[i], u[axis][row + i], NAN});
    }
  }

  // The faces of component `axis` on the low sides of the cells of row (j, k).
  void apply_to_row(int axis, int j, int k) {
    const bool has_low = axis == 0 || (axis == 1 ? j : k) > 0;
    const bool has_high = axis == 0 || (axis == 1 ? j < g.ny : k < g.nz);
    const std::ptrdiff_t at =
        static_cast<std::ptrdiff_t>(g.nx) * (j + static_cast<std::ptrdiff_t>(g.ny) * k);
    const std::ptrdiff_t to_low = at - (axis == 0   ? 1
                                        : axis == 1 ? g.nx
                                                    : static_cast<std::ptrdiff_t>(g.nx) * g.ny);
    const RowKind low = has_low ? s.row(j - (axis == 1), k - (axis == 2)) : RowKind::kAir,
                  high = has_high ? s.row(j, k) : RowKind::kAir;
    double* v = &u[axis](0, j, k);
    unsigned char* flags = &valid[axis](0, j, k);
    const auto wet = [&](RowKind row, const CellKind* cells) {
      return row != RowKind::kAir &&
             (row != RowKind::kMixed ||
              std::find(cells, cells + g.nx, CellKind::kUnknown) != cells + g.nx);
    };
    if (!wet(high, kind.data() + at) && !wet(low, kind.data() + to_low + (axis == 0))) {
      std::fill_n(flags, valid[axis].nx(), 0);
      return;
    }
    const int begin = axis == 0 ? 1 : 0;  // the ends of an x row have one cell only
    const double* w = &(*s.open)[axis](0, j, k);
    bool left = false;
    if (low < RowKind::kWater || high < RowKind::kWater) remember_narrow(axis, j, k, w);
    if (low >= RowKind::kWater && high >= RowKind::kWater)
      apply_in_water(x.data() + to_low, x.data() + at, begin, g.nx, v, flags);
    else
      left = apply_between_unknowns(
          {w, has_low ? kind.data() + to_low : nothing.data(),
           has_high ? kind.data() + at : nothing.data(), has_low ? x.data() + to_low : zero.data(),
           has_high ? x.data() + at : zero.data()},
          begin, g.nx, v, flags);
    if (axis == 0) {
      flags[0] = unknown({0, j, k}) && w[0] >= kTrustedOpening;
      flags[g.nx] = unknown({g.nx - 1, j, k}) && w[g.nx] >= kTrustedOpening;
      apply_at_surface(0, {0, j, k});
      apply_at_surface(0, {g.nx, j, k});
    }
    for (int i = begin; left && i < g.nx; ++i) apply_at_surface(axis, {i, j, k});
  }

  const Grid& g;
  const PressureSystem& s;
  const double to_phi;  // s/m
  const Array3<double>& x;
  MacField& u;
  FaceField<unsigned char>& valid;
  const Array3<CellKind>& kind = s.matrix.kind;
  const std::vector<CellKind> nothing = std::vector<CellKind>(g.nx, CellKind::kOutside);
  const std::vector<double> zero = std::vector<double>(g.nx, 0.0);
  std::vector<std::vector<NarrowFace>>& narrow;  // of each plane
};

// Eqs. 39 and 40: y += H^-1 f, rows kept.
void add_motion(const ConstrainedInverse* rows, const std::vector<VecX>& f,
                std::vector<CoupledBody>& bodies) {
  const std::vector<VecX> gained = answers(bodies, f, rows);
  for (std::size_t b = 0; b < bodies.size(); ++b) bodies[b].y += gained[b];
}

// No water to meet: bodies move freely.
SolveReport without_water(std::vector<CoupledBody>& bodies) {
  for (CoupledBody& body : bodies) {
    body.y = body.y_star;
    body.impulse = VecX::Zero(body.y.size());
  }
  SolveReport report;
  report.converged = true;
  return report;
}

}  // namespace

SolveReport CoupledSolver::solve(const Grid& g, const PressureSystem& s, double dt,
                                 std::vector<CoupledBody>& bodies,
                                 const CoupledSolveOptions& options, MacField& u,
                                 FaceField<unsigned char>& valid, Array3<double>& pressure,
                                 const ConstrainedInverse* rows) {
  const SolveReport report = find_pressure(g, s, dt, bodies, options, u, pressure, rows);
  move_water(g, s, dt, pressure, u, valid);
  return report;
}

void CoupledSolver::move_water(const Grid& g, const PressureSystem& s, double dt,
                               const Array3<double>& pressure, MacField& u,
                               FaceField<unsigned char>& valid) {
  narrow_.clear();
  if (s.unknowns == 0) {
    for (auto& component : valid.axis) component.fill(0);
    return;
  }
  PressureGradient gradient(g, s, dt / g.dx, pressure, u, valid, narrow_planes_);
  gradient.apply();
  gradient.collect_narrow(narrow_);
}

// Generalised impulse of a pressure that is the same at all cells of a body.
VecX CoupledSolver::mean_push(std::size_t b, double impulse) const {
  const CoupledOperator::Body& body = operator_.bodies()[b];
  if (!body.nodes) return impulse * sum_columns(body.flux);
  const auto cells = static_cast<Eigen::Index>(body.cell.size());
  return impulse * operator_.on_body(b, body.gather(MatX::Ones(cells, 1)));
}

SolveReport CoupledSolver::find_pressure(const Grid& g, const PressureSystem& s, double dt,
                                         std::vector<CoupledBody>& bodies,
                                         const CoupledSolveOptions& options, const MacField& u,
                                         Array3<double>& pressure, const ConstrainedInverse* rows,
                                         bool same_water) {
  if (s.unknowns == 0) return without_water(bodies);
  const Stopwatch watch;
  const double rho = s.hydrostatics.density;
  if (!same_water) {
    operator_.setup_water(s);
    multigrid_.setup(operator_.water(), &operator_.closed());
    for_each_large(bodies.size(), [&](std::size_t b) {
      settle_lost_flux(s.matrix, operator_.closed(), bodies[b].flux);
    });
  }
  operator_.setup(g, s, rho, bodies, rows, same_water);
  deflation_.setup(operator_, multigrid_, options.deflation, options.tolerance, options.warm_start);

  std::vector<VecX> given(bodies.size());
  // Bodies meet the mean surface pressure before the solve, so that only deviations are iterated
  // on.
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    CoupledBody& body = bodies[b];
    body.impulse = mean_push(b, -dt * rho * s.surface_mean * g.dx * g.dx);
    body.y = body.y_star;
    given[b] = body.impulse;
  }
  add_motion(operator_.rows(), given, bodies);

  // Right-hand side of Eq. 45: b = Fhat y - sum sign e u* + surface terms, on unknowns; p = 0
  // elsewhere.
  const double to_phi = dt / g.dx;
  rhs_.resize(operator_.size());
#pragma omp parallel for schedule(dynamic, 4)
  for (int k = 0; k < g.nz; ++k) {
    std::size_t done = s.matrix.kind.index(0, 0, k);
    for (const Segment& segment : operator_.water().rows().plane(k)) {
      const std::size_t row = s.matrix.kind.index(0, segment.j, k);
      std::fill(pressure.data() + done, pressure.data() + row + segment.begin, 0.0);
      done = row + segment.end;
      double* rhs = rhs_.data() + row;
      inflow_segment(s.matrix.w, u, segment, k, rhs);
    }
    std::fill(pressure.data() + done, pressure.data() + s.matrix.kind.index(0, 0, k + 1), 0.0);
  }
#pragma omp parallel for schedule(static) if (s.at_surface.size() > kParallelCells)
  for (std::size_t m = 0; m < s.at_surface.size(); ++m)
    rhs_[s.at_surface[m]] += to_phi * s.surface_rhs[s.at_surface[m]];
  CoupledPcgOptions pcg_options;
  for (const CoupledBody& body : bodies) pcg_options.y.push_back(body.motion(body.y));
  operator_.scatter(pcg_options.y, 1.0, rhs_.data());
  return_flux(operator_, g.dx, bodies, rhs_.data());

  // Below this the right-hand side is round-off of the hydrostatic terms: a still tank is not
  // iterated on.
  const double head = s.hydrostatics.gravity.norm() * g.dx * std::max({g.nx, g.ny, g.nz});
  pcg_options.tolerance = options.tolerance;
  pcg_options.absolute = 1e-13 * to_phi * head * std::sqrt(static_cast<double>(s.unknowns) + 1.0);
  pcg_options.max_iterations = options.max_iterations;
  pcg_.setup(operator_, multigrid_, deflation_);
  const double incompatible = operator_.incompatible(rhs_.data());
  const double setup_wall = watch.wall(), setup_cpu = watch.cpu();
  SolveReport report = pcg_.solve(rhs_.data(), pressure.data(), pcg_options);
  report.setup_seconds = setup_wall;
  report.setup_cpu_seconds = setup_cpu;
  report.closed_regions = static_cast<int>(operator_.closed().count());
  report.incompatible_flow = incompatible * g.dx * g.dx;

  // Pressure to bodies, -Fhat^T p (Eqs. 39 and 40), and to the water.
  const std::vector<VecX> pushes = operator_.gather(pressure.data());
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    given[b] = -rho * g.dx * g.dx * g.dx * operator_.on_body(b, pushes[b]);
    bodies[b].impulse += given[b];
  }
  add_motion(operator_.rows(), given, bodies);
  return report;
}

std::size_t CoupledSolver::bytes() const {
  return multigrid_.bytes() + deflation_.bytes() + pcg_.bytes() + sizeof(double) * rhs_.size();
}

// Eq. 37: what is left of the divergence, with the flux of the bodies.
double max_divergence(const Grid& g, const PressureSystem& s, const MacField& u,
                      const std::vector<CoupledBody>& bodies, Vec3i* where) {
  std::vector<std::pair<std::int64_t, double>> pushed;  // into cells by bodies, by cell
  for (const CoupledBody& body : bodies) {
    if (body.flux.cell.empty()) continue;
    const VecX y = body.motion(body.y);
    for (std::size_t m = 0; m < body.flux.cell.size(); ++m)
      pushed.emplace_back(body.flux.cell[m], body.pushed(m, y) / (g.dx * g.dx));
  }
  const auto before = [](const auto& a, const auto& b) { return a.first < b.first; };
  std::stable_sort(pushed.begin(), pushed.end(), before);
  std::vector<std::pair<double, Vec3i>> largest(g.nz, {0.0, Vec3i::Zero()});  // of each plane
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic, 4)
  for (int k = 0; k < g.nz; ++k)
    carrier.run([&] {
      std::vector<double> net(g.nx);
      for (int j = 0; j < g.ny; ++j) {
        const CellKind* kind = &s.matrix.kind(0, j, k);
        if (std::find(kind, kind + g.nx, CellKind::kUnknown) == kind + g.nx) continue;
        inflow_row(s.matrix.w, u, j, k, 0, g.nx, net.data());
        const auto row = static_cast<std::int64_t>(s.matrix.kind.index(0, j, k));
        auto next = std::lower_bound(pushed.begin(), pushed.end(), std::pair(row, 0.0), before);
        for (; next != pushed.end() && next->first < row + g.nx; ++next)
          net[next->first - row] += next->second;
        for (int i = 0; i < g.nx; ++i) {
          const double here = std::abs(net[i]);
          if (kind[i] == CellKind::kUnknown && here > largest[k].first)
            largest[k] = {here, Vec3i(i, j, k)};
        }
      }
    });
  carrier.rethrow();
  const auto worst =
      std::max_element(largest.begin(), largest.end(),
                       [](const auto& p, const auto& q) { return p.first < q.first; });
  if (worst == largest.end()) return 0.0;
  if (where) *where = worst->second;
  return worst->first / g.dx;
}

}  // namespace archetide
