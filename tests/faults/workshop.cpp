#include "tests/faults/workshop.h"

#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <sstream>
#include <stdexcept>

namespace archetide {
namespace {

namespace fs = std::filesystem;

constexpr char kScene[] = R"(schema = 1
time = { end = 0.6, fps = 20 }
step = { max = 0.02 }
[fluid]
grid = [12, 12, 16]
cell = "1/12"
water = { level = 0.5 }
walls = { zmax = "open" }
particles = { per_cell = 4 }
[contact]
restitution = 0.1
friction = 0.4
[[body]]
archetype = "ball.h5"
position = [0.35, 0.5, 0.75]
modes = 3
[[body]]
archetype = "ball.h5"
position = [0.65, 0.5, 0.8]
modes = 3
[output]
frames = ["surface.ply", "bodies.vtp"]
checkpoint = { every_frames = 1, keep = 2 }
)";

constexpr char kBody[] = R"(schema = 1
mesh = "ball.obj"
tet = { mesher = "cgal", target = 200 }
material = { density = 500.0, young = 5e4, poisson = 0.4 }
modes = { count = 3 }
)";

// A ball of 0.12 m: rings of eight around the z axis.
std::string ball_obj() {
  constexpr int kRings = 5, kAround = 8;
  std::ostringstream text;
  text << "v 0 0 -0.12\n";
  for (int ring = 1; ring <= kRings; ++ring)
    for (int n = 0; n < kAround; ++n) {
      const double up = M_PI * ring / (kRings + 1), turn = 2 * M_PI * n / kAround;
      text << "v " << 0.12 * std::sin(up) * std::cos(turn) << ' '
           << 0.12 * std::sin(up) * std::sin(turn) << ' ' << -0.12 * std::cos(up) << '\n';
    }
  text << "v 0 0 0.12\n";
  const auto at = [](int ring, int n) { return 2 + ring * kAround + n % kAround; };
  for (int n = 0; n < kAround; ++n) {
    text << "f 1 " << at(0, n + 1) << ' ' << at(0, n) << '\n';
    for (int ring = 0; ring + 1 < kRings; ++ring)
      text << "f " << at(ring, n) << ' ' << at(ring, n + 1) << ' ' << at(ring + 1, n + 1) << ' '
           << at(ring + 1, n) << '\n';
    text << "f " << 2 + kRings * kAround << ' ' << at(kRings - 1, n) << ' ' << at(kRings - 1, n + 1)
         << '\n';
  }
  return text.str();
}

// A table without the columns that hold wall seconds.
std::string without_seconds(const std::string& table) {
  std::istringstream lines(table);
  std::ostringstream out;
  std::vector<bool> keep;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    std::size_t n = 0;
    const bool head = keep.empty();
    for (std::string cell; std::getline(cells, cell, ','); ++n) {
      if (head) keep.push_back(!cell.starts_with("seconds"));
      if (n < keep.size() && keep[n]) out << cell << ',';
    }
    out << '\n';
  }
  return out.str();
}

// What a run has made, by name, without what holds times of the day.
std::map<std::string, std::string> files_of(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const std::string name = fs::relative(entry.path(), folder).string();
    if (name == "manifest.json" || name == "run.log" || name == "done.stamp" || name == "lock" ||
        name.starts_with("."))
      continue;
    const std::string bytes = bytes_of(entry.path().string());
    files[name] = name == "stats.csv" ? without_seconds(bytes) : bytes;
  }
  return files;
}

void demand_done(const Ending& end, const std::string& what) {
  if (end.code != 0)
    throw std::runtime_error(fmt::format("{} ended with {}:\n{}", what, end.code, end.text));
}

}  // namespace

Workshop::Workshop(std::string bin, std::string folder, unsigned seed)
    : sim_(fs::absolute(bin) / "archetide-sim"),
      precompute_(fs::absolute(bin) / "archetide-precompute"),
      folder_(fs::absolute(folder)),
      random_(seed) {
  fs::remove_all(folder_);
  fs::create_directories(folder_);
  write_bytes(*this / "ball.obj", ball_obj());
  write_bytes(*this / "ball.body.toml", kBody);
  write_bytes(*this / "tank.scene.toml", kScene);
  const Ending built = archetide::run(build_into("ball.h5"));
  demand_done(built, "the build");
  archetype_ = bytes_of(*this / "ball.h5");
  const Ending ran = archetide::run(run_into("whole"));
  demand_done(ran, "the run");
  run_files_ = files_of(*this / "whole");
  run_seconds_ = ran.seconds, build_seconds_ = built.seconds;
}

Command Workshop::run_into(const std::string& out, const std::vector<std::string>& more) const {
  Command c{
      {sim_, "run", "tank.scene.toml", "-q", "-t", "1", "-o", out, "--resume", "auto", "--replace"},
      folder_,
      {"OMP_WAIT_POLICY=passive"}};
  c.words.insert(c.words.end(), more.begin(), more.end());
  return c;
}

Command Workshop::build_into(const std::string& out) const {
  return {{precompute_, "build", "ball.body.toml", "-q", "-t", "1", "-o", out}, folder_};
}

std::string Workshop::difference(const std::string& out) const {
  if (!fs::exists(*this / out + "/done.stamp")) return out + ": no done.stamp";
  const auto found = files_of(*this / out);
  for (const auto& [name, bytes] : run_files_) {
    const auto other = found.find(name);
    if (other == found.end()) return out + ": " + name + " is missing";
    if (other->second != bytes) return out + ": " + name + " differs";
  }
  for (const auto& [name, bytes] : found)
    if (!run_files_.contains(name)) return out + ": " + name + " is left over";
  return "";
}

std::string Workshop::build_difference(const std::string& out) const {
  return bytes_of(*this / out) == archetype_ ? "" : out + " differs";
}

double Workshop::uniform(double low, double high) {
  return low + (high - low) * (random_() / 4294967296.0);
}

}  // namespace archetide
