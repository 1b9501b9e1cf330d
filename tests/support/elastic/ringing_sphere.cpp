#include "tests/support/elastic/ringing_sphere.h"

#include <fmt/core.h>
#include <unistd.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "common/base/check.h"
#include "common/params/cli.h"
#include "precompute/build.h"
#include "tests/support/constants.h"
#include "tests/support/dry_body.h"
#include "tests/support/ringing.h"
#include "tests/support/synthetic_archetype.h"
#include "tests/support/water_scene.h"
#include "tests/unit/precompute/wet_sphere.h"

namespace archetide {
namespace {

constexpr double kRadius = 0.2, kDensity = 500.0;  // m, kg/m^3
constexpr double kYoung = 1e6, kPoisson = 0.3;     // Pa

// omega a / c_s of the sphere in unbounded water, lowest spheroidal mode of this degree: Lamb's
// equations with the pressure rho a / (n + 1) d^2 u_r / dt^2 on the surface.
double exact_frequency(int degree) {
  ARCHETIDE_CHECK(degree == 2 || degree == 3);
  return degree == 2 ? wet_sphere::kExact : 2.458947503;
}

// Real spherical harmonics of degree 2 (5) or 3 (7), orthonormal on the unit sphere.
VecX harmonics(int degree, const Vec3& n) {
  if (degree == 2) return wet_sphere::harmonics(n);
  const double x = n[0], y = n[1], z = n[2], pi = std::numbers::pi;
  const double a = 0.25 * std::sqrt(35.0 / (2.0 * pi)), b = 0.25 * std::sqrt(105.0 / pi),
               c = 0.25 * std::sqrt(21.0 / (2.0 * pi)), d = 0.25 * std::sqrt(7.0 / pi);
  Eigen::Matrix<double, 7, 1> h;
  h << a * x * (x * x - 3.0 * y * y), a * y * (3.0 * x * x - y * y), b * z * (x * x - y * y),
      2.0 * b * x * y * z, c * x * (5.0 * z * z - 1.0), c * y * (5.0 * z * z - 1.0),
      d * z * (5.0 * z * z - 3.0);
  return h;
}

// Added mass of the modes for surface velocities of this degree: the pressure rho a / (n + 1).
MatX added_mass(const Archetype& a, int degree) {
  MatX parts = MatX::Zero(2 * degree + 1, a.r());
  for (const Vec3i& t : a.surface.triangles) {
    const Vec3 &p = a.surface.vertices[t[0]], &q = a.surface.vertices[t[1]],
               &s = a.surface.vertices[t[2]];
    const Vec3 area = 0.5 * (q - p).cross(s - p);
    for (int v = 0; v < 3; ++v)
      parts += harmonics(degree, a.surface.vertices[t[v]].normalized()) *
               (area.transpose() * a.surface_modes.middleRows<3>(3 * t[v])) /
               (3.0 * kRadius * kRadius);
  }
  return kWaterDensity * std::pow(kRadius, 3) / (degree + 1) * parts.transpose() * parts;
}

// The wet mode next to the exact one: its shape v and the row v^T M that reads its amplitude.
struct WetMode {
  VecX shape, reader;
};
WetMode wet_mode(const Archetype& a, int degree, double omega) {
  const MatX M = a.M_r + added_mass(a, 2) + added_mass(a, 3);
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> eigen(a.K_r, M);
  const VecX off = (eigen.eigenvalues().cwiseSqrt().array() - omega).abs();
  // Of those of about this frequency the one that moves the water most.
  const MatX added = added_mass(a, degree);
  int best = -1;
  double most = 0.0;
  for (int i = 0; i < a.r(); ++i) {
    const VecX v = eigen.eigenvectors().col(i);
    if (off[i] > 0.05 * omega || v.dot(added * v) <= most) continue;
    best = i, most = v.dot(added * v);
  }
  ARCHETIDE_CHECK_OP(best, >=, 0);
  WetMode mode{eigen.eigenvectors().col(best), {}};
  mode.reader = M * mode.shape;
  return mode;
}

}  // namespace

std::shared_ptr<const Archetype> soft_sphere(int tets) {
  namespace fs = std::filesystem;
  const fs::path file =
      fs::temp_directory_path() / fmt::format("archetide_sphere_{}.obj", ::getpid());
  {
    const TriMesh ball = icosphere(5, kRadius);
    std::ofstream out(file);
    out.precision(17);
    for (const Vec3& x : ball.vertices) out << "v " << x.transpose() << "\n";
    for (const Vec3i& t : ball.triangles) out << "f " << (t.array() + 1).transpose() << "\n";
  }
  Recipe recipe;
  recipe.name = "sphere";
  recipe.mesh = recipe.mesh_path = file.string();
  recipe.tet.order = 2;
  recipe.tet.target = tets;
  recipe.material = {kDensity, kYoung, kPoisson};
  recipe.modes.count = 27;  // T2, S2, S1, T3, S3
  recipe.modes.loads.pressure = true;
  const ScopedLogLevel quiet(LogLevel::kQuiet);
  Profile profile;
  auto archetype = std::make_shared<Archetype>(build_archetype(recipe, profile));
  fs::remove(file);
  return archetype;
}

Ringing ring_in_water(const std::shared_ptr<const Archetype>& sphere, const RingingOptions& c) {
  const double speed = std::sqrt(kYoung / (2.0 * (1.0 + kPoisson)) / kDensity),
               omega = exact_frequency(c.degree) * speed / kRadius, dt = c.step / omega;
  const WetMode mode = wet_mode(*sphere, c.degree, omega);
  SimulationOptions o;
  const int cells = 6 * c.cells_per_radius;
  o.grid = {cells, cells, cells, kRadius / c.cells_per_radius, Vec3::Zero()};
  o.has_water = true;
  o.gravity = Vec3::Zero();
  o.tolerance = 1e-9;
  o.open_side[kZMax] = c.open_top;
  ReducedBody body = make_body(sphere, sphere->r());
  body.position = 0.5 * (o.grid.low() + o.grid.high()) + o.grid.dx * Vec3(0.13, -0.21, 0.37);
  const VecX shape = sphere->surface_modes * mode.shape;
  body.q = 1e-4 * kRadius / shape.cwiseAbs().maxCoeff() * mode.shape;
  Simulation s(o, water_to(o.grid, INFINITY), {body}, {});
  std::vector<double> amplitude = {mode.reader.dot(body.q)};
  Ringing r;
  const auto steps = std::lround(c.periods * 2.0 * std::numbers::pi / c.step);
  for (long n = 0; n < steps; ++n) {
    const StepReport report = s.step(dt);
    amplitude.push_back(mode.reader.dot(s.bodies()[0].q));
    r.iterations = std::max({r.iterations, report.position.iterations, report.velocity.iterations});
  }
  const RingingRate rate = ringing_rate(amplitude);
  const double trapezoid = 2.0 / dt * std::atan(0.5 * omega * dt);
  r.frequency = rate.omega_dt / dt / trapezoid - 1.0;
  r.amplitude = rate.amplitude;
  return r;
}

}  // namespace archetide
