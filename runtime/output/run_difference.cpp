#include "runtime/output/run_difference.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "common/base/types.h"
#include "runtime/output/csv.h"
#include "runtime/output/manifest.h"

namespace archetide {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kSameTime = 1e-7;  // s: frames of the same number differ by round-off

struct Tables {
  Manifest manifest;
  CsvTable stats, bodies;
};

Tables read_tables(const std::string& folder) {
  return {read_manifest(folder + "/manifest.json"), read_csv(folder + "/stats.csv"),
          read_csv(folder + "/bodies.csv")};
}

long time_key(double t) { return std::lround(t / kSameTime); }

// Mean of squares of what was added; NaN when nothing was.
struct Mean {
  double sum = 0.0;
  long count = 0;
  void add(double square) { sum += square, ++count; }
  double rms() const { return count > 0 ? std::sqrt(sum / count) : kNaN; }
};

// A relative measure has no meaning where the reference is zero or round-off (SI units).
double relative(double difference, double scale) {
  return scale > 1e-12 ? difference / scale : kNaN;
}

Vec3 vector_at(const CsvTable& t, const char* const names[3], std::size_t row) {
  return {t.column(names[0])[row], t.column(names[1])[row], t.column(names[2])[row]};
}

Quat rotation_at(const CsvTable& t, std::size_t row) {
  return Quat(t.column("qw")[row], t.column("qx")[row], t.column("qy")[row], t.column("qz")[row])
      .normalized();
}

// Modal displacements of a row; empty cells and columns that are not there are 0.
VecX modes_at(const CsvTable& t, std::size_t row, int count) {
  VecX q = VecX::Zero(count);
  for (int m = 0; m < count; ++m) {
    const std::vector<double>& column = t.column(fmt::format("q{}", m + 1));
    if (row < column.size() && std::isfinite(column[row])) q[m] = column[row];
  }
  return q;
}

int modes_of(const Manifest& m) {
  int most = 0;
  for (const auto& body : m.bodies) most = std::max(most, body.modes);
  return most;
}

std::string hash_of(const Manifest& m, int body) {
  for (const auto& a : m.archetypes)
    if (a.name == m.bodies[body].archetype) return a.hash;
  return "";
}

// Amplitudes mean the same only in the same basis.
bool same_bases(const Manifest& a, const Manifest& b) {
  for (std::size_t n = 0; n < std::min(a.bodies.size(), b.bodies.size()); ++n)
    if (hash_of(a, static_cast<int>(n)) != hash_of(b, static_cast<int>(n))) return false;
  return true;
}

void compare_bodies(const Tables& run, const Tables& reference, RunDifference& out) {
  static const char* const kPosition[3] = {"x", "y", "z"};
  std::map<std::pair<long, int>, std::size_t> rows;
  const auto& time = reference.bodies.column("t");
  for (std::size_t n = 0; n < time.size(); ++n)
    rows[{time_key(time[n]), static_cast<int>(reference.bodies.column("body")[n])}] = n;
  const int modes = std::max(modes_of(run.manifest), modes_of(reference.manifest));
  Mean position, rotation, modal, scale;
  const auto& run_time = run.bodies.column("t");
  for (std::size_t n = 0; n < run_time.size(); ++n) {
    const int b = static_cast<int>(run.bodies.column("body")[n]);
    const auto found = rows.find({time_key(run_time[n]), b});
    if (found == rows.end() || b >= static_cast<int>(run.manifest.bodies.size())) continue;
    const std::size_t m = found->second;
    const auto& body = run.manifest.bodies[b];
    const double size = std::cbrt(body.mass / body.density);  // m
    position.add((vector_at(run.bodies, kPosition, n) - vector_at(reference.bodies, kPosition, m))
                     .squaredNorm() /
                 (size * size));
    rotation.add(
        std::pow(rotation_at(run.bodies, n).angularDistance(rotation_at(reference.bodies, m)), 2));
    if (modes == 0) continue;
    const VecX q = modes_at(run.bodies, n, modes), q_ref = modes_at(reference.bodies, m, modes);
    modal.add((q - q_ref).squaredNorm()), scale.add(q_ref.squaredNorm());
  }
  out.position = position.rms(), out.rotation = rotation.rms();
  const bool comparable = modes > 0 && same_bases(run.manifest, reference.manifest);
  out.modal = comparable ? relative(modal.rms(), scale.rms()) : kNaN;
}

void compare_stats(const Tables& run, const Tables& reference, RunDifference& out) {
  static const char* const kLinear[3] = {"px", "py", "pz"};
  static const char* const kAngular[3] = {"lx", "ly", "lz"};
  std::map<long, std::size_t> rows;
  const auto& time = reference.stats.column("t");
  for (std::size_t n = 0; n < time.size(); ++n) rows[time_key(time[n])] = n;
  // Only times of frames: there every run has a step's end.
  const double fps = reference.manifest.fps;
  Mean p, l, volume, kinetic;
  double p_scale = 0.0, l_scale = 0.0, k_scale = 0.0;
  const auto energy = [](const CsvTable& t, std::size_t row) {
    return t.column("water_kinetic")[row] + t.column("body_kinetic")[row];
  };
  const auto& run_time = run.stats.column("t");
  for (std::size_t n = 0; n < run_time.size(); ++n) {
    const auto found = rows.find(time_key(run_time[n]));
    const double frame = run_time[n] * fps;
    if (found == rows.end() || std::abs(frame - std::round(frame)) > kSameTime * fps) continue;
    const std::size_t m = found->second;
    ++out.frames;
    const Vec3 p_ref = vector_at(reference.stats, kLinear, m),
               l_ref = vector_at(reference.stats, kAngular, m);
    p.add((vector_at(run.stats, kLinear, n) - p_ref).squaredNorm());
    l.add((vector_at(run.stats, kAngular, n) - l_ref).squaredNorm());
    const double v_ref = reference.stats.column("water_volume")[m];
    volume.add(std::pow(run.stats.column("water_volume")[n] - v_ref, 2));
    const double k_ref = energy(reference.stats, m);
    kinetic.add(std::pow(energy(run.stats, n) - k_ref, 2));
    p_scale = std::max(p_scale, p_ref.norm()), l_scale = std::max(l_scale, l_ref.norm());
    k_scale = std::max(k_scale, k_ref);
  }
  out.momentum = relative(p.rms(), p_scale);
  out.angular_momentum = relative(l.rms(), l_scale);
  const auto& volumes = reference.stats.column("water_volume");
  out.volume = relative(volume.rms(), volumes.empty() ? 0.0 : volumes.front());
  out.kinetic = relative(kinetic.rms(), k_scale);
}

}  // namespace

RunDifference run_difference(const std::string& run, const std::string& reference) {
  const Tables a = read_tables(run), b = read_tables(reference);
  RunDifference out;
  compare_stats(a, b, out);
  compare_bodies(a, b, out);
  return out;
}

}  // namespace archetide
