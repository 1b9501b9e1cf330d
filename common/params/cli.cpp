#include "common/params/cli.h"

#include <fmt/core.h>
#include <omp.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <new>
#include <stdexcept>

#include "common/base/check.h"

namespace archetide {
namespace {

LogLevel current_level = LogLevel::kNormal;
std::vector<std::unique_ptr<std::ofstream>> log_files;

void write_line(const std::string& line, bool to_stderr) {
  if (to_stderr) std::cerr << line << std::endl;
  for (const auto& file : log_files) *file << line << std::endl;
}

int threads_from_environment() {
  const char* text = std::getenv("ARCHETIDE_THREADS");
  if (!text || !*text) return 0;
  char* end = nullptr;
  const long threads = std::strtol(text, &end, 10);
  if (*end != '\0' || threads < 1 || threads > 1024) {
    throw InputError("ARCHETIDE_THREADS is \"" + std::string(text) + "\"",
                     "expected a number of threads from 1 to 1024");
  }
  return static_cast<int>(threads);
}

// "error: MESSAGE", or the message alone when its first line says so already.
std::string with_error_prefix(const std::string& message) {
  const bool there = message.substr(0, message.find('\n')).find("error: ") != std::string::npos;
  return there ? message : "error: " + message;
}

int report(const std::string& message, int code) {
  log_error(message);
  return code;
}

}  // namespace

std::string number_message(const std::string& text, Numbers kind) {
  static const std::map<Numbers, std::string> kinds = {
      {Numbers::kAny, "finite number"},
      {Numbers::kNonNegative, "number of at least 0"},
      {Numbers::kPositive, "number above 0"}};
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  const bool is_number = end != text.c_str() && *end == '\0' && std::isfinite(value);
  const bool allowed =
      kind == Numbers::kAny || (kind == Numbers::kPositive ? value > 0.0 : value >= 0.0);
  return is_number && allowed ? "" : text + " is not a " + kinds.at(kind);
}

std::string exit_code_help() {
  return "Exit codes:\n"
         "  0   done\n"
         "  1   a bug of this program\n"
         "  2   your input: command line, scene, body file, mesh\n"
         "  3   the numbers: unstable, not converged, limit crossed, expectation missed, diff "
         "differs\n"
         "  4   a file is missing, not ours, truncated, of another version, or its hash does not "
         "match\n"
         "  5   the machine: disk full, memory, write failed\n"
         "  75  stopped early on purpose (SIGINT, SIGTERM, --until)\n";
}

void apply_common_options(const CommonOptions& options) {
  if (options.quiet && options.verbose) throw InputError("-q and -v exclude each other");
  if (options.threads < 0 || options.threads > 1024) {
    throw InputError(fmt::format("--threads {} is out of range", options.threads),
                     "expected 1 to 1024");
  }
  set_log_level(options.quiet     ? LogLevel::kQuiet
                : options.verbose ? LogLevel::kVerbose
                                  : LogLevel::kNormal);
  if (!options.log_file.empty()) open_log_file(options.log_file);
  int threads = options.threads > 0 ? options.threads : threads_from_environment();
  if (threads == 0) threads = options.default_threads;
  if (threads > 0) omp_set_num_threads(threads);
}

LogLevel log_level() { return current_level; }
void set_log_level(LogLevel level) { current_level = level; }

void open_log_file(const std::string& path) {
  auto file = std::make_unique<std::ofstream>(path);
  if (!*file) throw MachineError(path + ": cannot write this log file: " + std::strerror(errno));
  log_files.push_back(std::move(file));
}

void close_log_files() { log_files.clear(); }

void log_error(const std::string& line) { write_line(line, true); }
void log_warning(const std::string& line) {
  if (current_level != LogLevel::kSilent) write_line("warning: " + line, true);
}
void log_info(const std::string& line) {
  if (current_level != LogLevel::kSilent) write_line(line, current_level >= LogLevel::kNormal);
}
void log_detail(const std::string& line) {
  if (current_level == LogLevel::kVerbose) write_line(line, true);
}

InputError unknown_verb(const std::string& verb, const std::vector<std::string>& verbs) {
  const std::string match = closest_match(verb, verbs);
  std::string hint = match.empty() ? "known verbs:" : "did you mean '" + match + "'? Known verbs:";
  for (const std::string& known : verbs) hint += " " + known;
  return InputError("unknown verb '" + verb + "'", hint);
}

void check_verb(int argc, char** argv, const std::vector<std::string>& verbs) {
  if (argc < 2 || argv[1][0] == '-') return;
  if (std::find(verbs.begin(), verbs.end(), argv[1]) == verbs.end())
    throw unknown_verb(argv[1], verbs);
}

InputError command_line_error(const std::string& message, int argc, char** argv,
                              const std::vector<std::string>& known) {
  std::string hint;
  for (int n = 1; n < argc; ++n) {
    const std::string word = std::string(argv[n]).substr(0, std::string(argv[n]).find('='));
    const bool mistyped = word.starts_with("--") && word.size() > 2 &&
                          std::find(known.begin(), known.end(), word) == known.end();
    const std::string match = mistyped ? closest_match(word, known) : "";
    if (!match.empty()) hint += "did you mean '" + match + "'? ";
  }
  return InputError("command line: " + message, hint + "-h lists the options");
}

int report_current_exception(const std::string& less_memory) {
  try {
    throw;
  } catch (const Error& error) {
    return report(with_error_prefix(error.what()), error.exit_code);
  } catch (const std::bad_alloc&) {
    return report("error: out of memory; " + less_memory, kExitMachine);
  } catch (const std::length_error&) {
    return report(
        "error: more memory was asked for than there can be; check the numbers of the input",
        kExitMachine);
  } catch (const std::filesystem::filesystem_error& error) {
    return report("error: " + file_system_message(error), exit_code_of(error));
  } catch (const std::exception& error) {
    return report(std::string("bug in archetide, please report it: ") + error.what(), kExitBug);
  }
}

ExitCode exit_code_of(const std::filesystem::filesystem_error& error) {
  for (const std::errc machine :
       {std::errc::no_space_on_device, std::errc::io_error, std::errc::read_only_file_system,
        std::errc::file_too_large, std::errc::not_enough_memory, std::errc::too_many_files_open,
        std::errc::too_many_files_open_in_system})
    if (error.code() == machine) return kExitMachine;
  return kExitFile;
}

std::string file_system_message(const std::filesystem::filesystem_error& error) {
  return error.path1().string() + ": " + error.code().message() +
         "; check the name and the permissions";
}

void flush_standard_output() {
  if (!std::cout.flush()) throw MachineError("standard output cannot be written");
}

int guarded_main(const std::function<int()>& program, const std::string& less_memory) {
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond the limit of the file size fails instead
  std::signal(SIGPIPE, SIG_IGN);  // and one that nobody reads; a run goes on without its log
  try {
    const int code = program();
    flush_standard_output();
    return code;
  } catch (...) {
    return report_current_exception(less_memory);
  }
}

}  // namespace archetide
