#include "runtime/scene/expectations.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace archetide {
namespace {

enum class Bound { kAtLeast, kAtMost };

// One judged line, when the scene asks for it. Written so that NaN fails.
void judge(const std::string& key, double value, Bound bound, std::optional<double> limit,
           std::vector<ExpectationResult>& out) {
  if (!limit) return;
  const bool pass = bound == Bound::kAtMost ? value <= *limit : value >= *limit;
  std::ostringstream text;
  text << (pass ? "PASS " : "FAIL ") << key << ": " << value
       << (bound == Bound::kAtMost ? ", at most " : ", at least ") << *limit;
  out.push_back({pass, text.str()});
}

// Height of the lowest point of the surface, m.
double lowest_point(const ReducedBody& body) {
  std::vector<Vec3> points;
  surface_points(body, points);
  double lowest = body.position[2];
  for (const Vec3& x : points) lowest = std::min(lowest, x[2]);
  return lowest;
}

}  // namespace

double calm_level(const SimulationOptions& options, double water_volume,
                  const std::vector<ReducedBody>& bodies) {
  const Grid& g = options.grid;
  double submerged = 0.0;  // m^3
  for (const ReducedBody& body : bodies) {
    submerged += std::min(body_mass(body) / options.water_density, body.archetype->volume);
  }
  return g.low()[2] + (water_volume + submerged) / (g.nx * g.ny * g.dx * g.dx);
}

double VolumeDrift::observe(const StepReport& report) {
  if (first_ < 0.0) first_ = std::max(report.accounted_volume(), 0.0);
  return report.volume_drift(first_);
}

Expectations::Expectations(ExpectSpec spec, double end_time)
    : spec_(std::move(spec)), end_time_(end_time), means_(spec_.bodies.size()) {}

void Expectations::observe(const StepReport& report, const Simulation& simulation) {
  const std::vector<ReducedBody>& bodies = simulation.bodies();
  worst_drift_ = std::max(worst_drift_, std::abs(drift_.observe(report)));
  largest_deformation_ = std::max(largest_deformation_, report.max_deformation);
  most_iterations_ =
      std::max({most_iterations_, report.position.iterations, report.velocity.iterations});
  for (std::size_t n = 0; n < means_.size(); ++n) {
    const BodyExpectation& wanted = spec_.bodies[n];
    if (report.t <= end_time_ * (1.0 - wanted.window)) continue;
    if (wanted.body >= static_cast<int>(bodies.size())) continue;  // has not appeared yet
    const ReducedBody& body = bodies[wanted.body];
    const double mass = body.archetype->integrals.mass * body.mass_scale;
    means_[n].seconds += report.dt;
    means_[n].z += report.dt * body.position[2];
    means_[n].speed += report.dt * body.P.norm() / mass;
    means_[n].size = std::cbrt(body.archetype->volume);
    if (!wanted.draft || simulation.options().grid.cells() == 0) continue;
    const double level = calm_level(simulation.options(), report.water_volume, bodies);
    means_[n].draft += report.dt * (level - lowest_point(body));
  }
}

std::vector<ClosedForm> Expectations::closed_forms() const {
  std::vector<ClosedForm> out;
  for (std::size_t n = 0; n < means_.size(); ++n) {
    const BodyExpectation& wanted = spec_.bodies[n];
    const BodyMeans& mean = means_[n];
    if (mean.seconds <= 0.0) continue;
    const std::string key = fmt::format("expect.body[{}].", n);
    if (wanted.z) out.push_back({key + "z", mean.z / mean.seconds, *wanted.z, mean.size});
    if (wanted.draft)
      out.push_back({key + "draft", mean.draft / mean.seconds, *wanted.draft, mean.size});
  }
  return out;
}

void Expectations::visit_state(StateArchive& a) {
  drift_.visit_state(a, "expect/drift");
  a.field("expect/worst_drift", worst_drift_);
  a.field("expect/largest_deformation", largest_deformation_);
  a.field("expect/most_iterations", most_iterations_);
  std::vector<Vec3> means;  // seconds, z, speed
  for (const BodyMeans& m : means_) means.emplace_back(m.seconds, m.z, m.speed);
  a.field("expect/means", means);
  std::vector<Vec3> drafts;  // draft, size
  for (const BodyMeans& m : means_) drafts.emplace_back(m.draft, m.size, 0.0);
  a.field("expect/drafts", drafts);
  if (means.size() != means_.size() || drafts.size() != means_.size())
    a.fail("field expect/means is of another [expect]");
  for (std::size_t n = 0; n < means.size(); ++n)
    means_[n] = {means[n][0], means[n][1], means[n][2], drafts[n][0], drafts[n][1]};
}

std::vector<ExpectationResult> Expectations::evaluate() const {
  std::vector<ExpectationResult> out;
  judge("expect.volume_drift", worst_drift_, Bound::kAtMost, spec_.volume_drift, out);
  judge("expect.iterations", most_iterations_, Bound::kAtMost, spec_.iterations, out);
  judge("expect.deformation_min", largest_deformation_, Bound::kAtLeast, spec_.deformation_min,
        out);
  judge("expect.deformation_max", largest_deformation_, Bound::kAtMost, spec_.deformation_max, out);
  for (std::size_t n = 0; n < means_.size(); ++n) {
    const BodyExpectation& wanted = spec_.bodies[n];
    const std::string key = fmt::format("expect.body[{}] (body {})", n, wanted.body);
    const double z = means_[n].z / means_[n].seconds;
    const double speed = means_[n].speed / means_[n].seconds;
    judge(key + " mean z", z, Bound::kAtLeast, wanted.z_min, out);
    judge(key + " mean z", z, Bound::kAtMost, wanted.z_max, out);
    judge(key + " mean speed", speed, Bound::kAtLeast, wanted.speed_min, out);
    judge(key + " mean speed", speed, Bound::kAtMost, wanted.speed_max, out);
    const auto off = [&](const std::string& name, double value, std::optional<double> exact) {
      if (exact) judge(key + name, std::abs(value - *exact), Bound::kAtMost, wanted.margin, out);
    };
    off(" mean z off its closed form", z, wanted.z);
    off(" draft off its closed form", means_[n].draft / means_[n].seconds, wanted.draft);
  }
  return out;
}

}  // namespace archetide
