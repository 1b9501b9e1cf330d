// Writes the tets and modes of an archetype for ParaView.

#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include "common/archetype/archetype.h"
#include "common/archetype/skin.h"
#include "common/files/atomic_file.h"
#include "precompute/commands/command.h"
#include "precompute/inspect/inspect.h"

namespace archetide {
namespace {

int export_tets(const BodyArguments& a) {
  make_folder_of(a.output);
  if (is_skin_file(a.input))
    throw InputError(a.input + " is a skin: it has no tets and no modes",
                     "export the archetypes of its parts");
  const Archetype archetype = read_archetype(a.input);
  if (!a.output.ends_with(".hdf")) {
    const double amplitude = a.amplitude >= 0 ? a.amplitude : 0.1 * longest_side(archetype);
    write_vtu(a.output, archetype, a.mode, amplitude);
  } else if (a.mode == 0) {
    write_vtkhdf(a.output, archetype);
  } else {
    throw InputError("--mode with a .hdf, which holds the rest shape and all modes",
                     "leave --mode out, and warp by the vector mode_K in ParaView");
  }
  log_info(fmt::format("{}: {} tets", a.output, archetype.tets.tets.size()));
  return kExitDone;
}

}  // namespace

BodyCommand export_command() {
  return {
      "export",
      "Write the tets of an archetype for ParaView",
      {"export out/archetypes/torus.h5 -o torus.hdf",
       "export out/archetypes/torus.h5 --mode 1 -o torus1.vtu"},
      export_tets,
      [](CLI::App& app, BodyArguments& a) {
        app.add_option("archetype", a.input, "archetype, OUT.h5")->required()->type_name("OUT.h5");
        app.add_option("-o,--output", a.output,
                       "file to write, F.vtu, or F.hdf (VTKHDF: rest shape and all modes)")
            ->required()
            ->type_name("F");
        app.add_option("--mode", a.mode,
                       "displace by this mode, counted from 1 (0: rest shape, modes as fields)")
            ->type_name("K")
            ->capture_default_str();
        app.add_option("--amplitude", a.amplitude,
                       "largest displacement, m (default: a tenth of the longest side)")
            ->check(non_negative_number())
            ->type_name("A");
      }};
}

}  // namespace archetide
