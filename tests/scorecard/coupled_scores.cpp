#include <fmt/core.h>

#include <cstdio>
#include <map>

#include "tests/scorecard/reference_data.h"
#include "tests/scorecard/score.h"
#include "tests/support/conservation_cases.h"
#include "tests/support/float_cases.h"
#include "tests/support/float_draft.h"
#include "tests/support/ringing.h"

namespace archetide {
namespace {

ScoreRow draft_row(int cells, double ratio) {
  return timed([&] {
    const FloatResult r = floating_sphere(cells, ratio, 6.0);
    char quantity[64];
    std::snprintf(quantity, sizeof quantity, "draft error / radius, ratio %g", ratio);
    // Asked for: 1 % of the radius at 8 cells; twice that at 4.
    ScoreRow row = score(quantity, fmt::format("{} cells per radius", cells), r.draft,
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
      return score("|P_water + rho V v| / rho V |v|", fmt::format("{} cells per radius", cells),
                   m.worst, 0.0, 3e-8, m.iterations);
    }));
  fill_orders(rows);
  return rows;
}

// Released from rest in deep, unbounded water [MU70], for the sphere [Hul82]:
// -0.8671 of its first height after 3.099 sqrt(a / g), 0.6345 after 6.184.
std::vector<ScoreRow> heave(int cells, const std::vector<double>& shares, double target) {
  constexpr double kTime[2] = {3.0991, 6.184}, kHeight[2] = {-0.86712, 0.6345};
  std::vector<ScoreRow> rows;
  for (const double share : shares) {
    const CpuClock clock;
    const Heave h = heaving_sphere(cells, share);
    char at[64];
    std::snprintf(at, sizeof at, "%d cells per radius, %g of the step", cells, share);
    for (int n = 0; n < 2; ++n) {
      const std::string which = n == 0 ? "first" : "second";
      rows.push_back(
          score(which + " extremum, height", at, h.height[n], kHeight[n], target, h.iterations));
      if (share == 0.25 && n == 1)
        rows.back() = known_miss(rows.back(), 0.0178,
                                 "waves of the tank: the wider it is the less, 1 % from 18 to 24 "
                                 "radii at 4 cells");
      if (share == 1.0)
        rows.back() = known_miss(rows.back(), n == 0 ? -0.0202 : -0.0257,
                                 "the longest step that the surface allows; half of it meets this");
      rows.push_back(
          score(which + " extremum, time", at, h.time[n], kTime[n], target, h.iterations));
    }
    for (std::size_t n = rows.size() - 4; n < rows.size(); ++n)
      rows[n].cpu_seconds = clock.seconds();
  }
  return rows;
}

// Nothing acts on water and body together. Asked for: momentum within 0.1 %, energy within 1 %.
std::vector<ScoreRow> conservation() {
  std::vector<ScoreRow> rows;
  const auto energy = [&](const std::string& name, const std::string& resolution,
                          const ConservationResult& r) {
    rows.push_back(score(name + ", energy left", resolution, r.energy, 1.0, 0.01, r.iterations));
    rows.push_back(score(name + ", change by transport", resolution, r.transport, 0.0, 0.01));
  };
  for (const int n : {32, 48}) {
    const std::string resolution = fmt::format("{}^3", n);
    const ConservationResult blob = drifting_blob(n);
    rows.push_back(score("blob, momentum change", resolution, blob.momentum, 0.0, 1e-3));
    rows.push_back(
        score("blob, angular momentum change", resolution, blob.angular_momentum, 0.0, 1e-3));
    energy("blob", resolution, blob);
    energy("ring bent by an eighth of its tube", resolution, ringing_ring(n, 0.01));
    energy("ring bent by 0.6 of its tube", resolution, ringing_ring(n, 0.05));
  }
  constexpr const char* kSurface =
      "velocities of faces that the surface cuts are moved on with what their cells hold, whose "
      "arms are known to a cell";
  constexpr const char* kWalls =
      "beside a wall advection reads velocities that are continued into it by slopes: walls that "
      "move within a step meet the error of what was continued";
  const std::map<std::string, double> known = {
      {"blob, angular momentum change 32^3", 1.16e-3},
      {"ring bent by 0.6 of its tube, energy left 32^3", -0.157},
      {"ring bent by 0.6 of its tube, energy left 48^3", -0.081},
      {"ring bent by 0.6 of its tube, change by transport 32^3", -0.034},
      {"ring bent by 0.6 of its tube, change by transport 48^3", 0.036}};
  for (ScoreRow& row : rows) {
    const auto miss = known.find(row.quantity + " " + row.resolution);
    if (miss != known.end())
      row = known_miss(row, miss->second, row.quantity.starts_with("blob") ? kSurface : kWalls);
  }
  return rows;
}

// Asked for: as of the sphere (ringing-sphere).
std::vector<ScoreRow> ringing_soft_cylinder() {
  std::vector<ScoreRow> rows;
  for (const int degree : {2, 3})
    for (const int cells : {4, 8}) {
      const CpuClock clock;
      const CylinderRinging r = ringing_cylinder(degree, cells);
      const std::string resolution = fmt::format("n = {}, {} cells per radius", degree, cells);
      rows.push_back(score("ringing cylinder, frequency error", resolution, r.frequency, 0.0,
                           cells < 8 ? 0.015 : 0.004, r.iterations));
      rows.back().cpu_seconds = clock.seconds();
      rows.push_back(score("ringing cylinder, amplitude change in a period", resolution,
                           r.amplitude, 0.0, 5e-4, r.iterations));
    }
  return rows;
}

std::vector<ScoreRow> stiff_wet() {
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
  const std::vector<double> exact = reference_rows("kleefsman.csv")[0];
  const CpuClock clock;
  const BoxImpact b = dam_break_on_box(140);
  const std::string cells = "140 x 43 x 43";
  // The experiment's gate takes about 0.02 s of 0.4 s; levels are read to a cell of 23 mm.
  std::vector<ScoreRow> rows = {
      score("front passes x = 0.992 m, s", cells, b.passes, exact[0], 0.06, b.iterations),
      score("height at 2.638 m, 0.4 s, m", cells, b.h4_04, exact[3], 0.05, b.iterations),
      score("height at 2.638 m, 0.5 s, m", cells, b.h4_05, exact[4], 0.05, b.iterations),
      score("height at 0.992 m, 0.5 s, m", cells, b.h2_05, exact[1], 0.25, b.iterations),
      score("box is struck at s", cells, b.struck, exact[5], 0.06, b.iterations),
      // peaks of an impact scatter from run to run of the experiment, and are as short as steps
      score("pressure on the box, peak, Pa", cells, b.p1_peak, exact[6], 0.3, b.iterations),
      score("pressure on the box, 0.5 s, Pa", cells, b.p1_05, exact[7], 0.15, b.iterations),
      score("all water, largest change in 2 s", cells, b.kept, 0.0, 1e-10, b.iterations),
      score("water in sight, largest change in 2 s", cells, b.shown, 0.0, 1e-3, b.iterations),
      score("rise of the energy, of the fall's", cells, b.energy_rise, 0.0, 0.005, b.iterations)};
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
          {"heave", true, "half-immersed sphere let go; linear theory in deep water",
           [] { return heave(4, {0.5}, 0.015); }},
          {"heave-fine", false, "the same at 8 cells per radius",
           [] {
             return heave(8, {1.0, 0.5, 0.25}, 0.015);
           }},
          {"conservation", false,
           "soft ball in a drifting ball of water; soft ring in a closed tank; no gravity, 1 s",
           conservation},
          {"ringing-cylinder", true,
           "soft cylinder that rings in the plane; closed form for unbounded water",
           ringing_soft_cylinder},
          {"closed-tank-momentum", true,
           "sphere thrown through a full, closed, weightless tank; the volume's centre stays",
           momentum},
          {"stiff-to-rigid-wet", true,
           "blob of modes of rising stiffness let go under water; the rigid one", stiff_wet},
          {"kleefsman", false, "dam break against a box; experiment [Kleefsman et al. 2005]",
           box_impact}};
}

}  // namespace archetide
