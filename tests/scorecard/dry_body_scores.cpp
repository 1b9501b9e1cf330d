#include <cstdio>

#include "common/base/types.h"
#include "tests/scorecard/reference_data.h"
#include "tests/scorecard/score.h"
#include "tests/support/dry_cases.h"

namespace archetide {
namespace {

std::vector<ScoreRow> tumbling() {
  std::vector<ScoreRow> rows;
  for (const auto& exact : reference_rows("dzhanibekov.csv")) {
    if (exact[0] != 20.0 && exact[0] != 50.0) continue;
    for (const double dt : {0.01, 0.005})
      rows.push_back(timed([&] {
        const Vec3 spin = tumbling_spin(exact[0], static_cast<int>(std::lround(exact[0] / dt)));
        char quantity[48], resolution[32];
        std::snprintf(quantity, sizeof quantity, "spin at t = %g s, |w - w_exact|", exact[0]);
        std::snprintf(resolution, sizeof resolution, "step %g s", dt);
        // The middle axis turns over: an error grows by e^(0.577 t) until the flip at 14.9 s (a
        // phase error of dt^2 / 12 of that, 1e-5 at 0.01 s), then in proportion to the flips.
        return score(quantity, resolution, (spin - Vec3(exact[1], exact[2], exact[3])).norm(), 0.0,
                     exact[0] / 20.0 * dt * dt);
      }));
  }
  fill_orders(rows);
  return rows;
}

std::vector<ScoreRow> vibration() {
  std::vector<ScoreRow> rows;
  for (const ModalStep step : {ModalStep::kTrapezoid, ModalStep::kBackwardEuler})
    for (const double x : {0.1, 0.5}) {
      const CpuClock clock;
      const Vibration found = measured_vibration(x, step), exact = exact_vibration(x, step);
      const std::string name = step == ModalStep::kTrapezoid ? ", trapezoid" : ", backward Euler";
      char resolution[32];
      std::snprintf(resolution, sizeof resolution, "omega dt = %g", x);
      rows.push_back(score("amplitude a period" + name, resolution, found.amplitude_per_period,
                           exact.amplitude_per_period, 1e-9));
      rows.push_back(score("frequency ratio" + name, resolution, found.frequency_ratio,
                           exact.frequency_ratio, 1e-9));
      rows[rows.size() - 2].cpu_seconds = rows.back().cpu_seconds = clock.seconds();
    }
  return rows;
}

std::vector<ScoreRow> stiff() {
  std::vector<ScoreRow> rows;
  for (const double omega : {1e2, 1e4, 1e6})
    rows.push_back(timed([&] {
      // The stretch is (spin / omega)^2 of the size, the inertia changes by twice that, and so does
      // the angle of the 11 rad that the body turns in 5 s.
      const double target = 2.0 * 11.0 * std::pow(2.2 / omega, 2);
      return score("angle off the rigid body, rad", at_first_frequency(omega),
                   angle_off_rigid(omega), 0.0, std::max(target, 1e-9));
    }));
  fill_orders(rows, 100.0);
  return rows;
}

}  // namespace

std::vector<ScoreCase> dry_body_scores() {
  return {
      {"dzhanibekov", true, "rigid body about its middle axis; accurate integration", tumbling},
      {"vibration", true, "one free mode, both modal schemes; closed forms of the schemes",
       vibration},
      {"stiff-to-rigid", true, "free body of modes of rising stiffness; the rigid body", stiff}};
}

}  // namespace archetide
