#include "runtime/statistics.h"

#include <algorithm>
#include <cmath>

#include "runtime/fluid/level_set.h"
#include "runtime/numerics/largest.h"
#include "runtime/solid/extent.h"

namespace archetide {

double deformation(const ReducedBody& body) {
  if (body.r == 0) return 0.0;
  const Archetype& a = *body.archetype;
  const VecX u = surface_displacements(body, body.q);
  return largest_displacement(u) / bounding_radius(a);
}

void add_body_statistics(const ReducedBody& body, const Vec3& gravity, StepReport& r) {
  if (body.prescribed) return;
  r.body_momentum += body.P;
  r.body_angular_momentum += body.L + body.position.cross(body.P);
  r.body_kinetic += kinetic_energy(body);
  r.body_elastic += elastic_energy(body);
  r.potential -= body_mass(body) * gravity.dot(body.position);
  r.max_deformation = std::max(r.max_deformation, deformation(body));
}

namespace {

// Largest |u| of the faces with valid == 1.
double fastest(const Array3<double>& u, const Array3<unsigned char>& valid) {
  return largest_of(u.size(), [&](std::size_t n) { return valid[n] == 1 ? std::abs(u[n]) : 0.0; });
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

// Part of what is open of a cell that water takes.
double wet_part(double water, double solid) {
  const double open = open_fraction(solid);
  return open > 0.0 ? std::min(water / open, 1.0) : 0.0;
}

// What the moment of row (j, k) of the water `held` (dx^3) about the origin is beyond that of the
// cells' centres, along gravity and over dx^4, m/s^2: water of cells that the surface cuts is at its
// own centre, half of what is cut off away from the cell's.
double moment_under_surface(const Vec3& gravity, const Array3<double>& level,
                            const Array3<double>& solids, const Array3<double>& held, int j,
                            int k) {
  const double *water = &held(0, j, k), *solid = &solids(0, j, k);
  double off = 0.0;
  for (int i = 0; i < held.nx(); ++i) {
    if (water[i] <= 0.0 || water[i] >= 1.0) continue;
    const double wet = wet_part(water[i], solid[i]);
    if (wet < 1.0)
      off -= 0.5 * (1.0 - wet) * water[i] *
             gravity.dot(differences(level, i, j, k).stableNormalized());
  }
  return off;
}

// The same of water that solids push aside, all cells.
double moment_beside_solids(const Vec3& gravity, const SolidFractions& solids,
                            const Array3<double>& held) {
  double off = 0.0;
  for (const SolidFractions::Moment& m : solids.moments)
    off -= wet_part(held[m.cell], solids.cell[m.cell]) * gravity.dot(m.of_solid);
  return off;
}

}  // namespace

void add_water_statistics(const SimulationOptions& o, const WaterStep& water,
                          const WaterMoment& inside, const Coupling& coupling, StepReport& r) {
  const Grid& g = water.grid();
  const Motion& motion = coupling.motion_after();
  r.water_volume = inside.volume;
  r.water_momentum = motion.P;
  r.water_angular_momentum = motion.L;
  r.water_kinetic = motion.kinetic;
  for (int a = 0; a < 3; ++a)
    r.max_speed = std::max(r.max_speed, fastest(water.fluid().u[a], coupling.valid()[a]));
  const SolidFractions& solids = coupling.solids();
  std::vector<double> off(g.nz, 0.0);
#pragma omp parallel for schedule(static, 1)
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      off[k] += moment_under_surface(o.gravity, water.fluid().phi, solids.cell, water.held(), j, k);
  const WaterMoment hidden = water_moment(g, water.residual());
  double moment = o.gravity.dot(inside.moment + hidden.moment);
  double cut = moment_beside_solids(o.gravity, solids, water.held());
  for (const double of_plane : off) cut += of_plane;
  moment += cut * g.dx * g.dx * g.dx * g.dx;
  r.potential -= o.water_density * moment;
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
  const Mat3 R = body.rotation.toRotationMatrix();
  const Vec3 spin = frame_spin(terms, body.L, body.q_dot),
             v = body.P / terms.mass + R * (terms.shape.shift_rate * body.q_dot);
  const VecX x_dot = terms.shape.s * surface_displacements(body, body.q_dot);
  const double swelling = terms.shape.slope.dot(body.q_dot);  // d ln s / dt, 1/s
  std::vector<Vec3> arms;
  surface_places(body, Vec3::Zero(), arms);
  double fastest = 0.0;
  for (std::size_t n = 0; n < arms.size(); ++n) {
    const Vec3 modal = R * x_dot.segment<3>(3 * static_cast<Eigen::Index>(n));
    fastest =
        std::max(fastest, (v + spin.cross(arms[n]) + swelling * arms[n] + modal).squaredNorm());
  }
  return std::sqrt(fastest);
}

std::vector<double> largest_surface_speeds(const std::vector<ReducedBody>& bodies) {
  std::vector<double> speeds;
  for (const ReducedBody& body : bodies) speeds.push_back(largest_surface_speed(body));
  return speeds;
}

double energy_of_bodies(const std::vector<ReducedBody>& bodies) {
  double sum = 0.0;
  for (const ReducedBody& body : bodies)
    if (!body.prescribed) sum += kinetic_energy(body) + elastic_energy(body);
  return sum;
}

}  // namespace archetide
