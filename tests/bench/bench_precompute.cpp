// Prints what the precompute costs next to how accurate it is: CPU seconds by phase, mesh quality,
// error of the frequencies against closed forms or a finer mesh.
// Usage: bench_precompute [builds] [sphere] [bar] [torus] [wet] [bodies] [large]   (nothing: all)
//        bench_precompute one SURFACE.obj ORDER TARGET MODES

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "common/base/input_error.h"
#include "common/base/keep_memory.h"
#include "common/files/surface_io.h"
#include "common/params/cli.h"
#include "precompute/build.h"
#include "precompute/meshing/tetrahedralize.h"
#include "precompute/modal/eigen_solver.h"
#include "precompute/modal/memory.h"
#include "precompute/modal/modes.h"
#include "tests/support/cpu_seconds.h"
#include "tests/support/elastic/elastic_cases.h"
#include "tests/unit/precompute/shapes.h"
#include "tests/unit/precompute/wet_sphere.h"

namespace archetide {
namespace {

double peak_gigabytes() { return 1e-9 * peak_memory(); }

using Case = ElasticCase;

/// omega of the modes; prints one row up to the error.
VecX run(const Case& c, TetMesh* mesh_out = nullptr, ModesResult* modes_out = nullptr) {
  const ElasticResult result = elastic_modes(c);
  const TetrahedralizeResult& body = result.body;
  const ModesResult& modes = result.modes;
  const Profile& profile = result.profile;
  const double mesh = result.mesh_cpu, total = result.modes_cpu;

  // The profile has wall seconds; scale them to the CPU seconds of the whole.
  double wall = 0.0;
  for (const std::string& phase : profile.phases()) wall += profile.seconds(phase);
  const auto seconds = [&](const char* phase) { return total / wall * profile.seconds(phase); };
  std::printf(
      "%-11s %d %-10s %4.2f %7d %7d %4d | %6.2f %6.2f %6.2f %6.2f %6.2f %6.2f | %6.2f %5.2f | "
      "%5.1f "
      "%5.2f %8.1e %4d %4d %5.2f | %8.1e",
      c.name.c_str(), c.order, modes.mass == MassKind::kLumped ? "lumped" : "consistent", c.poisson,
      body.quality.tets, 3 * int(body.mesh.nodes.size()), int(modes.omega2.size()), mesh,
      seconds("assemble") + seconds("order"), seconds("factor"),
      seconds("iterate") + seconds("static"), seconds("sturm"), seconds("integrals"), mesh + total,
      peak_gigabytes(), body.quality.min_dihedral, 100.0 * body.raw_volume_error,
      body.quality.volume_error, body.curved.moved, body.curved.held_back,
      body.curved.smallest_jacobian, modes.residuals.head(modes.vibration_modes()).maxCoeff());
  if (mesh_out) *mesh_out = body.mesh;
  if (modes_out) *modes_out = modes;
  return modes.omega2.cwiseSqrt();
}

/// Largest relative deviation in percent of the first `count` from `exact`.
double percent(const VecX& omega, const VecX& exact, int count) {
  return 100.0 * worst_deviation(omega, exact, count);
}

void sphere_rows() {
  const TriMesh surface = shapes::sphere(1.0, 6);
  const auto row = [&](int order, int target, double poisson, std::optional<MassKind> mass = {}) {
    const Case c{"sphere", surface, order, target, 20, poisson, mass};
    const VecX omega = run(c), exact = lamb_sphere(material_of(c));
    std::printf(" %7.3f %7.3f\n", percent(omega, exact, 10), percent(omega, exact, 20));
  };
  for (const double poisson : {0.3, 0.45}) {
    for (const int target : {240, 600, 1'300, 4'000}) row(2, target, poisson);
    for (const int target : {7'000, 40'000}) row(1, target, poisson);
  }
  for (const int target : {7'000, 40'000}) row(1, target, 0.3, MassKind::kConsistent);
}

/// Free bar 20 x 1 x 1: Timoshenko's first four bending frequencies, each twice.
void bar_rows() {
  const TriMesh surface = shapes::box(Vec3(20, 1, 1), 20);
  for (const auto& [order, target] : std::vector<std::pair<int, int>>{
           {2, 500}, {2, 680}, {2, 850}, {2, 3'000}, {1, 3'000}, {1, 20'000}}) {
    const Case c{"bar", surface, order, target, kBarModes};
    for (const double error : bar_bending_errors(run(c), material_of(c)))
      std::printf(" %7.3f", 100.0 * error);
    std::printf("\n");
  }
}

/// Against `finest` quadratic tets.
void compare_rows(const std::string& name, const TriMesh& surface, int count, int finest,
                  const std::vector<std::pair<int, int>>& orders_and_targets,
                  double poisson = 0.3) {
  const VecX reference = run({name, surface, 2, finest, count, poisson});
  std::printf(" reference\n");
  for (const auto& [order, target] : orders_and_targets) {
    const VecX omega = run({name, surface, order, target, count, poisson});
    const int both = std::min(int(omega.size()), int(reference.size()));
    std::printf(" %7.3f\n", percent(omega, reference, std::min(both, count)));
  }
}

void torus_rows() {
  compare_rows("torus", shapes::torus(0.25, 0.1, 154, 78), 10, 30'000,
               {{2, 1'500}, {2, 5'000}, {1, 5'000}, {1, 60'000}});
}

/// The bodies of `folder`, 20 modes: reference, as their body files say, and others around it.
void body_rows(const std::string& folder) {
  const std::vector<std::pair<int, int>> others[4] = {
      {{2, 500}, {1, 9'000}}, {{2, 4'000}, {1, 6'000}}, {{2, 1'500}, {1, 60'000}}, {{1, 37'000}}};
  int index = 0;
  for (const char* name : {"sphere", "starfish", "torus", "jellyfish"}) {
    const Recipe recipe = read_recipe(folder + "/" + name + ".body.toml");
    const TriMesh surface = read_surface(recipe.mesh_path).mesh;
    std::vector<std::pair<int, int>> rows = {{recipe.tet.order, recipe.tet.target}};
    rows.insert(rows.end(), others[index].begin(), others[index].end());
    compare_rows(name, surface, 20, 4 * recipe.tet.target, rows, recipe.material.poisson);
    ++index;
  }
}

/// The sphere in a liquid of twice its density, from ten dry modes (T2 and S2: one for each wet
/// one) and with their static pressure vectors. Last columns: error without and with them.
void wet_rows() {
  const TriMesh surface = shapes::sphere(1.0, 6);
  for (const int target : {240, 600, 1'300, 4'000}) {
    Case c{"wet sphere", surface, 2, target, 10};
    c.loads.pressure = true;
    ModesResult modes;
    TetMesh mesh;
    run(c, &mesh, &modes);
    const double rho = 2.0 * material_of(c).density;
    for (const Eigen::Index columns : {Eigen::Index(10), modes.omega2.size()})
      std::printf(" %7.3f", 100.0 * (wet_sphere::lowest(mesh, modes, columns, material_of(c), rho) /
                                         wet_sphere::kExact -
                                     1.0));
    std::printf("\n");
  }
}

/// The paper's models, 20 modes each, as archetide-precompute makes them from their body files: the
/// whole build with surface, cut, distance grid, estimated errors and writing of the archetype.
void build_rows(const std::string& folder) {
  const std::string path =
      (std::filesystem::temp_directory_path() / fmt::format("bench_precompute_{}", getpid()))
          .string();
  std::printf("\nwhole builds      tets modes |  CPU s target | error %% (estimated)\n");
  const ScopedLogLevel quiet(LogLevel::kQuiet);
  double jellyfish = 0.0;
  const std::vector<std::pair<std::string, double>> bodies = {
      {"sphere", 1.0},         {"starfish", 2.0},       {"torus", 5.0},
      {"jellyfish_bell", NAN}, {"jellyfish_arm1", NAN}, {"jellyfish_arm2", NAN},
      {"jellyfish_arm3", NAN}, {"jellyfish_arm4", NAN}};
  // All of them first: what a mesher's process costs to start grows with the memory of this one.
  std::vector<Archetype> built;
  std::vector<double> seconds;
  const auto recipe_of = [&](const std::string& name) {
    Recipe recipe = read_recipe(folder + "/" + name + ".body.toml");
    recipe.modes.count = 20;
    return recipe;
  };
  for (const auto& [name, target] : bodies) {
    const double start = cpu_seconds();
    Profile profile;
    built.push_back(build_archetype(recipe_of(name), profile));
    write_archetype(path, built.back());
    seconds.push_back(cpu_seconds() - start);
    std::filesystem::remove(path);
    if (std::isnan(target)) jellyfish += seconds.back();
  }
  for (std::size_t n = 0; n < bodies.size(); ++n) {
    const Archetype& a = built[n];
    Recipe recipe = recipe_of(bodies[n].first);
    recipe.tet.target *= 4;
    recipe.tet.mesher = Mesher::kCgal;
    Profile profile;
    const Archetype finer = build_archetype(recipe, profile);
    const double off =
        percent(a.omega2.cwiseSqrt(), finer.omega2.cwiseSqrt(), int(std::min(a.r(), finer.r())));
    const double estimate =
        a.frequency_error.size() > 0 ? a.frequency_error.cwiseAbs().maxCoeff() : NAN;
    std::printf("%-15s %6zu %5d | %6.2f %6.0f | %7.2f %7.2f\n", bodies[n].first.c_str(),
                a.tets.tets.size(), a.r(), seconds[n], bodies[n].second, off, 100.0 * estimate);
  }
  std::printf("the jellyfish's parts        | %6.2f %6.0f\n", jellyfish, 8.0);
}

void large_rows() {
  const TriMesh surface = shapes::torus(0.25, 0.1, 154, 78);
  run({"torus", surface, 1, 300'000, 20});
  std::printf("\n");
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  using namespace archetide;
  keep_freed_memory();
  std::vector<std::string> groups(argv + 1, argv + argc);
  // The builds first: they are timed as programs of their own would be, in a small process.
  if (groups.empty()) groups = {"builds", "sphere", "bar", "torus", "wet", "bodies", "large"};
  std::printf("CPU seconds, %s\n", prepare_blas().name.c_str());
  std::printf(
      "body  order mass     nu      tets     dof modes |   mesh  assem factor iterat  sturm integr "
      "|  "
      "total    GB | dihed  vol%%  vol err bent held  minJ | residual errors %%\n");
  try {
    if (groups[0] == "one" && groups.size() == 5) {
      const TriMesh surface = read_surface(groups[1]).mesh;
      const VecX omega = run({"one", surface, std::atoi(groups[2].c_str()),
                              std::atoi(groups[3].c_str()), std::atoi(groups[4].c_str())});
      std::printf("\n");
      return 0;
    }
    for (const std::string& group : groups) {
      if (group == "sphere") sphere_rows();
      if (group == "bar") bar_rows();
      if (group == "torus") torus_rows();
      if (group == "bodies") body_rows("assets/bodies");
      if (group == "builds") build_rows("assets/bodies");
      if (group == "large") large_rows();
      if (group == "wet") wet_rows();
      std::fflush(stdout);
    }
  } catch (const Error& error) {
    std::printf("%s\n", error.what());
    return error.exit_code;
  }
}
