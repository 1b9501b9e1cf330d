#include "runtime/coupling/impulses.h"

#include "runtime/cut_cells/lost_flux.h"

namespace archetide {
namespace {

// Sums over the unknowns of one plane of cells, in units of phi dx^3.
class PlaneOfCells {
 public:
  PlaneOfCells(const Grid& grid, const PressureSystem& system, double scale,
               const Array3<double>& solution)
      : g(grid), s(system), to_phi(scale), phi(solution), e(system.matrix.w) {}

  void add(int k, Impulse& solids, Impulse& surface) const {
    for (int j = 0; j < g.ny; ++j) {
      const RowKind kind = s.row(j, k);
      if (kind == RowKind::kAir) continue;
      // in inner rows only the ends may have a side of the tank, or the air
      const bool inner = kind == RowKind::kInner && j > 0 && k > 0 && j + 1 < g.ny && k + 1 < g.nz;
      for (int i = 0; i < g.nx; i += inner && i == 0 && g.nx > 1 ? g.nx - 1 : 1)
        if (s.matrix.kind(i, j, k) == CellKind::kUnknown) add_cell({i, j, k}, solids, surface);
    }
  }

 private:
  bool unknown(const Vec3i& c) const {
    return s.matrix.kind.contains(c[0], c[1], c[2]) &&
           s.matrix.kind(c[0], c[1], c[2]) == CellKind::kUnknown;
  }

  void add_cell(const Vec3i& c, Impulse& solids, Impulse& surface) const {
    const double here = phi(c[0], c[1], c[2]) + to_phi * s.surface_mean;
    Vec3 wall = Vec3::Zero(), air = Vec3::Zero();
    for (int a = 0; a < 3; ++a)
      for (int side = -1; side <= 1; side += 2) {
        const Vec3i f = c + (side > 0 ? Vec3i(Vec3i::Unit(a)) : Vec3i(Vec3i::Zero()));
        const double opening = e[a](f[0], f[1], f[2]);
        wall[a] += side * opening * here;
        if ((*s.open)[a](f[0], f[1], f[2]) == 0.0 || unknown(c + side * Vec3i::Unit(a))) continue;
        const double value = surface_face(g, s.surface, *s.open, s.hydrostatics, c, a, side).value;
        air[a] -= side * opening * to_phi * value;
      }
    const Vec3 x = g.cell_centre(c[0], c[1], c[2]);
    if (wall != Vec3::Zero()) solids += impulse_at(x, wall);
    if (air != Vec3::Zero()) surface += impulse_at(x, air);
  }

  const Grid& g;
  const PressureSystem& s;
  const double to_phi;  // s/m
  const Array3<double>& phi;
  const FaceField<double>& e;
};

}  // namespace

PressureImpulses pressure_impulses(const Grid& g, const PressureSystem& s, double h,
                                   const Array3<double>& phi,
                                   const std::vector<CoupledBody>& bodies) {
  const double to_phi = h / g.dx, mass = s.hydrostatics.density * g.dx * g.dx * g.dx;
  const PlaneOfCells cells(g, s, to_phi, phi);
  std::vector<PressureImpulses> planes(g.nz);
#pragma omp parallel for schedule(dynamic, 4)
  for (int k = 0; k < g.nz; ++k) cells.add(k, planes[k].solids, planes[k].surface);
  PressureImpulses sum;
  for (const PressureImpulses& plane : planes)
    sum.solids += plane.solids, sum.surface += plane.surface;
  for (const CoupledBody& body : bodies)
    for (std::size_t m = 0; m < body.flux.cell.size(); ++m) {
      if (!holds_unknown(s.matrix, body.flux.cell[m])) continue;
      const auto n = static_cast<std::size_t>(body.flux.cell[m]);
      const double here = phi.data()[n] + to_phi * s.surface_mean;
      const int i = static_cast<int>(n % g.nx), j = static_cast<int>(n / g.nx % g.ny),
                k = static_cast<int>(n / g.nx / g.ny);
      const Vec3 push = body.flux.flux.col(static_cast<Eigen::Index>(m)).head<3>() / (g.dx * g.dx);
      sum.bodies += impulse_at(g.cell_centre(i, j, k), here * push);
    }
  sum.solids = sum.solids - sum.bodies;
  for (Impulse* i : {&sum.solids, &sum.bodies, &sum.surface}) i->P *= mass, i->L *= mass;
  return sum;
}

}  // namespace archetide
