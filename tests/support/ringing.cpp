#include "tests/support/ringing.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/constants.h"
#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"
#include "tests/support/water_scene.h"

namespace archetide {
namespace {

// Amplitudes at the turning points (parabola through three steps) and times of the zeros, steps.
struct Trace {
  std::vector<double> peaks, zeros;
};
Trace trace_of(const std::vector<double>& c) {
  Trace t{{std::abs(c[0])}, {}};
  for (std::size_t n = 1; n < c.size(); ++n)
    if (c[n - 1] * c[n] < 0.0)
      t.zeros.push_back(static_cast<double>(n) - 1.0 + c[n - 1] / (c[n - 1] - c[n]));
  for (std::size_t n = 1; n + 1 < c.size(); ++n) {
    const double before = std::abs(c[n - 1]), here = std::abs(c[n]), after = std::abs(c[n + 1]);
    if (here < before || here <= after) continue;
    const double slope = 0.5 * (after - before), bend = after + before - 2.0 * here;
    t.peaks.push_back(here - slope * slope / (2.0 * bend));
  }
  return t;
}

constexpr double kRadius = 0.2, kDensity = 500.0;  // m, kg/m^3

// A cylinder along y, as heavy as the round one.
TetMesh cylinder_tets(double length, int across) {
  TetMesh mesh = box_tets(Vec3(2.0, length, 2.0), Vec3i(across, 2, across));
  const double angle = 2.0 * std::numbers::pi / (4.0 * across);
  const double radius = kRadius * std::sqrt(angle / std::sin(angle));  // of a polygon of its area
  for (Vec3& x : mesh.nodes) {
    const double r = std::hypot(x[0], x[2]);
    const double drawn = r > 0.0 ? radius * std::max(std::abs(x[0]), std::abs(x[2])) / r : 0.0;
    const double phi = std::atan2(x[2], x[0]);
    // equal angles on the rim
    const double turn = std::numbers::pi / 4.0,
                 sector = std::round(phi / (2.0 * turn)) * 2.0 * turn;
    const double even = sector + turn * std::tan(phi - sector);
    x[0] = drawn * r * std::cos(even), x[2] = drawn * r * std::sin(even);
  }
  return mesh;
}

}  // namespace

RingingRate ringing_rate(const std::vector<double>& samples) {
  const Trace t = trace_of(samples);
  const double half = (t.zeros.back() - t.zeros.front()) / static_cast<double>(t.zeros.size() - 1);
  return {
      std::numbers::pi / half,
      std::pow(t.peaks.back() / t.peaks[0], 2.0 / static_cast<double>(t.peaks.size() - 1)) - 1.0};
}

CylinderRinging ringing_cylinder(int degree, int cells_per_radius) {
  const double dry = 20.0;  // rad/s
  // of mass sum |u|^2 of u = grad (r^n cos n phi) / (n a^(n-1)): rho_b pi a^2 / n to the water's
  // rho pi a^2 / n
  const double omega = dry * std::sqrt(kDensity / (kDensity + kWaterDensity)), dt = 0.1 / omega;
  SimulationOptions o;
  const int cells = 8 * cells_per_radius;
  constexpr double kLength = 3.0;  // cells; it reaches through both walls of the one cell's slab
  const double dx = kRadius / cells_per_radius;
  o.grid = {cells, 1, cells, dx, Vec3::Zero()};
  o.has_water = true;
  o.gravity = Vec3::Zero();
  o.tolerance = 1e-9;
  o.wall_contact = false;
  const TetMesh tets = cylinder_tets(kLength * dx, 24);
  MatX shape(3 * static_cast<Eigen::Index>(tets.nodes.size()), 1);
  for (std::size_t n = 0; n < tets.nodes.size(); ++n) {
    const Vec3& x = tets.nodes[n];
    const double r = std::pow(std::hypot(x[0], x[2]) / kRadius, degree - 1),
                 phi = (degree - 1) * std::atan2(x[2], x[0]);
    shape.block<3, 1>(3 * static_cast<Eigen::Index>(n), 0) =
        r * Vec3(std::cos(phi), 0.0, -std::sin(phi));
  }
  ReducedBody body = make_body(
      deformable_archetype(tets, kDensity / kLength, shape, VecX::Constant(1, dry)).archetype, 1);
  body.position = Vec3(4.0 * kRadius + 0.13 * dx, 0.5 * dx, 4.0 * kRadius - 0.21 * dx);
  body.q[0] = 1e-4 * kRadius / body.archetype->surface_modes.cwiseAbs().maxCoeff();
  Simulation s(o, water_to(o.grid, INFINITY), {body}, {});
  std::vector<double> samples = {body.q[0]};
  CylinderRinging result;
  for (int n = 0; n < static_cast<int>(4.0 * std::numbers::pi / 0.1); ++n) {
    const StepReport r = s.step(dt);
    samples.push_back(s.bodies()[0].q[0]);
    result.iterations = std::max({result.iterations, r.position.iterations, r.velocity.iterations});
  }
  const RingingRate rate = ringing_rate(samples);
  result.frequency = rate.omega_dt / (2.0 * std::atan(0.05)) - 1.0;
  result.amplitude = rate.amplitude;
  return result;
}

}  // namespace archetide
