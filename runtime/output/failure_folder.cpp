#include "runtime/output/failure_folder.h"

#include <fmt/core.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/files/json_text.h"
#include "runtime/output/body_surface.h"
#include "runtime/output/ply.h"
#include "runtime/output/vtp.h"
#include "runtime/output/water_surface.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// One word of a shell command.
std::string quoted(const std::string& path) {
  if (path.find_first_of(" '\"$&();") == std::string::npos) return path;
  std::string word = "'";
  for (const char c : path) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

std::string replay_command(const FailureSetup& setup, const std::string& folder, bool has_start) {
  return "archetide-sim run " + quoted(folder + "scene.toml") + " -o " + quoted(folder + "replay") +
         (has_start ? " --resume " + quoted(folder + "start.h5") : std::string(" --resume never")) +
         " --replace" + setup.options;
}

Json to_json(const SimulationFailure& failure, const FailureSetup& setup,
             const std::string& replay) {
  const auto name = [](int n, const std::vector<std::string>& names) {
    return n >= 0 ? Json(names[n]) : Json();
  };
  Json j{{"quantity", failure.quantity}, {"what", failure.what()}, {"time", failure.time}};
  const Culprit& c = failure.culprit;
  j["body"] = c.body >= 0 ? Json(c.body) : Json();
  j["body_name"] = name(c.body, setup.body_names);
  j["mode"] = c.mode >= 0 ? Json(c.mode + 1) : Json();
  j["cell"] = c.cell ? Json::array({(*c.cell)[0], (*c.cell)[1], (*c.cell)[2]}) : Json();
  if (c.joint >= 0) {
    j["joint"] = c.joint;
    j["joint_name"] = name(c.joint, setup.joint_names);
    j["other_body"] = c.other_body >= 0 ? Json(c.other_body) : Json();  // none: the world
    j["other_body_name"] = name(c.other_body, setup.body_names);
  }
  j["replay"] = replay;
  return j;
}

void write_geometry(const std::string& folder, const SimulationFailure& failure,
                    const Simulation& simulation) {
  std::vector<ReducedBody> bodies;
  for (const int b : {failure.culprit.body, failure.culprit.other_body})
    if (b >= 0 && simulation.bodies()[b].q.allFinite()) bodies.push_back(simulation.bodies()[b]);
  if (!bodies.empty()) write_vtp(folder + "body.vtp", bodies_surface(bodies), failure.time);
  const SimulationOptions& o = simulation.options();
  if (o.has_water && o.grid.cells() > 0)
    write_ply(folder + "surface.ply", water_surface(simulation.grid(), simulation.fluid().phi));
}

}  // namespace

std::string culprit_names(const Culprit& culprit, const FailureSetup& setup) {
  std::string text;
  const auto add = [&](const char* what, int n, const std::vector<std::string>& names) {
    if (n < 0) return;
    text += fmt::format("{}{} {} is {}", text.empty() ? "" : ", ", what, n, names[n]);
  };
  add("joint", culprit.joint, setup.joint_names);
  add("body", culprit.body, setup.body_names);
  add("body", culprit.other_body, setup.body_names);
  return text;
}

std::string write_failure(const FailureSetup& setup, const SimulationFailure& failure,
                          const CheckpointIdentity& identity, const Simulation& simulation,
                          const VisitState& visit) {
  const std::string folder =
      fs::absolute(setup.run_folder).lexically_normal().string() + "/failure/";
  fs::create_directories(folder);
  write_file_atomically(folder + "scene.toml", setup.scene_text);
  const auto start = latest_checkpoint(setup.run_folder);
  if (start) fs::copy_file(*start, folder + "start.h5", fs::copy_options::overwrite_existing);
  write_state(folder + "state.h5", identity, visit);
  write_geometry(folder, failure, simulation);

  const std::string names = culprit_names(failure.culprit, setup);
  const std::string replay = replay_command(setup, folder, start.has_value());
  const std::string text = std::string(failure.what()) + "\n" +
                           (names.empty() ? "" : names + "\n") + "replay: " + replay + "\n";
  write_file_atomically(folder + "diagnosis.json", json_text(to_json(failure, setup, replay)));
  write_file_atomically(folder + "diagnosis.txt", text);
  return replay;
}

}  // namespace archetide
