// Prints what the precompute costs next to how accurate it is: CPU seconds by phase, mesh quality,
// error of the sphere's frequencies. Usage: bench_precompute [cgal|gmsh]

#include <cmath>
#include <cstdio>
#include <ctime>
#include <string>
#include <utility>

#include "common/input_error.h"
#include "precompute/eigen_solver.h"
#include "precompute/modes.h"
#include "precompute/tetrahedralize.h"
#include "tests/unit/precompute/shapes.h"

namespace archetide {
namespace {

const Material kMaterial{.density = 1000.0, .young = 1e6, .poisson = 0.3};

/// CPU seconds since the last call.
double lap() {
  static std::clock_t last = std::clock();
  const std::clock_t now = std::clock(), before = std::exchange(last, now);
  return double(now - before) / CLOCKS_PER_SEC;
}

/// Largest relative error of the first 20 frequencies of the elastic unit sphere, nu = 0.3 (Lamb):
/// x = omega a / c_s of T2 (5), S2 (5), S1 (3), T3 (7).
double sphere_error(const VecX& omega2) {
  const double shear_speed =
      std::sqrt(kMaterial.young / (2.0 * (1.0 + kMaterial.poisson)) / kMaterial.density);
  const double exact[4] = {2.50113262, 2.646217035, 3.529987301, 3.864699778};
  const int last[4] = {5, 10, 13, 20};
  double worst = 0.0;
  for (int k = 0, family = 0; k < omega2.size() && k < 20; ++k) {
    if (k == last[family]) ++family;
    worst = std::max(worst, std::abs(std::sqrt(omega2[k]) / shear_speed / exact[family] - 1.0));
  }
  return worst;
}

void print_row(const char* name, const TriMesh& surface, Mesher mesher, MassKind mass, int target,
               int count, bool is_sphere) {
  lap();
  TetrahedralizeOptions options;
  options.mesher = mesher;
  options.target = target;
  TetrahedralizeResult body = tetrahedralize(surface, options);
  move_to_centre_of_mass(body.mesh);
  const double mesh = lap();

  Profile profile;
  ModesOptions modes_options;
  modes_options.count = count;
  modes_options.mass = mass;
  const ModesResult modes = compute_modes(body.mesh, kMaterial, modes_options, profile);
  const double total = lap();

  // The profile has wall seconds; scale them to the CPU seconds of the whole.
  double wall = 0.0;
  for (const std::string& phase : profile.phases()) wall += profile.seconds(phase);
  const double scale = total / wall;
  const TetQuality& q = body.quality;
  std::printf(
      "%-7s %7d %7d | %6.2f %6.2f %6.2f %6.2f %6.2f %6.2f | %6.2f | %5.1f %5.2f %8.1e | %5d %8.1e",
      name, q.tets, count, mesh, scale * (profile.seconds("assemble") + profile.seconds("order")),
      scale * profile.seconds("factor"), scale * profile.seconds("iterate"),
      scale * profile.seconds("sturm"), scale * profile.seconds("integrals"), mesh + total,
      q.min_dihedral, 100.0 * body.raw_volume_error, q.volume_error, modes.operator_calls,
      modes.residuals.maxCoeff());
  if (is_sphere) std::printf(" %6.3f", 100.0 * sphere_error(modes.omega2));
  std::printf("\n");
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  using namespace archetide;
  const Mesher mesher = argc > 1 && std::string(argv[1]) == "gmsh" ? Mesher::kGmsh : Mesher::kCgal;
  std::printf("CPU seconds, %s\n", prepare_blas().name.c_str());
  std::printf(
      "body       tets   modes |   mesh  assem factor iterat  sturm integr |  total | "
      "dihed  vol%%  vol err | calls residual  freq%%\n");
  const MassKind consistent = MassKind::kConsistent;
  try {
    for (MassKind mass : {consistent, MassKind::kLumped}) {
      std::printf(mass == consistent ? "consistent mass\n" : "lumped mass\n");
      print_row("sphere", shapes::sphere(1.0, 5), mesher, mass, 7'000, 20, true);
      print_row("sphere", shapes::sphere(1.0, 5), mesher, mass, 40'000, 20, true);
    }
    print_row("torus", shapes::torus(0.25, 0.1, 154, 78), mesher, consistent, 5'000, 10, false);
    print_row("torus", shapes::torus(0.25, 0.1, 154, 78), mesher, consistent, 60'000, 10, false);
  } catch (const Error& error) {  // gmsh refuses surfaces with bad triangles
    std::printf("%s\n", error.what());
    return error.exit_code;
  }
}
