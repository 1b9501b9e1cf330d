// The command line of archetide-sim.

#include "common/base/keep_memory.h"
#include "runtime/commands/command.h"

int main(int argc, char** argv) {
  using namespace archetide;
  keep_freed_memory();
  const Program program = {"archetide-sim",
                           "reduced deformable bodies, two-way coupled with water",
                           {"run assets/scenes/tub.scene.toml -o out/runs/tub --set time.end=2.5",
                            "render out/runs/tub --size 1280x720"},
                           ""};
  return guarded_main([&] { return run_program(program, commands(), argc, argv); });
}
