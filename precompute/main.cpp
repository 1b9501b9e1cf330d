// The command line of archetide-precompute.

#include <sys/resource.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string_view>

#include "common/base/keep_memory.h"
#include "precompute/commands/command.h"

namespace archetide {
namespace {

/// Sets a variable of the environment; false when it had this value already.
bool changes(const char* name, const char* value) {
  const char* old = std::getenv(name);
  return (!old || std::string_view(old) != value) && ::setenv(name, value, 1) == 0;
}

/// Threads cannot fail where the address space is limited. Those of OpenBLAS, started before
/// main(), map 128 MiB each, try for ever when there is no room, and are waited for at the end;
/// those that CHOLMOD asks OpenMP for (four, whatever it is told) end the program with exit code 1.
/// Only the environment keeps them away: with it the program starts again.
void start_without_threads_if_space_is_limited(char** argv) {
  rlimit space{};
  if (::getrlimit(RLIMIT_AS, &space) != 0 || space.rlim_cur == RLIM_INFINITY) return;
  const bool blas = changes("OPENBLAS_NUM_THREADS", "1"), openmp = changes("OMP_THREAD_LIMIT", "1");
  if (!blas && !openmp) return;
  std::error_code unknown;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", unknown);
  if (!unknown) ::execv(self.c_str(), argv);
}

const Program kProgram = {
    "archetide-precompute",
    "from a surface mesh and a body file to a body archetype (HDF5)",
    {"build assets/bodies/torus.body.toml -o out/archetypes/torus.h5",
     "info out/archetypes/torus.h5 --json"},
    "When stopped, an older OUT.h5 stays as it was.\n"
    "ARCHETIDE_MEMORY_LIMIT=4G refuses (exit 5) what would take more memory than that.\n"};

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  using namespace archetide;
  start_without_threads_if_space_is_limited(argv);
  keep_freed_memory();
  return guarded_main([&] { return run_program(kProgram, body_commands(), argc, argv); },
                      "ask for fewer tets (tet.target) or modes");
}
