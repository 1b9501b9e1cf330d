#include "runtime/output/run_tables.h"

#include <fmt/core.h>

#include <algorithm>

namespace archetide {
namespace {

// Phases without a '/' partition the step; nested ones are parts of them.
bool is_top_level(const std::string& phase) { return phase.find('/') == std::string::npos; }

double total_seconds(const Profile& profile) {
  double total = 0.0;
  for (const std::string& phase : profile.phases())
    if (is_top_level(phase)) total += profile.seconds(phase);
  return total;
}

void cells(CsvWriter& csv, const Vec3& x) {
  for (int a = 0; a < 3; ++a) csv.cell(x[a]);
}

// The columns of stats.csv but for the seconds: cell(name, value) in their order.
template <class Cell>
void for_each_cell(const StepReport& s, const Cell& cell) {
  const auto vector = [&](const std::string& name, const Vec3& v) {
    for (int a = 0; a < 3; ++a) cell(name + "xyz"[a], v[a]);
  };
  const auto impulse = [&](const std::string& name, const Vec3& P, const Vec3& L) {
    vector(name + "_p", P), vector(name + "_l", L);
  };
  const Budget& b = s.budget;
  cell("t", s.t), cell("dt", s.dt), cell("cfl", s.cfl), cell("halvings", s.halvings);
  cell("iterations", s.velocity.iterations);
  cell("iterations_position", s.position.iterations);
  cell("residual", std::max(s.position.residual, s.velocity.residual));
  cell("divergence", s.divergence);
  cell("water_volume", s.water_volume);
  vector("p", s.water_momentum + s.body_momentum + s.spray_momentum);
  vector("l", s.body_angular_momentum);
  vector("water_p", s.water_momentum);
  cell("water_kinetic", s.water_kinetic), cell("body_kinetic", s.body_kinetic);
  cell("body_elastic", s.body_elastic), cell("potential", s.potential);
  cell("energy", s.energy());
  cell("max_speed", s.max_speed), cell("contacts", s.contacts);
  cell("joint_drift", s.joint_drift), cell("max_deformation", s.max_deformation);
  cell("volume_given_back", 0.0);  // no correction is global
  cell("spray_volume", s.spray_volume), cell("outflow_volume", s.outflow_volume);
  cell("contact_sweeps", s.contact_sweeps);
  cell("max_penetration", s.max_penetration), cell("mean_penetration", s.mean_penetration);
  cell("actuation_work", s.actuation_work);
  cell("held_bodies", static_cast<int>(s.held_bodies.size()));
  cell("closed_regions", s.velocity.closed_regions);
  cell("incompatible_flow", s.velocity.incompatible_flow);
  cell("volume_residual", s.volume_residual), cell("volume_refitted", s.volume_refitted);
  vector("water_l", s.water_angular_momentum);
  impulse("transported", b.transported.P, b.transported.L);
  cell("transported_kinetic", b.transported.kinetic);
  vector("spray_p", s.spray_momentum), cell("spray_kinetic", s.spray_kinetic);
  impulse("solid", b.solids.P, b.solids.L);
  impulse("weight", b.weight.P, b.weight.L);
  impulse("contact", b.contact.P, b.contact.L);
  cell("contact_energy", b.contact_energy);
  impulse("unmatched", b.unmatched.P, b.unmatched.L);
  vector("spray_l", s.spray_angular_momentum);
  cell("drag_energy", b.drag_energy), cell("slowed_energy", b.slowed_energy);
  cell("held_energy", b.held_energy), cell("solved_energy", b.solved_energy);
  impulse("external", b.external.P, b.external.L);
  cell("source_volume", s.source_volume);
}

}  // namespace

void StatsTable::write_header(const Profile& profile) {
  for (const std::string& phase : profile.phases())
    if (is_top_level(phase)) phases_.push_back(phase);
  seconds_before_.assign(phases_.size(), 0.0);
  std::vector<std::string> names;
  for_each_cell({}, [&](const std::string& name, auto) { names.push_back(name); });
  names.push_back("seconds");
  for (const std::string& phase : phases_) names.push_back("seconds_" + phase);
  names.push_back("seconds_other");
  csv_.header(names);
}

void StatsTable::resume(std::int64_t rows) {
  const std::string prefix = "seconds_";
  for (const std::string& name : csv_.keep_rows(rows)) {
    has_header_ = true;
    if (name.starts_with(prefix) && name != "seconds_other")
      phases_.push_back(name.substr(prefix.size()));
  }
  seconds_before_.assign(phases_.size(), 0.0);
  rows_ = rows;
}

void StatsTable::add(const StepReport& s, const Profile& profile) {
  if (!has_header_) write_header(profile), has_header_ = true;
  for_each_cell(s, [&](const std::string&, auto value) { csv_.cell(value); });

  const double total = total_seconds(profile), step_seconds = total - total_before_;
  csv_.cell(step_seconds);
  double named = 0.0;
  for (std::size_t p = 0; p < phases_.size(); ++p) {
    const double now = profile.seconds(phases_[p]);
    csv_.cell(now - seconds_before_[p]);
    named += now - seconds_before_[p];
    seconds_before_[p] = now;
  }
  csv_.cell(std::max(0.0, step_seconds - named));
  csv_.end_row();
  ++rows_;
  total_before_ = total;
}

GaugesTable::GaugesTable(const std::string& path, std::vector<Gauge> gauges, bool keep)
    : gauges_(std::move(gauges)) {
  if (gauges_.empty()) return;
  csv_.emplace(path, keep);
  if (!keep) write_header();
}

void GaugesTable::write_header() {
  std::vector<std::string> names = {"t"};
  for (const Gauge& gauge : gauges_)
    for (const char* what : {"p", "vx", "vy", "vz", "level"})
      names.push_back(gauge.name + '_' + what);
  csv_->header(names);
}

void GaugesTable::resume(std::int64_t rows) {
  if (csv_ && csv_->keep_rows(rows).empty()) write_header();
}

void GaugesTable::add(const StepReport& report, const Simulation& simulation) {
  if (!csv_) return;
  const auto cell = [&](const std::optional<double>& value) {
    if (value)
      csv_->cell(*value);
    else
      csv_->empty_cell();
  };
  csv_->cell(report.t);
  for (const Gauge& gauge : gauges_) {
    const GaugeReading r = read_gauge(simulation, report.dt, gauge.point);
    cell(r.pressure);
    for (int a = 0; a < 3; ++a) cell(r.velocity ? std::optional((*r.velocity)[a]) : std::nullopt);
    cell(r.level);
  }
  csv_->end_row();
}

void GaugesTable::flush() {
  if (csv_) csv_->flush();
}

BodiesTable::BodiesTable(const std::string& path, const std::vector<ReducedBody>& bodies, bool keep)
    : csv_(path, keep) {
  for (const ReducedBody& body : bodies) modes_ = std::max(modes_, reduced_dofs(body) - 6);
  if (!keep) write_header();
}

void BodiesTable::write_header() {
  std::vector<std::string> names = {"t",  "body", "x",  "y",  "z",  "qw", "qx", "qy", "qz",
                                    "vx", "vy",   "vz", "wx", "wy", "wz", "px", "py", "pz",
                                    "lx", "ly",   "lz", "fx", "fy", "fz", "tx", "ty", "tz"};
  for (int m = 1; m <= modes_; ++m) names.push_back(fmt::format("q{}", m));
  csv_.header(names);
}

void BodiesTable::resume(std::int64_t rows) {
  if (csv_.keep_rows(rows).empty()) write_header();
  rows_ = rows;
}

void BodiesTable::add(double time, int body_index, const ReducedBody& body, const Vec3& impulse,
                      const Vec3& angular_impulse) {
  const ConfigurationTerms terms = configuration_terms(
      body, Configuration{body.rotation, body.q, body.q_dot}, ModalMass::kExact);
  csv_.cell(time).cell(body_index);
  cells(csv_, body.position);
  csv_.cell(body.rotation.w()).cell(body.rotation.x()).cell(body.rotation.y());
  csv_.cell(body.rotation.z());
  cells(csv_, body.P / terms.mass);
  cells(csv_, frame_spin(terms, body.L, body.q_dot));
  cells(csv_, body.P);
  cells(csv_, body.L);
  cells(csv_, impulse);
  cells(csv_, angular_impulse);
  const VecX q = reduced_amplitudes(body);
  for (int m = 0; m < modes_; ++m)
    if (m < q.size())
      csv_.cell(q[m]);
    else
      csv_.empty_cell();
  csv_.end_row();
  ++rows_;
}

}  // namespace archetide
