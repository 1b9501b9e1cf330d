#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/input_error.h"
#include "precompute/base/defects.h"

namespace archetide {

/// Runs `work`; the elements that an error is about go to the PLY `path`, which the message then
/// names.
template <class Work>
auto showing_offenders(const std::string& path, Work work) {
  std::error_code ignored;
  std::filesystem::remove(path, ignored);  // of an earlier attempt
  const auto write = [&path](const Offenders& error) {
    if (error.offenders.triangles.empty()) return std::string();
    write_ply(path, error.offenders);
    return "the elements in question: " + path;
  };
  try {
    return work();
  } catch (const SurfaceDefects& error) {
    std::vector<Diagnostic> list = error.diagnostics;
    const std::string note = write(error);
    if (!note.empty()) list.back().hint += "\n  " + note;
    throw InputError(list);
  } catch (const TetDefects& error) {
    const std::string note = write(error);
    throw NumericsError(error.what() + (note.empty() ? "" : "\n  " + note));
  }
}

}  // namespace archetide
