#pragma once

#include <fstream>
#include <string>

namespace archetide {

/// The lines that a long run shows: all of them in run.log, and on stderr unless quiet. On a
/// terminal the line of a frame replaces the one before.
class Progress {
 public:
  /// Throws MachineError when the log cannot be written.
  Progress(const std::string& log_path, bool quiet, bool append = false);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void line(const std::string& text);
  void frame_line(const std::string& text);

 private:
  void end_frame_line();

  std::ofstream log_;
  bool quiet_, terminal_, open_ = false;  // open_: the cursor stands behind a frame line
};

}  // namespace archetide
