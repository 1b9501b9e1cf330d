// Prints what a run folder or an archetype holds.

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include "common/archetype/archetype_figures.h"
#include "common/archetype/archetype_json.h"
#include "common/base/number_text.h"
#include "runtime/commands/command.h"
#include "runtime/output/run_info.h"
#include "runtime/scene/archetype_library.h"

namespace archetide {
namespace {

std::string modes_text(const Archetype& a) {
  if (a.r() == 0) return "none, a rigid body";
  const std::vector<double> hz = frequencies_hz(a);
  const auto statics = std::count(a.is_static.begin(), a.is_static.end(), 1);
  const auto vibrations = a.r() - statics;
  std::string text = fmt::format("{} {}", vibrations, a.nonlinear() ? "nonlinear" : "linear");
  if (vibrations > 0)
    text += fmt::format(" from {:.4g} to {:.4g} Hz", hz.front(),
                        hz[static_cast<std::size_t>(vibrations) - 1]);
  return text + (statics > 0 ? fmt::format(", {} static responses", statics) : "");
}

template <class Items>
std::string names_text(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) names.push_back(item.name);
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

std::string archetype_text(const Archetype& a, double file_bytes) {
  std::string text;
  const auto line = [&](const std::string& name, const std::string& value) {
    text += fmt::format("{:<12}{}\n", name, value);
  };
  line("name", a.name);
  line("made by", fmt::format("{} from {}", a.generator, a.mesh_file));
  line("material", fmt::format("{:.6g} kg/m^3, Young {:.4g} Pa, Poisson {:.4g}", a.density, a.young,
                               a.poisson));
  line("volume", fmt::format("{:.6g} m^3, mass {:.6g} kg", a.volume, a.integrals.mass));
  const Vec3 inertia_about_axes = principal_moments(inertia(a));
  line("inertia", fmt::format("{:.6g}, {:.6g}, {:.6g} kg m^2 (principal)", inertia_about_axes[0],
                              inertia_about_axes[1], inertia_about_axes[2]));
  line("modes", modes_text(a));
  std::string rungs;
  for (const SurfaceRung& rung : a.ladder)
    rungs += fmt::format(", {}", rung.surface.vertices.size());
  line("surface", fmt::format("{} vertices; for coarse water{}", a.surface.vertices.size(),
                              rungs.empty() ? " the same" : rungs.substr(1)));
  line("tets", fmt::format("{}, {} as deformable = \"full\"", a.tets.tets.size(),
                           a.matrices.empty() ? "not kept to run" : "kept to run"));
  line("points", names_text(a.point_sets));
  line("frames", names_text(a.joint_frames));
  line("hash", a.content_hash);
  line("on disk", bytes_text(file_bytes));
  return text;
}

int archetype_info(const Arguments& a, const std::string& path) {
  const Archetype archetype = read_archetype(path);
  const auto bytes = std::filesystem::file_size(path);
  if (!a.json) {
    std::cout << archetype_text(archetype, static_cast<double>(bytes));
    return kExitDone;
  }
  std::cout << archetype_json(archetype, bytes);
  return kExitDone;
}

// A folder is a run, else it is a file or the name of an archetype.
int info(const Arguments& a) {
  namespace fs = std::filesystem;
  const std::string archetype =
      ArchetypeLibrary::looking_in({"out/archetypes"}, a.archetypes).path(a.directory);
  if (!fs::is_directory(a.directory) && fs::is_regular_file(archetype))
    return archetype_info(a, archetype);
  const RunFolder run = open_run_folder(a.directory);
  std::cout << (a.json ? run_info_json(run) : run_info_text(run));
  return kExitDone;
}

}  // namespace

SimCommand info_command() {
  return {"info",
          "what a run folder holds and how far it is, or what an archetype holds",
          {"info out/runs/tub", "info torus --json"},
          info,
          [](CLI::App& app, Arguments& a) {
            app.add_option("run", a.directory,
                           "run folder, or an archetype: NAME, or its file NAME.h5")
                ->required()
                ->type_name("RUN|BODY");
            app.add_flag("--json", a.json,
                         "as JSON: manifest.json and what is on disk, or what the archetype holds");
            archetypes_option(app, a);
          },
          "archetide-precompute info tells more about the making of an archetype.\n\n"};
}

}  // namespace archetide
