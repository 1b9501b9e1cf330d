// Clocks, languages, threads and names.

#include <fmt/core.h>

#include <cstdlib>
#include <filesystem>

#include "common/base/input_error.h"
#include "tests/faults/workshop.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

std::string run_and_compare(Workshop& w, Command c, const std::string& out) {
  fs::remove_all(w / out);
  const Ending end = run(c);
  if (end.code != 0) return fmt::format("exit {}: {}", end.code, end.text);
  return w.difference(out);
}

std::string run_preloaded(Workshop& w, const std::vector<std::string>& environment) {
  Command c = w.run_into("r");
  c.environment.push_back("LD_PRELOAD=" ARCHETIDE_STRANGE_SYSTEM);
  for (const std::string& entry : environment) c.environment.push_back(entry);
  if (const std::string wrong = run_and_compare(w, c, "r"); !wrong.empty()) return wrong;
  Command build = w.build_into("strange.h5");
  build.environment = c.environment;
  const Ending end = run(build);
  if (end.code != 0) return fmt::format("build: exit {}: {}", end.code, end.text);
  return w.build_difference("strange.h5");
}

std::string clock_jumps(Workshop& w, double, std::string& figures) {
  figures = "jumps of up to a day, forward and back";
  return run_preloaded(w, {"ARCHETIDE_STRANGE_CLOCK=1"});
}

std::string decimal_comma(Workshop& w, double, std::string& figures) {
  const std::string locale = w / "locale/de_DE.UTF-8";
  fs::create_directories(w / "locale");
  const std::string make = "localedef -i de_DE -f UTF-8 '" + locale + "' >/dev/null 2>&1";
  if (std::system(make.c_str()) != 0)
    return figures = "skipped: no source of the locale de_DE (Debian: locales)", "";
  figures = "de_DE, set before main()";
  return run_preloaded(
      w, {"ARCHETIDE_STRANGE_LOCALE=1", "LC_ALL=de_DE.UTF-8", "LOCPATH=" + (w / "locale")});
}

std::string many_threads(Workshop& w, double share, std::string& figures) {
  for (const int threads : {1, 2, 3, 4, 7, 8, 16, 32, 64}) {
    if (share < 1.0 && threads != 3 && threads != 64) continue;
    Command c = w.run_into("r");
    c.words.insert(c.words.end(), {"-t", std::to_string(threads)});
    c.words.erase(c.words.begin() + 4, c.words.begin() + 6);  // the other -t
    c.seconds = 300.0;
    if (const std::string wrong = run_and_compare(w, c, "r"); !wrong.empty())
      return fmt::format("{} threads: {}", threads, wrong);
    figures += fmt::format("{} ", threads);
  }
  return "";
}

// Folders and scenes with every byte that a name can have.
std::string every_byte(Workshop& w, double share, std::string& figures) {
  int names = 0;
  const int step = share < 1.0 ? 16 : 1;
  for (int byte = 1; byte < 256; byte += step) {
    if (byte == '/') continue;
    const std::string letter(1, static_cast<char>(byte)), scene = "s" + letter + ".scene.toml",
                                                          out = "r" + letter;
    fs::copy_file(w / "tank.scene.toml", w / scene, fs::copy_options::overwrite_existing);
    Command c = w.run_into(out, {"--until", "0.02"});
    c.words[2] = scene;
    const Ending end = run(c);
    if (end.code != kExitStopped)
      return fmt::format("byte {}: exit {}: {}", byte, end.code, end.text);
    if (!fs::exists(w / out + "/checkpoint/LATEST"))
      return fmt::format("byte {}: no checkpoint", byte);
    fs::remove_all(w / out), fs::remove(w / scene);
    ++names;
  }
  figures = fmt::format("{} names", names);
  return "";
}

}  // namespace

const std::vector<Row>& environment_rows() {
  static const std::vector<Row> rows = {
      {"clock", "a clock that jumps: bit-equal", clock_jumps},
      {"locale", "decimal comma: bit-equal", decimal_comma},
      {"threads", "1 to 64 threads: bit-equal", many_threads},
      {"names", "scenes and run folders with every byte in their name", every_byte}};
  return rows;
}

}  // namespace archetide
