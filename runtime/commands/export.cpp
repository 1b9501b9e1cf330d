// Writes the bodies of a run for other programs.

#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include <map>

#include "common/base/number_text.h"
#include "common/files/atomic_file.h"
#include "runtime/commands/command.h"
#include "runtime/output/bodies_gltf.h"
#include "runtime/scene/archetype_library.h"
#include "runtime/scene/scene_builder.h"

namespace archetide {
namespace {

// The bodies of a run, at rest. Archetypes of that name may have been built anew since.
std::vector<ReducedBody> bodies_of(const RunFolder& run, ArchetypeLibrary& library) {
  std::map<std::string, std::string> hashes;
  for (const Manifest::ArchetypeEntry& a : run.manifest.archetypes) hashes[a.name] = a.hash;
  std::vector<ReducedBody> bodies;
  for (const Manifest::BodyEntry& entry : run.manifest.bodies) {
    BodySpec spec;
    spec.where.file = library.path(entry.archetype);
    spec.archetype = entry.archetype;
    const auto archetype = library.load(entry.archetype);
    if (archetype->content_hash != hashes[entry.archetype])
      throw FileError(spec.where.file +
                      ": not the archetype that the run had; build that one again, or run the "
                      "scene again");
    spec.modes = std::min(entry.modes, archetype->r());
    bodies.push_back(instantiate(spec, archetype));
  }
  return bodies;
}

int export_bodies(const Arguments& a) {
  if (!a.out.ends_with(".glb"))
    throw InputError("-o " + a.out + ": only .glb files can be written",
                     "name it film.glb, for example");
  const RunFolder run = open_run_folder(a.directory);
  ArchetypeLibrary library =
      ArchetypeLibrary::looking_in({run.path + "../../archetypes", "out/archetypes"}, a.archetypes);
  const FrameRange frames = frame_range(a);
  make_folder_of(a.out);
  const BodiesGltf made = bodies_gltf(run, bodies_of(run, library), frames.first, frames.last);
  write_file_atomically(a.out, made.bytes);
  log_info(fmt::format("{}: {} bodies of {} meshes, {} frames, {}{}", a.out, made.bodies,
                       made.meshes, made.frames, bytes_text(static_cast<double>(made.bytes.size())),
                       made.off ? fmt::format(", within {} m of the last frame's surfaces",
                                              scientific_text(*made.off))
                                : ""));
  return kExitDone;
}

}  // namespace

SimCommand export_command() {
  return {"export",
          "the bodies as an animated glTF scene, modes as morph targets",
          {"export out/runs/tub -o film.glb", "export out/runs/tub -o film.glb --frames 24:48"},
          export_bodies,
          [](CLI::App& app, Arguments& a) {
            app.add_option("run", a.directory, "run folder")->required()->type_name("RUN");
            app.add_option("-o,--output", a.out, "the scene, *.glb")->required()->type_name("FILE");
            frames_option(app, a);
            archetypes_option(app, a);
          }};
}

}  // namespace archetide
