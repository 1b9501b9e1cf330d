#include "tests/support/single_solve_cases.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/support/constants.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

constexpr double kGravity = 9.81;                          // m/s^2
constexpr double kShapeRadius = 4.0, kHalfSide = 8.3 / 2;  // of the test shapes, m (cells)

std::shared_ptr<const Archetype> sphere_of(double radius, double density) {
  return rigid_surface_archetype(volume_true_sphere(5, radius), density);
}

SolveReport solved(CoupledTank& tank, double dt) {
  const SolveReport report = tank.solve(dt);
  if (!report.converged) throw std::runtime_error("the coupled solve did not converge");
  return report;
}

// A closed cylinder along y from -half to half whose section has the area of the circle, in `rings`
// rings of triangles.
TriMesh cylinder(double radius, double half, int sides, int rings) {
  const double step = 2.0 * M_PI / sides, r = radius * std::sqrt(step / std::sin(step));
  TriMesh mesh;
  for (int j = 0; j <= rings; ++j)
    for (int n = 0; n < sides; ++n)
      mesh.vertices.push_back(
          {r * std::cos(n * step), half * (2.0 * j / rings - 1.0), r * std::sin(n * step)});
  const int ends = static_cast<int>(mesh.vertices.size());
  mesh.vertices.push_back({0, -half, 0});
  mesh.vertices.push_back({0, half, 0});
  for (int n = 0; n < sides; ++n) {
    const int m = (n + 1) % sides;
    for (int j = 0; j < rings; ++j) {
      const int low = j * sides, high = low + sides;
      mesh.triangles.push_back({low + n, high + n, low + m});
      mesh.triangles.push_back({low + m, high + n, high + m});
    }
    mesh.triangles.push_back({ends, n, m});
    mesh.triangles.push_back({ends + 1, rings * sides + m, rings * sides + n});
  }
  if (enclosed_volume(mesh) < 0.0)
    for (Vec3i& t : mesh.triangles) std::swap(t[0], t[1]);
  return mesh;
}

// What is left of a box around the origin when a ball is taken out of its middle.
TriMesh box_with_hole(double edge, double radius) {
  TriMesh mesh = box_surface(Vec3::Constant(edge), 3);
  const TriMesh ball = volume_true_sphere(5, radius);
  const int first = static_cast<int>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), ball.vertices.begin(), ball.vertices.end());
  for (const Vec3i& t : ball.triangles)
    mesh.triangles.push_back(Vec3i(t[1], t[0], t[2]) + Vec3i::Constant(first));
  return mesh;
}

}  // namespace

AddedMassOfHeave added_mass(CoupledTank tank, std::shared_ptr<const Archetype> archetype,
                     const Vec3& position, double density_ratio, double displaced) {
  const double share = displaced > 0.0 ? displaced / archetype->volume : 1.0;
  ReducedBody body = make_body(archetype, 0);
  body.mass_scale = density_ratio * kWaterDensity / archetype->density;
  body.position = position;
  body.P = Vec3(0, 0, body_mass(body));
  tank.bodies.push_back(body);
  const int iterations = solved(tank, 0.01).iterations;
  return {density_ratio * (1.0 / tank.results[0].y[2] - 1.0) / share, iterations};
}

AddedMassOfHeave added_mass_in_cube(int cells_per_radius, Geometry geometry, bool open_top) {
  CoupledTank tank(4 * cells_per_radius, 2.0);
  tank.options.geometry = geometry;
  tank.options.open_side[kZMax] = open_top;
  return added_mass(std::move(tank), sphere_of(1.0, kWaterDensity), Vec3::Zero());
}

AddedMassOfHeave added_mass_near_wall(int cells_per_radius) {
  const int c = cells_per_radius;
  const CoupledTank tank(Grid{16 * c, 16 * c, 12 * c, 1.0 / c, Vec3(-8, -8, 0)});
  return added_mass(tank, sphere_of(1.0, kWaterDensity), Vec3(0, 0, 1.5));
}

AddedMassOfHeave added_mass_in_shell(int cells_per_radius) {
  CoupledTank tank(5 * cells_per_radius, 2.5);
  tank.obstacles.push_back(box_with_hole(6.0, 2.0));
  return added_mass(std::move(tank), sphere_of(1.0, kWaterDensity), Vec3::Zero());
}

AddedMassOfHeave added_mass_of_cylinder(int cells_per_radius, bool open_top, int thickness,
                                 double beyond) {
  const int n = 4 * cells_per_radius;
  const double dx = 1.0 / cells_per_radius, width = thickness * dx;
  CoupledTank tank(Grid{n, thickness, n, dx, Vec3(-2, -0.5 * width, -2)});
  tank.options.open_side[kZMax] = open_top;
  const auto archetype = rigid_surface_archetype(
      cylinder(1.0, 0.5 * width + beyond * dx, 16 * cells_per_radius, thickness), kWaterDensity);
  return added_mass(std::move(tank), archetype, Vec3::Zero(), 1.0, M_PI * width);
}

double cube_added_mass_spread() {
  const auto cube = test_shape(TestShape::kCube);
  double low = INFINITY, high = 0.0;
  for (int n = 0; n < 8; ++n) {
    const CoupledTank tank(32, 16.0);
    const double k = added_mass(tank, cube, Vec3(0.2, 0.3, n / 8.0)).coefficient;
    low = std::min(low, k), high = std::max(high, k);
  }
  return high / low - 1.0;
}

Vec3 sub_cell_offset(int n) {
  const Vec3 a(0.8191725, 0.6710436, 0.5497005);
  return (n * a).unaryExpr([](double x) { return x - std::floor(x) - 0.5; });
}

OffsetErrors added_mass_over_offsets(int cells_per_radius, int positions, double density_ratio) {
  constexpr double kExact = 0.5143261253;  // walls make a shift of half a cell matter by < 1e-4
  const auto sphere = sphere_of(cells_per_radius, kWaterDensity);
  OffsetErrors errors;
  double squares = 0.0;
  for (int n = 0; n < positions; ++n) {
    const CoupledTank tank(8 * cells_per_radius, 4.0 * cells_per_radius);
    const AddedMassOfHeave found = added_mass(tank, sphere, sub_cell_offset(n), density_ratio);
    const double error = found.coefficient / kExact - 1.0;
    errors.mean += error / positions, squares += error * error;
    errors.worst = std::max(errors.worst, std::abs(error));
    errors.iterations = std::max(errors.iterations, found.iterations);
  }
  errors.rms = std::sqrt(squares / positions);
  return errors;
}

double buoyancy(const std::shared_ptr<const Archetype>& archetype, const Vec3& x, double level) {
  CoupledTank tank(20, 10.0);
  const Grid& g = tank.options.grid;
  tank.options.hydrostatics.gravity = Vec3(0, 0, -kGravity);
  tank.options.open_side[kZMax] = true;
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) tank.phi(i, j, k) = g.cell_centre(i, j, k)[2] - level;
  ReducedBody body = make_body(archetype, 0);
  body.mass_scale = 1e9;  // it is held
  body.position = x;
  const double dt = 1e-3;
  // Weight takes this momentum away during the step: the body is at rest after it.
  body.P = Vec3(0, 0, kGravity * dt * body_mass(body));
  tank.bodies.push_back(body);
  solved(tank, dt);
  return tank.results[0].water_impulse[2] / dt / (kWaterDensity * kGravity * archetype->volume);
}

std::shared_ptr<const Archetype> test_shape(TestShape shape) {
  if (shape == TestShape::kSphere) return sphere_of(kShapeRadius, kWaterDensity);
  return rigid_surface_archetype(box_surface(Vec3::Constant(2 * kHalfSide), 4), kWaterDensity);
}

double submerged_share(TestShape shape, double z) {
  if (shape == TestShape::kCube) return std::clamp(0.5 - z / (2 * kHalfSide), 0.0, 1.0);
  const double h = std::clamp(1.0 - z / kShapeRadius, 0.0, 2.0);
  return h * h * (3.0 - h) / 4.0;
}

OffsetErrors buoyancy_over_offsets(TestShape shape, double level, int positions) {
  const auto body = test_shape(shape);
  OffsetErrors errors;
  double squares = 0.0;
  for (int n = 0; n < positions; ++n) {
    const Vec3 x = sub_cell_offset(n);
    const double error = buoyancy(body, x, level) / submerged_share(shape, x[2] - level) - 1.0;
    errors.mean += error / positions, squares += error * error;
    errors.worst = std::max(errors.worst, std::abs(error));
  }
  errors.rms = std::sqrt(squares / positions);
  return errors;
}

double release_acceleration(int cells_per_radius) {
  CoupledTank tank(4 * cells_per_radius, 2.0);
  tank.options.hydrostatics.gravity = Vec3(0, 0, -kGravity);
  tank.options.open_side[kZMax] = true;
  tank.bodies.push_back(make_body(sphere_of(1.0, 0.5 * kWaterDensity), 0));
  const double dt = 1e-3;
  solved(tank, dt);
  return tank.results[0].y[2] / dt / kGravity;
}

DamBreakStart dam_break_start(int cells) {
  const double dx = 1.0 / cells, dt = 1e-4;
  CoupledTank tank(Grid{2 * cells, 1, 5 * cells / 2, dx, Vec3::Zero()});
  const Grid& g = tank.options.grid;
  tank.options.hydrostatics.gravity = Vec3(0, 0, -kGravity);
  tank.options.open_side[kZMax] = true;
  for (int k = 0; k < g.nz; ++k)
    for (int i = 0; i < g.nx; ++i) {
      const Vec3 x = g.cell_centre(i, 0, k);
      tank.phi(i, 0, k) = std::max(x[0] - 1.0, x[2] - 2.0);
    }
  // Weight is the explicit force: u* of the water is -g dt, and what it keeps of that is its
  // acceleration. Momentum rates of the water are the forces of wall and floor.
  tank.u.resize(g, 0.0);
  const int iterations = solved(tank, dt).iterations;
  Vec3 rate = Vec3::Zero();  // of momentum / (rho g a^2), per unit of thickness
  for (const int a : {0, 2})
    for (int k = 0; k < tank.u[a].nz(); ++k)
      for (int i = 0; i < tank.u[a].nx(); ++i) {
        const Vec3 x = g.face_centre(a, i, 0, k);
        // The share of the face's dual cell that lies in the water.
        const double in_x = std::clamp((1.0 - x[0]) / dx + 0.5, 0.0, 1.0);
        const double in_z = std::clamp((2.0 - x[2]) / dx + 0.5, 0.0, 1.0);
        rate[a] += tank.u[a](i, 0, k) / dt * in_x * in_z * dx * dx / kGravity;
      }
  return {rate[0], 2.0 + rate[2], iterations};
}

}  // namespace archetide
