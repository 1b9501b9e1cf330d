#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/base/input_error.h"

namespace archetide {

/// Options that both executables share.
struct CommonOptions {
  int threads = 0;          // 0: ARCHETIDE_THREADS, or else default_threads
  int default_threads = 0;  // 0: all cores
  bool verbose = false;     // -v
  bool quiet = false;       // -q: warnings and errors only
  std::string log_file;     // a copy of the log
};

/// Why `text` is no finite number of this kind; "" when it is one.
enum class Numbers { kAny, kNonNegative, kPositive };
std::string number_message(const std::string& text, Numbers kind);

/// Checks of a number on the command line, for CLI::Option::check(): the message when it fails, or
/// "".
inline auto number_check(Numbers kind) {
  return [kind](const std::string& text) { return number_message(text, kind); };
}
inline auto positive_number() { return number_check(Numbers::kPositive); }
inline auto non_negative_number() { return number_check(Numbers::kNonNegative); }
inline auto any_number() { return number_check(Numbers::kAny); }

/// The exit codes as a paragraph for --help.
std::string exit_code_help();

/// Opens the log, checks and sets the number of threads. Throws InputError, MachineError.
void apply_common_options(const CommonOptions& options);

/// The log: lines on stderr, copied to every open log file. Data goes to stdout, never here.
enum class LogLevel { kSilent, kQuiet, kNormal, kVerbose };  // kSilent: errors only
LogLevel log_level();
void set_log_level(LogLevel level);
/// Throws MachineError when the file cannot be opened.
void open_log_file(const std::string& path);
void close_log_files();
void log_error(const std::string& line);
void log_warning(const std::string& line);  // "warning: LINE"
void log_info(const std::string& line);
void log_detail(const std::string& line);  // with -v

/// The log at another level to the end of the scope.
class ScopedLogLevel {
 public:
  explicit ScopedLogLevel(LogLevel level) : before_(log_level()) { set_log_level(level); }
  ~ScopedLogLevel() { set_log_level(before_); }
  ScopedLogLevel(const ScopedLogLevel&) = delete;
  ScopedLogLevel& operator=(const ScopedLogLevel&) = delete;

 private:
  LogLevel before_;
};

/// The error about a verb that there is not, with the nearest one and a list of all.
InputError unknown_verb(const std::string& verb, const std::vector<std::string>& verbs);
/// Throws it when the first word of the command line is no verb.
void check_verb(int argc, char** argv, const std::vector<std::string>& verbs);

/// For the message of a command-line parser: adds the nearest of `known` options or verbs for each
/// word of the command line that looks like a mistyped option.
InputError command_line_error(const std::string& message, int argc, char** argv,
                              const std::vector<std::string>& known);

/// What a failure of the file system means: 5 when a disk or this machine is at its end, 4 for what
/// is wrong with the file.
ExitCode exit_code_of(const std::filesystem::filesystem_error& error);
/// The file and what is wrong with it.
std::string file_system_message(const std::filesystem::filesystem_error& error);

/// Throws MachineError when what was printed has not arrived.
void flush_standard_output();

/// Runs the program and turns every exception into a line on the log and an exit code: Error -> its
/// code, out of memory -> 5 (`less_memory`: what would need less), the file system -> exit_code_of,
/// anything else -> 1.
int guarded_main(const std::function<int()>& program,
                 const std::string& less_memory = "use a coarser grid or fewer particles");

/// The exit code and log line of the exception being handled (call inside a catch block).
int report_current_exception(const std::string& less_memory);

}  // namespace archetide
