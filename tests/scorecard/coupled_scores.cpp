#include <cstdio>

#include "tests/scorecard/reference_data.h"
#include "tests/scorecard/score.h"
#include "tests/support/float_cases.h"
#include "tests/support/float_draft.h"

namespace archetide {
namespace {

ScoreRow draft_row(int cells, double ratio) {
  return timed([&] {
    const FloatResult r = floating_sphere(cells, ratio, 6.0);
    char quantity[64];
    std::snprintf(quantity, sizeof quantity, "draft error / radius, ratio %g", ratio);
    // Asked for: 1 % of the radius at 8 cells; twice that at 4.
    ScoreRow row = score(quantity, std::to_string(cells) + " cells per radius", r.draft,
                         exact_draft(ratio), cells < 8 ? 0.02 : 0.01, r.iterations);
    row.error = r.draft - row.reference;  // in radii
    return row;
  });
}

std::vector<ScoreRow> drafts(const std::vector<int>& resolutions,
                             const std::vector<double>& ratios) {
  std::vector<ScoreRow> rows;
  for (const double ratio : ratios)
    for (const int cells : resolutions) rows.push_back(draft_row(cells, ratio));
  fill_orders(rows);
  return rows;
}

std::vector<ScoreRow> momentum() {
  std::vector<ScoreRow> rows;
  for (const int cells : {4, 8})
    rows.push_back(timed([&] {
      const TankMomentum m = closed_tank_momentum(cells);
      // The solver's tolerance, 1e-8, of the momentum that is there.
      return score("|P_water + rho V v| / rho V |v|", std::to_string(cells) + " cells per radius",
                   m.worst, 0.0, 3e-8, m.iterations);
    }));
  fill_orders(rows);
  return rows;
}

std::vector<ScoreRow> stiff() {
  std::vector<ScoreRow> rows;
  for (const double omega : {1e3, 1e5, 1e7})
    rows.push_back(timed([&] {
      // M_hat = M + dt^2/4 K: the modes take part with 4 / (omega dt)^2 of their mass, and the
      // water that they move weighs some ten times that (half the density, large quadratic
      // fields).
      const double x = 0.01 * omega;
      return score("velocity off the rigid body", at_first_frequency(omega),
                   velocity_off_rigid(omega), 0.0, std::max(40.0 / (x * x), 1e-11));
    }));
  fill_orders(rows, 100.0);
  return rows;
}

std::vector<ScoreRow> box_impact() {
  const std::vector<double> exact = reference_rows("kleefsman_heights.csv")[0];
  const CpuClock clock;
  const BoxImpact b = dam_break_on_box(140);
  const std::string cells = "140 x 43 x 43";
  // The experiment's gate takes about 0.02 s of 0.4 s; levels are read to a cell of 23 mm.
  std::vector<ScoreRow> rows = {
      score("front passes x = 0.992 m, s", cells, b.passes, exact[0], 0.06, b.iterations),
      score("height at 2.638 m, 0.4 s, m", cells, b.h4_04, exact[3], 0.05, b.iterations),
      score("height at 2.638 m, 0.5 s, m", cells, b.h4_05, exact[4], 0.05, b.iterations),
      score("height at 0.992 m, 0.5 s, m", cells, b.h2_05, exact[1], 0.25, b.iterations)};
  for (ScoreRow& row : rows) row.cpu_seconds = clock.seconds();
  return rows;
}

}  // namespace

std::vector<ScoreCase> coupled_scores() {
  return {{"drafts", true, "floating sphere, mean of the last third of 6 s; Archimedes",
           [] { return drafts({4}, {0.5}); }},
          {"drafts-fine", false, "the same at three density ratios",
           [] {
             return drafts({4, 8}, {0.3, 0.5, 0.8});
           }},
          {"closed-tank-momentum", true,
           "sphere thrown through a full, closed, weightless tank; the volume's centre stays",
           momentum},
          {"stiff-to-rigid-wet", true,
           "blob of modes of rising stiffness let go under water; the rigid one", stiff},
          {"kleefsman", false, "dam break against a box; experiment [Kleefsman et al. 2005]",
           box_impact}};
}

}  // namespace archetide
