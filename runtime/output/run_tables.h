#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/profile.h"
#include "runtime/gauge.h"
#include "runtime/output/csv.h"
#include "runtime/simulation.h"

namespace archetide {

/// stats.csv: a row a step. Linear momentum p is that of water and bodies together, angular
/// momentum l that of the bodies about the origin; seconds_* are the wall seconds of the step by
/// phase (phases that first appear later add up in seconds_other).
class StatsTable {
 public:
  explicit StatsTable(const std::string& path, bool keep = false) : csv_(path, keep) {}
  /// Goes on behind so many rows of the file that is there.
  void resume(std::int64_t rows);
  std::int64_t rows() const { return rows_; }
  void add(const StepReport& report, const Profile& profile);
  void flush() { csv_.flush(); }

 private:
  void write_header(const Profile& profile);

  CsvWriter csv_;
  std::vector<std::string> phases_;
  std::vector<double> seconds_before_;  // cumulative wall seconds per phase at the last row
  double total_before_ = 0.0;           // s
  bool has_header_ = false;
  std::int64_t rows_ = 0;
};

/// gauges.csv: a row a step, of all gauges. No file without one.
class GaugesTable {
 public:
  GaugesTable(const std::string& path, std::vector<Gauge> gauges, bool keep = false);
  void resume(std::int64_t rows);
  void add(const StepReport& report, const Simulation& simulation);
  void flush();

 private:
  void write_header();

  std::vector<Gauge> gauges_;
  std::optional<CsvWriter> csv_;
};

/// bodies.csv: a row a body a frame.
class BodiesTable {
 public:
  BodiesTable(const std::string& path, const std::vector<ReducedBody>& bodies, bool keep = false);
  void resume(std::int64_t rows);
  std::int64_t rows() const { return rows_; }
  void add(double time, int body_index, const ReducedBody& body, const Vec3& impulse,
           const Vec3& angular_impulse);
  void flush() { csv_.flush(); }

 private:
  void write_header();

  CsvWriter csv_;
  int modes_ = 0;  // columns q1..qr, the most modes of any body
  std::int64_t rows_ = 0;
};

}  // namespace archetide
