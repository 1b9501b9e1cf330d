#include "runtime/scene/expectations.h"

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

}  // namespace

double VolumeDrift::observe(const StepReport& report) {
  if (first_ < 0.0) first_ = report.water_volume;
  return first_ > 0.0 ? report.water_volume / first_ - 1.0 : 0.0;
}

Expectations::Expectations(ExpectSpec spec, double end_time)
    : spec_(std::move(spec)), end_time_(end_time), means_(spec_.bodies.size()) {}

void Expectations::observe(const StepReport& report, const std::vector<ReducedBody>& bodies) {
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
  }
}

void Expectations::visit_state(StateArchive& a) {
  drift_.visit_state(a, "expect/drift");
  a.field("expect/worst_drift", worst_drift_);
  a.field("expect/largest_deformation", largest_deformation_);
  a.field("expect/most_iterations", most_iterations_);
  std::vector<Vec3> means;  // seconds, z, speed
  for (const BodyMeans& m : means_) means.emplace_back(m.seconds, m.z, m.speed);
  a.field("expect/means", means);
  if (means.size() != means_.size()) a.fail("field expect/means is of another [expect]");
  for (std::size_t n = 0; n < means.size(); ++n)
    means_[n] = {means[n][0], means[n][1], means[n][2]};
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
    const std::string key =
        "expect.body[" + std::to_string(n) + "] (body " + std::to_string(wanted.body) + ")";
    const double z = means_[n].z / means_[n].seconds;
    const double speed = means_[n].speed / means_[n].seconds;
    judge(key + " mean z", z, Bound::kAtLeast, wanted.z_min, out);
    judge(key + " mean z", z, Bound::kAtMost, wanted.z_max, out);
    judge(key + " mean speed", speed, Bound::kAtLeast, wanted.speed_min, out);
    judge(key + " mean speed", speed, Bound::kAtMost, wanted.speed_max, out);
  }
  return out;
}

}  // namespace archetide
