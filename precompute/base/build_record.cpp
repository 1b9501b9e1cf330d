#include "precompute/base/build_record.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/files/atomic_file.h"
#include "common/files/json_text.h"

namespace archetide {
namespace {

using Json = nlohmann::ordered_json;

Json pairs(const std::vector<std::pair<std::string, double>>& list) {
  Json out = Json::object();
  for (const auto& [name, value] : list) out[name] = value;
  return out;
}

std::vector<std::pair<std::string, double>> pairs(const Json& object) {
  std::vector<std::pair<std::string, double>> list;
  for (const auto& [name, value] : object.items()) list.emplace_back(name, value.get<double>());
  return list;
}

std::vector<double> numbers(const Eigen::Ref<const MatX>& m) {
  std::vector<double> list;
  for (Eigen::Index j = 0; j < m.cols(); ++j)
    for (Eigen::Index i = 0; i < m.rows(); ++i) list.push_back(m(i, j));
  return list;
}

BuildRecord parsed(const Json& in) {
  BuildRecord r;
  r.hash = in.at("hash");
  r.seconds = pairs(in.at("seconds"));
  r.memory = pairs(in.at("peak_memory_bytes"));
  r.notes = in.at("notes").get<std::vector<std::string>>();
  r.patch_error_of_modes = in.value("patch_error_of_modes", std::vector<double>());
  const Json& surface = in.at("input_surface");
  r.surface_volume = surface.at("volume");
  r.surface_area = surface.at("area");
  for (int i = 0; i < 3; ++i) r.surface_centroid[i] = surface.at("center").at(i);
  for (int i = 0; i < 9; ++i) r.surface_inertia(i) = surface.at("inertia_density_1").at(i);
  return r;
}

}  // namespace

void BuildRecord::take_seconds(const Profile& profile) {
  seconds.clear();
  for (const std::string& phase : profile.phases())
    seconds.emplace_back(phase, profile.seconds(phase));
}

std::string beside(const std::string& output, const std::string& ending) {
  return std::filesystem::path(output).replace_extension().string() + ending;
}

void write_record(const std::string& archetype_path, const BuildRecord& r) {
  Json out;
  out["hash"] = r.hash;
  out["seconds"] = pairs(r.seconds);
  out["peak_memory_bytes"] = pairs(r.memory);
  out["notes"] = r.notes;
  out["patch_error_of_modes"] = r.patch_error_of_modes;
  out["input_surface"] = {{"volume", r.surface_volume},
                          {"area", r.surface_area},
                          {"center", numbers(r.surface_centroid)},
                          {"inertia_density_1", numbers(r.surface_inertia)}};
  write_file_atomically(beside(archetype_path, ".build.json"), json_text(out));
}

std::optional<BuildRecord> read_record(const std::string& archetype_path, const std::string& hash) {
  try {
    const Json in = Json::parse(read_whole_file(beside(archetype_path, ".build.json")));
    const BuildRecord record = parsed(in);
    if (record.hash == hash) return record;
  } catch (const FileError&) {
    // Nobody demands it.
  } catch (const nlohmann::json::exception&) {
    // Not ours, or changed by hand: ignored.
  }
  return {};
}

}  // namespace archetide
