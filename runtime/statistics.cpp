#include "runtime/statistics.h"

#include <algorithm>
#include <cmath>

#include "runtime/failure.h"
#include "runtime/fluid/level_set.h"

namespace archetide {

double deformation(const ReducedBody& body) {
  if (body.r == 0) return 0.0;
  const Archetype& a = *body.archetype;
  const VecX u = a.surface_modes.leftCols(body.r) * body.q;
  double largest = 0.0, size = 0.0;
  for (std::size_t v = 0; v < a.surface.vertices.size(); ++v) {
    largest = std::max(largest, u.segment<3>(3 * static_cast<Eigen::Index>(v)).norm());
    size = std::max(size, a.surface.vertices[v].norm());
  }
  return largest / size;
}

void add_body_statistics(const ReducedBody& body, const Vec3& gravity, StepReport& r) {
  r.body_momentum += body.P;
  r.body_angular_momentum += body.L + body.position.cross(body.P);
  r.body_kinetic += kinetic_energy(body);
  r.body_elastic += elastic_energy(body);
  r.potential -= body_mass(body) * gravity.dot(body.position);
  r.max_deformation = std::max(r.max_deformation, deformation(body));
}

namespace {

// Wet share of a cell with phi / dx at its centre.
double wet_share(double phi) { return std::min(std::max(0.5 - phi, 0.0), 1.0); }

// Largest |u| of the faces with valid == 1.
double fastest(const Array3<double>& u, const Array3<unsigned char>& valid) {
  double most = 0.0;
#pragma omp parallel for simd schedule(static) reduction(max : most)
  for (std::size_t n = 0; n < u.size(); ++n)
    most = std::max(most, valid[n] == 1 ? std::abs(u[n]) : 0.0);
  return most;
}

// Central differences of f at a cell, one-sided at the tank's sides, per cell.
Vec3 differences(const Array3<double>& f, int i, int j, int k) {
  const int at[3] = {i, j, k}, size[3] = {f.nx(), f.ny(), f.nz()};
  Vec3 d = Vec3::Zero();
  for (int a = 0; a < 3; ++a) {
    if (size[a] == 1) continue;
    int low[3] = {i, j, k}, high[3] = {i, j, k};
    low[a] = std::max(at[a] - 1, 0), high[a] = std::min(at[a] + 1, size[a] - 1);
    d[a] = (f(high[0], high[1], high[2]) - f(low[0], low[1], low[2])) / (high[a] - low[a]);
  }
  return d;
}

}  // namespace

void add_water_statistics(const SimulationOptions& o, const Grid& g, const FluidState& fluid,
                          const Coupling& coupling, StepReport& r) {
  r.water_volume = water_volume(g, fluid.phi, &coupling.solids().cell);

  const Motion& motion = coupling.motion_after();
  r.water_momentum = motion.P;
  r.water_angular_momentum = motion.L;
  r.water_kinetic = motion.kinetic;
  for (int a = 0; a < 3; ++a)
    r.max_speed = std::max(r.max_speed, fastest(fluid.u[a], coupling.valid()[a]));
  const double mass = o.water_density * g.dx * g.dx * g.dx;
  const Array3<double>& solids = coupling.solids().cell;
  std::vector<double> potential(g.nz, 0.0);
#pragma omp parallel for schedule(static, 1)
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j) {
      const double *phi = &fluid.phi(0, j, k), *solid = &solids(0, j, k), dx = g.dx;
      const int nx = g.nx;
      double fill = 0.0, moment = 0.0;  // of the row, about its first cell
      int partly = 0;                   // cells that the surface or a solid cuts
#pragma omp simd reduction(+ : fill, moment) reduction(| : partly)
      for (int i = 0; i < nx; ++i) {
        const double wet = wet_share(phi[i] / dx), open = open_fraction(solid[i]),
                     cell = wet * open;
        fill += cell, moment += i * cell;
        partly |= (wet * (1.0 - wet) > 0.0) | (open * (1.0 - open) > 0.0);
      }
      // Their water weighs at its own centre: half of what is cut off away from the cell's.
      double off = 0.0;
      for (int i = 0; partly && i < g.nx; ++i) {
        const double wet = wet_share(phi[i] / g.dx), open = open_fraction(solid[i]);
        if (wet * (1.0 - wet) > 0.0)
          off -= 0.5 * wet * (1.0 - wet) * open * o.gravity.dot(differences(fluid.phi, i, j, k)) /
                 g.dx;
        if (wet * open * (1.0 - open) > 0.0)
          off -= 0.5 * wet * open * (1.0 - open) *
                 o.gravity.dot(differences(solids, i, j, k).stableNormalized());
      }
      potential[k] -= mass * (fill * o.gravity.dot(g.cell_centre(0, j, k)) +
                              (moment * o.gravity[0] + off) * g.dx);
    }
  for (double p : potential) r.potential += p;
}

WaterMoment water_moment(const Grid& g, const Array3<double>& held) {
  std::vector<WaterMoment> planes(g.nz);
#pragma omp parallel for schedule(static, 1)
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j) {
      const double* row = &held(0, j, k);
      double sum = 0.0, moment = 0.0;
#pragma omp simd reduction(+ : sum, moment)
      for (int i = 0; i < g.nx; ++i) sum += row[i], moment += i * row[i];
      planes[k].volume += sum;
      planes[k].moment += sum * g.cell_centre(0, j, k) + g.dx * moment * Vec3::UnitX();
    }
  WaterMoment total;
  for (const WaterMoment& plane : planes)
    total.volume += plane.volume, total.moment += plane.moment;
  const double cell = g.dx * g.dx * g.dx;
  return {cell * total.volume, cell * total.moment};
}

double largest_surface_speed(const ReducedBody& body) {
  const ConfigurationTerms terms =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  const Archetype& a = *body.archetype;
  const Mat3 R = body.rotation.toRotationMatrix();
  const Vec3 spin = frame_spin(terms, body.L, body.q_dot),
             v = body.P / terms.mass + R * (terms.shape.shift_rate * body.q_dot);
  VecX x_dot = VecX::Zero(3 * static_cast<Eigen::Index>(a.surface.vertices.size()));
  if (body.r > 0) x_dot = terms.shape.s * (a.surface_modes.leftCols(body.r) * body.q_dot);
  const double swelling = terms.shape.slope.dot(body.q_dot);  // d ln s / dt, 1/s
  std::vector<Vec3> arms;
  deformed_places(body, a.surface.vertices, a.surface_modes, Vec3::Zero(), arms);
  double fastest = 0.0;
  for (std::size_t n = 0; n < arms.size(); ++n) {
    const Vec3 modal = R * x_dot.segment<3>(3 * static_cast<Eigen::Index>(n));
    fastest =
        std::max(fastest, (v + spin.cross(arms[n]) + swelling * arms[n] + modal).squaredNorm());
  }
  return std::sqrt(fastest);
}

namespace {

// The first mode that is not finite, or -1.
int broken_mode(const ReducedBody& body) {
  for (int i = 0; i < body.r; ++i)
    if (!std::isfinite(body.q[i]) || !std::isfinite(body.q_dot[i])) return i;
  return -1;
}

// A cell beside the first velocity that is not finite, or with such a level set.
std::optional<Vec3i> broken_cell(const FluidState& fluid) {
  const Array3<double>& phi = fluid.phi;
  for (int k = 0; k < phi.nz(); ++k)
    for (int j = 0; j < phi.ny(); ++j)
      for (int i = 0; i < phi.nx(); ++i)
        if (!std::isfinite(phi(i, j, k) + fluid.u[0](i, j, k) + fluid.u[1](i, j, k) +
                           fluid.u[2](i, j, k)))
          return Vec3i(i, j, k);
  return std::nullopt;
}

}  // namespace

int broken_body(const std::vector<ReducedBody>& bodies) {
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const ReducedBody& body = bodies[b];
    const bool finite = body.position.allFinite() && body.rotation.coeffs().allFinite() &&
                        body.P.allFinite() && body.L.allFinite() && broken_mode(body) < 0;
    if (!finite) return static_cast<int>(b);
  }
  return -1;
}

void demand_finite(const std::vector<ReducedBody>& bodies, const FluidState& fluid,
                   const StepReport& r) {
  const int body = broken_body(bodies);
  if (body >= 0)
    throw SimulationFailure("finite", "a body is no longer finite", r.t,
                            {body, broken_mode(bodies[body]), {}});
  if (!std::isfinite(r.water_kinetic) || !std::isfinite(r.max_speed))
    throw SimulationFailure("finite", "the water is no longer finite", r.t,
                            {-1, -1, broken_cell(fluid)});
}

}  // namespace archetide
