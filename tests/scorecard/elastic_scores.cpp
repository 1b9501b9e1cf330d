#include <fmt/core.h>

#include <cstdio>

#include "tests/scorecard/reference_data.h"
#include "tests/scorecard/score.h"
#include "tests/support/elastic/elastic_cases.h"
#include "tests/support/elastic/ringing_sphere.h"
#include "tests/unit/precompute/shapes.h"
#include "tests/unit/precompute/wet_sphere.h"

namespace archetide {
namespace {

std::string tets(const ElasticResult& r, int order) {
  return fmt::format("{}{}", r.body.mesh.tets.size(), order == 2 ? " P2 tets" : " P1 tets");
}

std::vector<ScoreRow> dry_sphere() {
  const TriMesh surface = shapes::sphere(1.0, 6);
  const auto row = [&](int order, int target, double goal) {
    return timed([&] {
      const ElasticCase c{"sphere", surface, order, target, 20, 0.3, {}, {}};
      const ElasticResult r = elastic_modes(c);
      return score("first 10 frequencies, worst", tets(r, order),
                   worst_deviation(r.omega(), lamb_sphere(material_of(c)), 10), 0.0, goal);
    });
  };
  // Asked for: 0.6 % at 240 and 0.06 % at 1300 quadratic tets. The linear ones stand beside them:
  // 7000 of them for what 240 quadratic ones reach.
  return {row(2, 240, 6e-3), row(2, 1'300, 6e-4), row(1, 7'000, 6e-3)};
}

std::vector<ScoreRow> bar() {
  const TriMesh surface = shapes::box(Vec3(20, 1, 1), 20);
  const CpuClock clock;
  const ElasticCase c{"bar", surface, 2, 850, kBarModes, 0.3, {}, {}};
  const ElasticResult r = elastic_modes(c);
  const Eigen::Vector4d errors = bar_bending_errors(r.omega(), material_of(c));
  std::vector<ScoreRow> rows;
  // Asked for: 0.1 % of the first, 0.5 % of the fourth (Timoshenko's own error grows with it).
  const double goals[4] = {1e-3, 2e-3, 3e-3, 5e-3};
  for (int k = 0; k < 4; ++k)
    rows.push_back(
        score(fmt::format("bending frequency {}", k + 1), tets(r, 2), errors[k], 0.0, goals[k]));
  for (ScoreRow& row : rows) row.cpu_seconds = clock.seconds();
  return rows;
}

std::vector<ScoreRow> wet_sphere_rows() {
  const TriMesh surface = shapes::sphere(1.0, 6);
  std::vector<ScoreRow> rows;
  const auto add = [&](int count, bool pressure, double known, const char* reason) {
    const CpuClock clock;
    ElasticCase c{"wet sphere", surface, 2, 1'300, count, 0.3, {}, {}};
    c.loads.pressure = pressure;
    const ElasticResult r = elastic_modes(c);
    const Material m = material_of(c);
    const double x =
        wet_sphere::lowest(r.body.mesh, r.modes, r.modes.omega2.size(), m, 2.0 * m.density);
    ScoreRow row = score("lowest wet frequency, n = 2",
                         fmt::format("{} dry modes{}", r.modes.vibration_modes(),
                                     pressure ? " and static vectors" : ""),
                         x, wet_sphere::kExact, 2e-3);  // asked for
    if (known != 0.0) row = known_miss(row, known, reason);
    row.cpu_seconds = clock.seconds();
    rows.push_back(row);
  };
  const char* const slow =
      "dry modes alone converge slowly under pressure: closed form +3.1 % with one mode of each "
      "(n, "
      "m), +3.0 % with two, +0.4 % with 24; static vectors restore it";
  add(10, true, 0.0, "");
  add(10, false, 0.0309, slow);
  add(60, false, 0.0305, slow);
  add(200, false, 0.0267, slow);
  return rows;
}

std::vector<ScoreRow> spinning_rod() {
  const TriMesh surface = shapes::box(Vec3(20, 1, 1), 20);
  const ElasticCase c{"bar", surface, 2, 850, 12, 0.3, {}, {}};
  const ElasticResult r = elastic_modes(c);
  std::vector<ScoreRow> rows;
  for (const double wanted : {0.1, 0.3, 1.0})
    rows.push_back(timed([&] {
      double kl = wanted;
      const double stretch = spinning_rod_stretch(r, material_of(c), kl);
      char resolution[64];
      std::snprintf(resolution, sizeof resolution, "one axial mode, kl = %.4f", kl);
      // One mode of the series carries 96 / pi^4 = 98.55 % of the first-order stretch.
      return score("tip stretch / half length", resolution, stretch, std::tan(kl) / kl - 1.0, 0.02);
    }));
  return rows;
}

// Frequency and amplitude of a sphere that rings under water. Asked for: 1.5 % at 4 cells per
// radius, 0.4 % at 8; 0.05 % of the amplitude in a period.
std::vector<ScoreRow> ringing_rows(const std::vector<int>& tets,
                                   const std::vector<RingingOptions>& options) {
  std::vector<ScoreRow> rows;
  for (const int count : tets) {
    const auto sphere = soft_sphere(count);
    for (const RingingOptions& o : options) {
      const CpuClock clock;
      const Ringing r = ring_in_water(sphere, o);
      char resolution[128];
      std::snprintf(resolution, sizeof resolution,
                    "n = %d, %d cells per radius, omega dt = %g, %s, %zu tets", o.degree,
                    o.cells_per_radius, o.step, o.open_top ? "open" : "closed",
                    sphere->tets.tets.size());
      const bool coarse = o.cells_per_radius < 8;
      ScoreRow frequency = score("ringing sphere, frequency error", resolution, r.frequency, 0.0,
                                 coarse ? 0.015 : 0.004, r.iterations),
               amplitude = score("ringing sphere, amplitude change in a period", resolution,
                                 r.amplitude, 0.0, 5e-4, r.iterations);
      frequency.cpu_seconds = clock.seconds();
      if (o.degree == 3 && !coarse && count == 3'000)
        frequency = known_miss(frequency, 0.0074,
                               "the mesh's own: 0.24 % with 16,000 tets, 0.17 % with 30,000");
      rows.push_back(frequency);
      rows.push_back(amplitude);
    }
  }
  return rows;
}

std::vector<ScoreRow> ringing_all() {
  std::vector<RingingOptions> all;
  for (const int degree : {2, 3})
    for (const bool open : {false, true})
      for (const int cells : {4, 8}) all.push_back({degree, cells, 0.1, open, 2.0});
  for (const double step : {0.02, 0.3}) all.push_back({2, 4, step, false, 2.0});
  return ringing_rows({3'000, 16'000, 30'000}, all);
}

}  // namespace

std::vector<ScoreCase> elastic_scores() {
  return {
      {"dry-sphere", true, "free elastic sphere, Poisson 0.3; Lamb's frequencies", dry_sphere},
      {"bar", true, "free square bar, L / h = 20, Poisson 0.3; Timoshenko", bar},
      {"wet-sphere", true,
       "elastic sphere in a liquid of twice its density, 1300 tets; closed form", wet_sphere_rows},
      {"ringing-sphere", true,
       "elastic sphere that rings under water as it is stepped; closed form for unbounded water",
       [] {
         return ringing_rows({3'000}, {{2, 4, 0.1, false, 2.0}, {3, 4, 0.1, false, 2.0}});
       }},
      {"ringing-sphere-all", false,
       "the same of degree 2 and 3, open and closed tanks, several meshes and steps", ringing_all},
      {"spinning-rod", true,
       "free rod spun about its middle; closed form tan(kl) / kl - 1 (centrifugal force at the "
       "deformed place)",
       spinning_rod}};
}

}  // namespace archetide
