#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/scorecard/reference_data.h"
#include "tests/scorecard/score.h"
#include "tests/support/surface_cases.h"
#include "tests/support/violent_cases.h"
#include "tests/support/water_cases.h"

namespace archetide {
namespace {

std::vector<ScoreRow> still_water() {
  std::vector<ScoreRow> rows;
  for (const int particles : {0, 16})
    rows.push_back(timed([&] {
      return score("largest speed / sqrt(g h)", fmt::format("{} particles a cell", particles),
                   still_tank_speed(particles), 0.0, 1e-9);
    }));
  return rows;
}

ScoreRow vortex_row(int n, double cfl, Scheme scheme) {
  return timed([&] {
    const VortexResult r = taylor_green(n, cfl, scheme);
    char text[64];
    std::snprintf(text, sizeof text, "%d^2, CFL %g", n, cfl);
    // Asked for: 0.8 % at CFL 1 and 1 % at CFL 4.
    return score(std::string("change of kinetic energy, ") +
                     (scheme == Scheme::kNewmark ? "two solves" : "one solve"),
                 text, r.energy_change, 0.0, cfl < 2 ? 0.008 : 0.01, r.iterations);
  });
}

std::vector<ScoreRow> vortex() {
  return {vortex_row(64, 1, Scheme::kNewmark), vortex_row(64, 4, Scheme::kNewmark),
          vortex_row(64, 1, Scheme::kSingle),
          known_miss(vortex_row(64, 4, Scheme::kSingle), -0.0737,
                     "one solve a step splits at first order (plain splitting loses "
                     "55 %)")};
}

ScoreRow carried_row(int n, double cfl) {
  return timed([&] {
    const CarriedVortexResult r = carried_vortex(n, cfl, Scheme::kNewmark);
    char text[64];
    std::snprintf(text, sizeof text, "%.1f cells a core, CFL %g", 0.06 * n, cfl);
    // Asked for: second order in cell and step together, through 4 % at 160 cells.
    return score("velocity, L2", text, r.velocity_error, 0.0, 0.04 * 160.0 * 160.0 / (n * n),
                 r.iterations);
  });
}

std::vector<ScoreRow> carried(const std::vector<int>& resolutions, double cfl = 1) {
  std::vector<ScoreRow> rows;
  for (const int n : resolutions) rows.push_back(carried_row(n, cfl));
  fill_orders(rows);
  return rows;
}

std::vector<ScoreRow> carried_fine() {
  std::vector<ScoreRow> rows = carried({80, 160, 320});
  for (ScoreRow& row : carried({80, 160, 320}, 4)) rows.push_back(std::move(row));
  double least = INFINITY;
  for (const ScoreRow& row : rows)
    if (std::isfinite(row.order)) least = std::min(least, row.order);
  // Asked for: order 1.8 or more.
  rows.push_back(score("2 less the least order", "these six", 2.0 - least, 0.0, 0.2));
  return rows;
}

std::vector<ScoreRow> vortices() {
  std::vector<ScoreRow> rows;
  const VecX reference = unsteady_vortices(128, 1.0);
  for (const int n : {16, 32, 64})
    rows.push_back(timed([&] {
      // No closed form: its own solution at 128^2. The target is second order from 3 % at 16^2.
      const double error = (unsteady_vortices(n, 1.0) - reference).norm() / reference.norm();
      return score("velocity, rms of 9 probes", fmt::format("{}^2, CFL 1", n), error, 0.0,
                   0.03 * 256.0 / (n * n));
    }));
  fill_orders(rows);
  return rows;
}

std::vector<ScoreRow> slosh() {
  constexpr double kPeriod = 1.181815523;  // s, 2 pi / sqrt(g k tanh(k h))
  std::vector<ScoreRow> rows;
  for (const double dt : {0.04, 0.01}) {
    const CpuClock clock;
    const SloshResult r = sloshing(64, dt, 0);
    char text[64];
    std::snprintf(text, sizeof text, "64 cells, step %g s", dt);
    rows.push_back(score("period, s", text, r.period, kPeriod, 0.005, r.iterations));
    rows.push_back(score("decay a period", text, r.decay, 0.0, 0.03, r.iterations));
    rows[rows.size() - 2].cpu_seconds = rows.back().cpu_seconds = clock.seconds();
  }
  return rows;
}

// Largest error of the semi-axes at one of the two times.
ScoreRow drop_row(const char* quantity, int n, const DropResult& r, int time, double a, double b,
                  double target, double seconds) {
  const double error =
      std::max(std::abs(r.long_axis[time] / a - 1.0), std::abs(r.short_axis[time] / b - 1.0));
  ScoreRow row =
      score(quantity, fmt::format("{} cells per radius", n), error, 0.0, target, r.iterations);
  row.cpu_seconds = seconds;
  return row;
}

std::vector<ScoreRow> ellipse(const std::vector<int>& resolutions) {
  const double a[2] = {2.27551598, 3.678985324}, b[2] = {0.439460768, 0.271814077};
  std::vector<ScoreRow> rows;
  for (int time = 0; time < 2; ++time)
    for (const int n : resolutions) {
      const CpuClock clock;
      const DropResult r = elliptic_drop(n, 1.0, 0);
      // Asked for: 0.5 % at 32 cells; coarser ones by second order.
      rows.push_back(drop_row(time ? "semi-axes, A t = 2" : "semi-axes, A t = 1", n, r, time,
                              a[time], b[time], 0.005 * 1024.0 / (n * n), clock.seconds()));
    }
  fill_orders(rows);
  return rows;
}

std::vector<ScoreRow> spheroid(const std::vector<int>& resolutions) {
  const double axis[2][2] = {{1.544536246, 2.132540181}, {0.5810842281, 0.3423792233}};
  const double equator[2][2] = {{0.8046387577, 0.684780506}, {1.311838752, 1.70901667}};
  std::vector<ScoreRow> rows;
  for (int shape = 0; shape < 2; ++shape)
    for (const int n : resolutions) {
      const CpuClock clock;
      const DropResult r = spheroid_drop(n, 1.0, 0, shape ? -1.0 : 1.0);
      rows.push_back(drop_row(shape ? "oblate, semi-axes, A t = 1" : "prolate, semi-axes, A t = 1",
                              n, r, 1, axis[shape][1], equator[shape][1], 0.005 * 1024.0 / (n * n),
                              clock.seconds()));
    }
  fill_orders(rows);
  return rows;
}

std::vector<ScoreRow> waves() {
  std::vector<ScoreRow> rows;
  for (const bool ball : {false, true})
    rows.push_back(timed([&] {
      // 0.3 % of 0.5 m of water are 0.05 cells of level.
      return score(ball ? "volume, with a floating ball" : "volume", "32 cells a metre, 2 s",
                   steep_waves(32, 0.1, ball).volume_change, 0.0, 0.003);
    }));
  return rows;
}

std::vector<ScoreRow> zalesak() {
  std::vector<ScoreRow> rows;
  for (const int particles : {0, 32})
    rows.push_back(timed([&] {
      return score("area", fmt::format("100^2, {} particles a cell", particles),
                   zalesak_disk(particles).area_change, 0.0, 0.005);
    }));
  return rows;
}

std::vector<ScoreRow> enright() {
  return {timed([] {
    return score("volume", "100^3, 64 particles a cell", enright_volume_change(100, 64), 0.0,
                 0.025);
  })};
}

// Value of `y` at time t, linear between the steps.
double at_time(const FrontResult& r, const std::vector<double>& y, double t) {
  const auto next = std::lower_bound(r.time.begin(), r.time.end(), t) - r.time.begin();
  if (next == 0 || next == static_cast<long>(r.time.size())) return y[next ? next - 1 : 0];
  const double part = (t - r.time[next - 1]) / (r.time[next] - r.time[next - 1]);
  return y[next - 1] + part * (y[next] - y[next - 1]);
}

std::vector<ScoreRow> column() {
  constexpr double kWidth = 0.05715;  // m
  const double unit = std::sqrt(kWidth / 9.81);
  const auto front = reference_rows("martin_moyce_front.csv");    // n t sqrt(g/a), Z
  const auto height = reference_rows("martin_moyce_height.csv");  // t sqrt(g/a), H
  std::vector<ScoreRow> rows;
  for (const int n : {16, 32}) {
    const CpuClock clock;
    const FrontResult r = column_collapse(n, 3.2 * unit);
    double front_off = 0.0, height_off = 0.0;
    int fronts = 0, heights = 0;
    for (const auto& row : front) {
      const double t = row[0] / std::sqrt(2.0) * unit;
      if (t > r.time.back() || row[1] > 4.5) continue;
      front_off += at_time(r, r.front, t) / kWidth / row[1] - 1.0, ++fronts;
    }
    for (const auto& row : height) {
      if (row[0] * unit > r.time.back()) continue;
      const double off = at_time(r, r.height, row[0] * unit) / (2 * kWidth) - row[1];
      height_off += off * off, ++heights;
    }
    const std::string resolution = fmt::format("{} cells a width", n);
    // The gate takes time to go and the floor has friction: inviscid fronts are ahead. Published
    // calculations lie within 10 % of the front and 3 % of the height.
    rows.push_back(known_miss(
        score("front, mean error", resolution, front_off / fronts, 0.0, 0.1, r.iterations),
        n == 16 ? 0.1126 : 0.1270,
        "the gate of the experiment takes time to go and its floor has friction; refinement does "
        "not bring the front back"));
    // Between the readings at Z = 2.11 and Z = 4.11, where the gate is long gone.
    const auto front_at = [&](double T) {
      return at_time(r, r.front, T / std::sqrt(2.0) * unit) / kWidth;
    };
    rows.push_back(score("front, speed dZ/dT", resolution,
                         (front_at(3.33) - front_at(1.83)) / (3.33 - 1.83),
                         (4.11 - 2.11) / (3.33 - 1.83), 0.1, r.iterations));
    rows.push_back(score("height at the wall, rms / 2a", resolution,
                         std::sqrt(height_off / heights), 0.0, 0.03, r.iterations));
    for (std::size_t k = rows.size() - 3; k < rows.size(); ++k)
      rows[k].cpu_seconds = clock.seconds();
  }
  return rows;
}

// Asked for: all water to round-off, 1e-3 of it in sight at CFL 1 and 3e-3 at CFL 3, no energy out
// of nothing, and no jet above 2.4 sqrt(2 g H).
void add_violent_rows(const ViolentResult& r, const std::string& resolution, double cfl,
                      double height, double cpu_seconds, std::vector<ScoreRow>& rows) {
  const auto add = [&](const char* what, double value, double target) {
    rows.push_back(score(what, resolution, value, 0.0, target, r.iterations));
    rows.back().cpu_seconds = cpu_seconds;
    cpu_seconds = 0.0;
  };
  add("all water, largest change", r.kept, 1e-10);
  add("water in sight, largest change", r.shown, cfl < 2.0 ? 1e-3 : 3e-3);
  add("rise of the energy", r.energy_rise, 0.005);
  add("fastest water / 2.4 sqrt(2 g H)", r.speed / (2.4 * std::sqrt(2.0 * 9.81 * height)), 1.0);
}

std::vector<ScoreRow> collapses(const std::vector<int>& grids, double deep) {
  std::vector<ScoreRow> rows;
  for (const int n : grids)
    for (const double cfl : {1.0, 3.0}) {
      const CpuClock clock;
      const ViolentResult r = collapse(n, cfl, deep);
      char text[64];
      std::snprintf(text, sizeof text, "%d cells a metre, CFL %g", n, cfl);
      add_violent_rows(r, text, cfl, 1.0, clock.seconds(), rows);
      if (n == 16 && cfl < 2.0) {
        ScoreRow& in_sight = *(rows.end() - 3);
        in_sight = known_miss(in_sight, 1.7e-3,
                              "a pocket of air closes in the step of a frame; of 24 columns of 13 "
                              "to 21 cells a metre and other widths two miss, the mean is 4e-5");
      }
      if (n == 64 && cfl < 2.0)
        rows.back() = known_miss(rows.back(), 1.29,
                                 "fragments of a few cells are thrown faster than jets are");
    }
  return rows;
}

std::vector<ScoreRow> pools(int n) {
  std::vector<ScoreRow> rows;
  for (const double cfl : {1.0, 3.0}) {
    const CpuClock clock;
    const ViolentResult r = two_pools(n, cfl);
    char text[64];
    std::snprintf(text, sizeof text, "%d cells a metre, CFL %g", n, cfl);
    add_violent_rows(r, text, cfl, 1.1, clock.seconds(), rows);
    rows.push_back(score("change of the still pool", text, r.calm_level, 0.0, 1e-8, r.iterations));
  }
  return rows;
}

}  // namespace

std::vector<ScoreCase> water_scores() {
  return {
      {"still-water", true, "1000 steps of a tank at rest, 16^3; it stays at rest", still_water},
      {"taylor-green", true, "cells of a steady inviscid flow, one turnover; energy is constant",
       vortex},
      {"carried-vortex", true,
       "vortex in a stream through open sides, 2.2 turns of its core; exact",
       [] {
         return carried({40, 80});
       }},
      {"carried-vortex-fine", false, "the same on three finer grids, and in long steps",
       carried_fine},
      {"unsteady-vortices", true, "vortices that move each other, time 1; own solution at 128^2",
       vortices},
      {"sloshing", true, "first mode of a tank, L = 1 m, depth 0.5 m; linear theory", slosh},
      {"elliptic-drop", true, "circular drop in a strain, no gravity; exact nonlinear solution",
       [] { return ellipse({16}); }},
      {"elliptic-drop-fine", false, "the same up to 32 cells per radius",
       [] {
         return ellipse({16, 32});
       }},
      {"spheroidal-drops", false,
       "spheres in an axial strain, no gravity; exact nonlinear solutions",
       [] {
         return spheroid({8, 16});
       }},
      {"steep-waves", false, "breaking waves of amplitude 0.1 m, volume control off; volume stays",
       waves},
      {"zalesak", false, "slotted disk turned once; area stays", zalesak},
      {"enright", false, "sphere in the reversed deformation field [EMF02], T = 3; volume stays",
       enright},
      {"martin-moyce", true, "collapse of a column; experiment of Martin and Moyce 1952, n^2 = 2",
       column},
      {"collapse", true,
       "column of 0.6 x 1 m in a closed tank of 2 x 1.5 m, a quarter of a metre deep, 1.5 s; laws",
       [] { return collapses({16}, 0.25); }},
      {"collapse-fine", false, "the same one metre deep on finer grids",
       [] {
         return collapses({32, 64}, 1.0);
       }},
      {"two-pools", false,
       "a block of water falls into one of two pools that a wall parts, 1.5 s; laws",
       [] { return pools(32); }}};
}

}  // namespace archetide
