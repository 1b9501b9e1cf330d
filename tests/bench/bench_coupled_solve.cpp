// The coupled pressure solve of water and synthetic bodies: seconds, iterations and true residual
// beside the time that memory bandwidth allows, hypre's PFMG and MIC(0) on the same system.
//   bench_coupled_solve --help

#include <fmt/core.h>
#include <omp.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "runtime/numerics/pcg.h"
#include "tests/bench/mic0.h"
#include "tests/support/coupled_scene.h"
#ifdef ARCHETIDE_HYPRE
#include "tests/bench/pfmg.h"
#endif

namespace archetide {
namespace {

constexpr const char* kHelp =
    R"(bench_coupled_solve [options]: one coupled pressure solve, from zero pressure, and its rivals

  --grid NXxNYxNZ    cells of the tank (64x64x64)
  --fill F           mean height of the wavy water / height of the tank (0.4)
  --bodies B         equal bodies on a lattice, half of them afloat (0)
  --modes R          modes of a body; 0: rigid spheres, else soft blobs (0)
  --density S        density of the bodies / density of water (0.5)
  --geometry G       cut-cell | voxel (cut-cell)
  --threads T        (1)
  --tolerance E      (1e-6)
  --max-iterations N (2000)
  --repeat N         runs of each; the fastest counts (5)
  --clock C          wall | cpu: seconds of all threads, for a busy machine with one thread (wall)
  --deflation D      auto | off | on (auto: where it pays)
  --rivals R         on | off: PFMG and MIC(0) (on)
  --csv F            append a row to F

Columns: setup_s builds everything from the assembled water system and the bodies' F and H^-1;
solve_s includes the final check of the true residual. residual is |b - A x| / |b|, recomputed.
bytes counts what `iterations` must move at least through memory, in this program's own passes and
precisions, when nothing stays in cache from one pass to the next. Per unknown:
  direction and product   reads z, p (fp32), x (fp64); writes p, x, q      2 x 4 + 8 + 4 + 2 x 8
  residual                reads q, r; writes r and b (fp32)                 2 x 8 + 8 + 4
  cycle, way down         reads b; writes x (fp32)                          2 x 4
  cycle, way up           reads b, x; writes z (fp32)                       3 x 4
  coarser levels          6 numbers of 4 bytes per unknown of theirs        24 / 7
together 87.4 bytes; where coefficients are not implied (cut cells, surface, walls) 7 doubles in the
product and 2 x 8 floats in the cycle; of each body F twice (8 bytes an entry and a cell index).
Not counted: set-up, the residual at start and end, deflation vectors. (The same method with all
vectors in fp64 would move 119 bytes.) bound_s = bytes / bandwidth of a triad a = b + s c (24 bytes an
entry, 16 M entries), best of the runs, measured between the solves with the same number of threads.
The rivals run in the same conjugate gradients in fp64 on the same operator, to the same tolerance,
on one thread in the cycle. 0 s: not run (PFMG: built without hypre).
)";

struct Options {
  CoupledSceneOptions scene;
  int threads = 1, repeat = 5, max_iterations = 2000;
  double tolerance = 1e-6;
  DeflationChoice deflation = DeflationChoice::kAuto;
  bool cpu_clock = false, rivals = true;
  std::string csv, geometry = "cut-cell";
};

struct Timing {
  double setup = 0.0, solve = 0.0;
  int iterations = 0;
};

[[noreturn]] void refuse(const std::string& what) {
  std::fprintf(stderr, "bench_coupled_solve: %s (see --help)\n", what.c_str());
  std::exit(2);
}

double number(const std::string& name, const char* text, double low, double high) {
  char* end = nullptr;
  const double value = std::strtod(text, &end);
  if (end == text || *end || !(value >= low) || !(value <= high))
    refuse(fmt::format("{} {}: expected a number from {:f} to {:f}", name, text, low, high));
  return value;
}

Options parse(int argc, char** argv) {
  Options o;
  for (int a = 1; a < argc; ++a) {
    const std::string name = argv[a];
    if (name == "--help" || name == "-h") {
      std::fputs(kHelp, stdout);
      std::exit(0);
    }
    if (a + 1 == argc) refuse(name + ": unknown option or no value");
    const char* value = argv[++a];
    const auto count = [&](int low, int high) {
      return static_cast<int>(number(name, value, low, high));
    };
    if (name == "--grid") {
      Vec3i& n = o.scene.cells;
      int used = 0;
      if (std::sscanf(value, "%dx%dx%d%n", &n[0], &n[1], &n[2], &used) != 3 || value[used] ||
          n.minCoeff() < 4 || n.maxCoeff() > 2048)
        refuse(name + " " + value + ": expected NXxNYxNZ, each from 4 to 2048");
    } else if (name == "--geometry") {
      o.geometry = value;
      if (o.geometry != "cut-cell" && o.geometry != "voxel")
        refuse(name + " " + value + ": expected cut-cell or voxel");
      o.scene.geometry = o.geometry == "voxel" ? Geometry::kVoxel : Geometry::kCutCell;
    } else if (name == "--fill") {
      o.scene.fill = number(name, value, 0.05, 0.95);
    } else if (name == "--bodies") {
      o.scene.bodies = count(0, 4096);
    } else if (name == "--modes") {
      o.scene.modes = count(0, 60);
    } else if (name == "--density") {
      o.scene.density_ratio = number(name, value, 1e-6, 1e3);
    } else if (name == "--threads") {
      o.threads = count(1, 256);
    } else if (name == "--tolerance") {
      o.tolerance = number(name, value, 1e-14, 1e-1);
    } else if (name == "--max-iterations") {
      o.max_iterations = count(1, 100000);
    } else if (name == "--repeat") {
      o.repeat = count(1, 1000);
    } else if (name == "--clock") {
      if (std::strcmp(value, "cpu") && std::strcmp(value, "wall")) refuse(name + ": wall or cpu");
      o.cpu_clock = !std::strcmp(value, "cpu");
    } else if (name == "--rivals") {
      if (std::strcmp(value, "on") && std::strcmp(value, "off")) refuse(name + ": on or off");
      o.rivals = !std::strcmp(value, "on");
    } else if (name == "--deflation") {
      const std::string choice = value;
      if (choice != "auto" && choice != "off" && choice != "on") refuse(name + ": auto, off or on");
      o.deflation = choice == "auto"  ? DeflationChoice::kAuto
                    : choice == "off" ? DeflationChoice::kNever
                                      : DeflationChoice::kAlways;
    } else if (name == "--csv") {
      o.csv = value;
    } else {
      refuse(name + ": unknown option");
    }
  }
  return o;
}

class Clock {
 public:
  explicit Clock(bool cpu) : cpu_(cpu) {}
  double lap() {
    const double t = cpu_ ? watch_.cpu() : watch_.wall();
    watch_ = {};
    return t;
  }

 private:
  bool cpu_;
  Stopwatch watch_;
};

// Bytes a second of a = b + s c.
class Triad {
 public:
  Triad() : a_(kEntries, 0.0), b_(kEntries, 1.0), c_(kEntries, 2.0) {}
  double seconds_per_byte(bool cpu) {
    Clock clock(cpu);
    double *a = a_.data(), *b = b_.data(), *c = c_.data();
#pragma omp parallel for simd schedule(static)
    for (std::size_t i = 0; i < kEntries; ++i) a[i] = b[i] + 3.0 * c[i];
    return clock.lap() / (24.0 * kEntries);
  }

 private:
  static constexpr std::size_t kEntries = 16u << 20;
  std::vector<double> a_, b_, c_;
};

// See kHelp.
double bytes_to_move(const CoupledScene& scene, const PoissonOperator& water, int iterations) {
  double general = 0.0;
  for (int k = 0; k < water.rows().planes(); ++k)
    for (const Segment& s : water.rows().plane(k))
      if (!s.uniform()) general += s.end - s.begin;
  double flux = 0.0;
  for (const CoupledBody& b : scene.bodies)
    flux += 2.0 * 8.0 * b.flux.cell.size() * (b.flux.flux.rows() + 1.0);
  const double unknowns = static_cast<double>(water.unknowns());
  const double per_unknown = 36 + 28 + 8 + 12 + 24.0 / 7.0;
  return iterations * (per_unknown * unknowns + (7 * 8 + 2 * 8 * 4) * general + flux);
}

// A preconditioner for the water, completed for closed regions.
template <class Cycle>
struct Completed {
  const CoupledOperator& op;
  Cycle& cycle;
  void apply(const double* r, double* z) {
    cycle.apply(r, z);
    op.add_closed_correction(r, z);
    op.project(z);
  }
};

template <class Cycle>
Timing time_rival(const Options& o, const CoupledOperator& op, const std::vector<double>& rhs) {
  Timing best;
  PcgWorkspace workspace;
  PcgOptions options;
  options.tolerance = o.tolerance;
  options.max_iterations = o.max_iterations;
  // One run tells enough of a method several times slower.
  Clock clock(o.cpu_clock);
  Cycle cycle(op.water().matrix());
  best.setup = clock.lap();
  Completed<Cycle> preconditioner{op, cycle};
  std::vector<double> x(rhs.size(), 0.0);
  workspace.reserve(rhs.size());
  for (int run = 0; run < 2; ++run) {
    std::fill(x.begin(), x.end(), 0.0);
    clock.lap();
    const SolveReport report = pcg(op, preconditioner, rhs.data(), x.data(), options, workspace);
    const double t = clock.lap();
    best.solve = run == 0 ? t : std::min(best.solve, t);
    best.iterations = report.iterations;
  }
  return best;
}

void append_row(const Options& o, const std::string& row) {
  std::FILE* f = std::fopen(o.csv.c_str(), "a");
  if (!f) {
    std::fprintf(stderr, "%s: %s\n", o.csv.c_str(), std::strerror(errno));
    std::exit(5);
  }
  std::fseek(f, 0, SEEK_END);
  if (std::ftell(f) == 0)
    std::fputs(
        "grid,fill,bodies,modes,density,geometry,threads,unknowns,setup_s,solve_s,iterations,"
        "residual,bytes,bound_s,pfmg_setup_s,pfmg_solve_s,mic_setup_s,mic_solve_s\n",
        f);
  std::fputs(row.c_str(), f);
  if (std::fclose(f) != 0) std::exit(5);
}

int main_of(const Options& o) {
  omp_set_num_threads(o.threads);
  const CoupledScene scene(o.scene);
  CoupledSolver solver;
  CoupledSolveOptions options;
  options.tolerance = o.tolerance;
  options.max_iterations = o.max_iterations;
  options.deflation = o.deflation;

  // The first run is to warm up.
  Triad triad;
  Timing ours{1e9, 1e9, 0};
  double seconds_per_byte = 1e9;
  SolveReport report;
  for (int run = 0; run <= o.repeat; ++run) {
    const CoupledScene::Result result = scene.solve(solver, options);
    report = result.report;
    seconds_per_byte = std::min(seconds_per_byte, triad.seconds_per_byte(o.cpu_clock));
    if (run == 0) continue;
    const bool cpu = o.cpu_clock;
    ours.setup = std::min(ours.setup, cpu ? report.setup_cpu_seconds : report.setup_seconds);
    ours.solve = std::min(ours.solve, cpu ? report.solve_cpu_seconds : report.solve_seconds);
  }
  const CoupledOperator& op = solver.last_operator();
  const double bytes = bytes_to_move(scene, op.water(), report.iterations);
  const double bound = bytes * seconds_per_byte;

  Timing pfmg, mic;
  if (o.rivals) {
#ifdef ARCHETIDE_HYPRE
    pfmg = time_rival<Pfmg>(o, op, solver.last_right_hand_side());
#endif
    mic = time_rival<Mic0>(o, op, solver.last_right_hand_side());
  }

  const Vec3i& n = o.scene.cells;
  std::printf(
      "%dx%dx%d, %zu unknowns, %d bodies of %d dof, density ratio %g, %s, %d threads, %s seconds\n",
      n[0], n[1], n[2], op.water().unknowns(), o.scene.bodies, 6 + o.scene.modes,
      o.scene.density_ratio, o.geometry.c_str(), o.threads, o.cpu_clock ? "cpu" : "wall");
  std::printf("residual %.2e%s, triad %.1f GB/s, memory of the solver %.0f MB, deflated %d\n",
              report.residual, report.converged ? "" : " (NOT CONVERGED)", 1e-9 / seconds_per_byte,
              1e-6 * static_cast<double>(solver.bytes()), solver.deflated_columns());
  std::printf("%-16s %8s %8s %8s %6s %8s\n", "", "set-up", "solve", "total", "iter.", "/ bound");
  const auto line = [&](const char* name, const Timing& t) {
    if (t.solve > 0.0)
      std::printf("%-16s %8.3f %8.3f %8.3f %6d %8.2f\n", name, t.setup, t.solve, t.setup + t.solve,
                  t.iterations, (t.setup + t.solve) / bound);
  };
  ours.iterations = report.iterations;
  line("archetide", ours);
  std::printf("%-16s %8s %8.3f %8.3f %6d\n", "bandwidth bound", "", bound, bound,
              report.iterations);
  line("PFMG-CG", pfmg);
  line("MIC(0)-CG", mic);

  if (!o.csv.empty()) {
    char row[512];
    std::snprintf(
        row, sizeof row,
        "%dx%dx%d,%g,%d,%d,%g,%s,%d,%zu,%.6g,%.6g,%d,%.4g,%.6g,%.6g,%.6g,%.6g,%.6g,%.6g\n", n[0],
        n[1], n[2], o.scene.fill, o.scene.bodies, o.scene.modes, o.scene.density_ratio,
        o.geometry.c_str(), o.threads, op.water().unknowns(), ours.setup, ours.solve,
        report.iterations, report.residual, bytes, bound, pfmg.setup, pfmg.solve, mic.setup,
        mic.solve);
    append_row(o, row);
  }
  return report.converged ? 0 : 3;
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) { return archetide::main_of(archetide::parse(argc, argv)); }
