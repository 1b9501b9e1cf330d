#include "runtime/output/run_tables.h"

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

}  // namespace

void StatsTable::write_header(const Profile& profile) {
  for (const std::string& phase : profile.phases())
    if (is_top_level(phase)) phases_.push_back(phase);
  seconds_before_.assign(phases_.size(), 0.0);
  std::vector<std::string> names = {"t",
                                    "dt",
                                    "cfl",
                                    "halvings",
                                    "iterations",
                                    "iterations_position",
                                    "residual",
                                    "divergence",
                                    "water_volume",
                                    "px",
                                    "py",
                                    "pz",
                                    "lx",
                                    "ly",
                                    "lz",
                                    "water_px",
                                    "water_py",
                                    "water_pz",
                                    "water_kinetic",
                                    "body_kinetic",
                                    "body_elastic",
                                    "potential",
                                    "energy",
                                    "max_speed",
                                    "contacts",
                                    "joint_drift",
                                    "max_deformation",
                                    "volume_given_back",
                                    "spray_volume",
                                    "outflow_volume",
                                    "contact_sweeps",
                                    "max_penetration",
                                    "mean_penetration",
                                    "actuation_work",
                                    "held_bodies",
                                    "closed_regions",
                                    "incompatible_flow",
                                    "volume_residual",
                                    "volume_refitted",
                                    "water_lx",
                                    "water_ly",
                                    "water_lz",
                                    "transported_px",
                                    "transported_py",
                                    "transported_pz",
                                    "transported_lx",
                                    "transported_ly",
                                    "transported_lz",
                                    "transported_kinetic",
                                    "spray_px",
                                    "spray_py",
                                    "spray_pz",
                                    "spray_kinetic",
                                    "solid_px",
                                    "solid_py",
                                    "solid_pz",
                                    "solid_lx",
                                    "solid_ly",
                                    "solid_lz",
                                    "weight_px",
                                    "weight_py",
                                    "weight_pz",
                                    "weight_lx",
                                    "weight_ly",
                                    "weight_lz",
                                    "contact_px",
                                    "contact_py",
                                    "contact_pz",
                                    "contact_energy",
                                    "seconds"};
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
  csv_.cell(s.t).cell(s.dt).cell(s.cfl).cell(s.halvings);
  csv_.cell(s.velocity.iterations).cell(s.position.iterations);
  csv_.cell(std::max(s.position.residual, s.velocity.residual)).cell(s.divergence);
  csv_.cell(s.water_volume);
  cells(csv_, s.water_momentum + s.body_momentum + s.spray_momentum);
  cells(csv_, s.body_angular_momentum);
  cells(csv_, s.water_momentum);
  csv_.cell(s.water_kinetic).cell(s.body_kinetic).cell(s.body_elastic).cell(s.potential);
  csv_.cell(s.water_kinetic + s.body_kinetic + s.body_elastic + s.spray_kinetic + s.potential);
  csv_.cell(s.max_speed).cell(s.contacts);
  csv_.cell(s.joint_drift).cell(s.max_deformation);
  csv_.cell(0.0).cell(s.spray_volume).cell(s.outflow_volume);  // no correction is global
  csv_.cell(s.contact_sweeps).cell(s.max_penetration).cell(s.mean_penetration);
  csv_.cell(s.actuation_work).cell(static_cast<int>(s.held_bodies.size()));
  csv_.cell(s.velocity.closed_regions).cell(s.velocity.incompatible_flow);
  csv_.cell(s.volume_residual).cell(s.volume_refitted);
  cells(csv_, s.water_angular_momentum);
  cells(csv_, s.budget.transported.P);
  cells(csv_, s.budget.transported.L);
  csv_.cell(s.budget.transported.kinetic);
  cells(csv_, s.spray_momentum);
  csv_.cell(s.spray_kinetic);
  for (const Impulse& i : {s.budget.solids, s.budget.weight}) cells(csv_, i.P), cells(csv_, i.L);
  cells(csv_, s.budget.contact);
  csv_.cell(s.budget.contact_energy);

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

BodiesTable::BodiesTable(const std::string& path, const std::vector<ReducedBody>& bodies, bool keep)
    : csv_(path, keep) {
  for (const ReducedBody& body : bodies) modes_ = std::max(modes_, body.r);
  if (!keep) write_header();
}

void BodiesTable::write_header() {
  std::vector<std::string> names = {"t",  "body", "x",  "y",  "z",  "qw", "qx", "qy", "qz",
                                    "vx", "vy",   "vz", "wx", "wy", "wz", "px", "py", "pz",
                                    "lx", "ly",   "lz", "fx", "fy", "fz", "tx", "ty", "tz"};
  for (int m = 1; m <= modes_; ++m) names.push_back(std::string("q").append(std::to_string(m)));
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
  for (int m = 0; m < modes_; ++m)
    if (m < body.r)
      csv_.cell(body.q[m]);
    else
      csv_.empty_cell();
  csv_.end_row();
  ++rows_;
}

}  // namespace archetide
