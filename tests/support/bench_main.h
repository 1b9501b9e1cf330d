#pragma once

#include <cstdio>

#include "common/base/input_error.h"

namespace archetide {

/// The exit code of work(argc, argv); an error's message goes to stderr.
template <class Work>
int bench_main(int argc, char** argv, const Work& work) {
  try {
    return work(argc, argv);
  } catch (const Error& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return e.exit_code;
  }
}

}  // namespace archetide
