#include "runtime/output/manifest.h"

#include <sys/resource.h>

#include <chrono>
#include <ctime>
#include <nlohmann/json.hpp>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/files/atomic_file.h"
#include "common/files/json_text.h"

namespace archetide {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Vec3& x) { return Json::array({x[0], x[1], x[2]}); }

Json archetypes_json(const Manifest& m) {
  Json list = Json::array();
  for (const auto& a : m.archetypes)
    list.push_back({{"name", a.name},
                    {"hash", a.hash},
                    {"surface_vertices", a.surface_vertices},
                    {"modes", a.modes},
                    {"bytes", a.bytes}});
  return list;
}

Json bodies_json(const Manifest& m) {
  Json list = Json::array();
  for (const auto& b : m.bodies)
    list.push_back({{"name", b.name},
                    {"archetype", b.archetype},
                    {"mass", b.mass},
                    {"density", b.density},
                    {"modes", b.modes},
                    {"bytes", b.bytes}});
  return list;
}

Json closed_forms_json(const Manifest& m) {
  Json list = Json::array();
  for (const auto& c : m.closed_forms)
    list.push_back({{"key", c.key}, {"value", c.value}, {"exact", c.exact}, {"size", c.size}});
  return list;
}

Json grid_json(const Grid& g) {
  return {{"cells", {g.nx, g.ny, g.nz}}, {"cell", g.dx}, {"origin", to_json(g.origin)}};
}

Grid grid_from(const Json& j) {
  Grid g;
  g.nx = j.at("cells").at(0), g.ny = j.at("cells").at(1), g.nz = j.at("cells").at(2);
  g.dx = j.at("cell");
  for (int a = 0; a < 3; ++a) g.origin[a] = j.at("origin").at(a);
  return g;
}

Manifest manifest_from(const Json& j) {
  Manifest m;
  m.version = j.at("version"), m.build = j.at("build");
  m.scene = j.at("scene"), m.scene_hash = j.at("scene_hash");
  m.command_line = j.at("command_line"), m.threads = j.at("threads");
  m.grid = grid_from(j.at("grid")), m.has_water = j.at("water");
  m.fps = j.at("fps"), m.end_time = j.at("end_time");
  for (const Json& a : j.at("archetypes"))
    m.archetypes.push_back(
        {a.at("name"), a.at("hash"), a.at("surface_vertices"), a.at("modes"), a.at("bytes")});
  for (const Json& b : j.at("bodies"))
    m.bodies.push_back({b.at("name"), b.at("archetype"), b.at("mass"), b.at("density"),
                        b.at("modes"), b.at("bytes")});
  m.started = j.at("started"), m.finished = j.at("finished");
  m.exit = j.at("exit").is_null() ? -1 : j.at("exit").get<int>();
  m.reason = j.at("reason");
  m.frames = j.at("frames"), m.steps = j.at("steps"), m.halvings = j.at("halvings");
  m.worst_iterations = j.at("worst_iterations"), m.time = j.at("time");
  m.worst_volume_drift = j.at("worst_volume_drift");
  m.wall_seconds = j.at("wall_seconds"), m.cpu_seconds = j.at("cpu_seconds");
  m.peak_bytes = j.at("peak_bytes");
  m.phase_seconds = j.at("phase_seconds").get<std::map<std::string, double>>();
  if (j.contains("closed_forms"))
    for (const Json& c : j.at("closed_forms"))
      m.closed_forms.push_back({c.at("key"), c.at("value"), c.at("exact"), c.at("size")});
  return m;
}

}  // namespace

std::string build_description() {
  std::string text = std::string("g++ ") + __VERSION__;
#ifdef NDEBUG
  text += ", NDEBUG";
#endif
#ifdef __OPTIMIZE__
  text += ", optimised";
#else
  text += ", not optimised";
#endif
#if defined(__AVX512F__)
  text += ", AVX-512";
#elif defined(__AVX2__)
  text += ", AVX2";
#endif
  return text;
}

std::string utc_now() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

double process_cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return t.tv_sec + 1e-6 * t.tv_usec; };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double process_peak_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024.0 * usage.ru_maxrss;
}

void write_manifest(const std::string& path, const Manifest& m) {
  const Json j = {{"schema", 1},
                  {"version", m.version},
                  {"build", m.build},
                  {"scene", m.scene},
                  {"scene_hash", m.scene_hash},
                  {"command_line", m.command_line},
                  {"threads", m.threads},
                  {"grid", grid_json(m.grid)},
                  {"water", m.has_water},
                  {"fps", m.fps},
                  {"end_time", m.end_time},
                  {"archetypes", archetypes_json(m)},
                  {"bodies", bodies_json(m)},
                  {"started", m.started},
                  {"finished", m.finished},
                  {"exit", m.exit < 0 ? Json(nullptr) : Json(m.exit)},
                  {"reason", m.reason},
                  {"frames", m.frames},
                  {"steps", m.steps},
                  {"time", m.time},
                  {"halvings", m.halvings},
                  {"worst_iterations", m.worst_iterations},
                  {"worst_volume_drift", m.worst_volume_drift},
                  {"wall_seconds", m.wall_seconds},
                  {"cpu_seconds", m.cpu_seconds},
                  {"peak_bytes", m.peak_bytes},
                  {"phase_seconds", m.phase_seconds},
                  {"closed_forms", closed_forms_json(m)}};
  write_file_atomically(path, json_text(j));
}

Manifest read_manifest(const std::string& path) {
  const std::string text = read_whole_file(path);
  try {
    return manifest_from(Json::parse(text));
  } catch (const Json::exception& e) {
    throw FileError(path + ": not a manifest of this program (" + e.what() + ')');
  }
}

}  // namespace archetide
