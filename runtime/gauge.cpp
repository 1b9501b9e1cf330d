#include "runtime/gauge.h"

#include <algorithm>
#include <cmath>

#include "runtime/coupling/coupling.h"
#include "runtime/fluid/sampling.h"

namespace archetide {
namespace {

constexpr double kSolid = 0.5;  // fraction of a cell from which it is no place to read

// p' / rho at x, m^2/s^2: the mean over the cells around that are water, weighted as by linear
// interpolation; none without one.
std::optional<double> dynamic_pressure(const Grid& g, const Coupling& coupling, double dt,
                                       const Vec3& x) {
  const PressureSystem& system = coupling.system();
  const Array3<double>& phi = coupling.last_pressure(Stage::kVelocityFull);
  const Array3<CellKind>& kind = system.matrix.kind;
  if (phi.size() != kind.size()) return {};
  Slot slot[3];
  for (int a = 0; a < 3; ++a) slot[a] = clamped_slot((x[a] - g.low()[a]) / g.dx - 0.5, g.size(a));
  const double mean = mean_where(
      Lattice(phi), slot, [&](std::size_t n) { return kind[n] == CellKind::kUnknown; }, NAN);
  if (std::isnan(mean)) return {};
  return mean * g.dx / dt + system.surface_mean;
}

// z of the highest surface on the vertical line through x.
std::optional<double> level_at(const Grid& g, const Array3<double>& phi,
                               const Array3<double>& solid, const Vec3& x) {
  const auto cell = [&](int a) {
    return std::clamp(static_cast<int>((x[a] - g.low()[a]) / g.dx), 0, g.size(a) - 1);
  };
  const int i = cell(0), j = cell(1);
  double above = g.dx;  // phi of the cell above the tank: air
  for (int k = g.nz - 1; k >= 0; --k) {
    const double z = g.cell_centre(0, 0, k)[2];
    const double here = solid(i, j, k) > kSolid ? g.dx : interpolate(g, phi, Vec3(x[0], x[1], z));
    if (here < 0.0) {
      const double top = z + g.dx * std::min(here / (here - above), 1.0);
      return std::min(top, z + (k == g.nz - 1 ? 0.5 : 1.0) * g.dx);
    }
    above = here;
  }
  return {};
}

}  // namespace

GaugeReading read_gauge(const Simulation& s, double dt, const Vec3& point) {
  GaugeReading r;
  const Grid& g = s.grid();
  const FluidState& fluid = s.fluid();
  if (fluid.phi.size() == 0) return r;
  const Array3<double>& solid = s.coupling().solids().cell;
  r.level = level_at(g, fluid.phi, solid, point);
  const bool in_air = point[2] > g.high()[2] || interpolate(g, fluid.phi, point) >= 0.0;
  if (in_air) {
    r.pressure = 0.0;
    return r;
  }
  const Hydrostatics& h = s.coupling().system().hydrostatics;
  if (const std::optional<double> p = dynamic_pressure(g, s.coupling(), dt, point)) {
    r.pressure = h.density * (*p - h.surface_value(point));
    r.velocity = interpolate(g, fluid.u, point);
  }
  return r;
}

}  // namespace archetide
