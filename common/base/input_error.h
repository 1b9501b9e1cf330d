#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace archetide {

/// Exit codes of both executables.
enum ExitCode : int {
  kExitDone = 0,
  kExitBug = 1,
  kExitInput = 2,
  kExitNumerics = 3,
  kExitFile = 4,
  kExitMachine = 5,
  kExitStopped = 75,
};

/// Where a value came from; line and column are 1-based, 0 when unknown.
struct SourceLocation {
  std::string file;
  int line = 0;
  int column = 0;
};

/// One complaint about the user's input: where, what is wrong, what to do.
struct Diagnostic {
  SourceLocation where;
  std::string what;
  std::string hint;  // may be empty

  /// "file:line:column: error: what\n  hint" (parts that are unknown are left out)
  std::string text() const;
};

/// Base of every error that maps to an exit code.
struct Error : std::runtime_error {
  Error(ExitCode code, const std::string& message) : std::runtime_error(message), exit_code(code) {}
  ExitCode exit_code;
};

/// The user's input is wrong (exit 2). Carries all errors found, at most kMaxDiagnostics printed.
struct InputError : Error {
  static constexpr int kMaxDiagnostics = 20;
  explicit InputError(std::vector<Diagnostic> list);
  explicit InputError(const std::string& what, const std::string& hint = "");
  std::vector<Diagnostic> diagnostics;
};

/// The numbers failed: unstable, not converged (exit 3).
struct NumericsError : Error {
  explicit NumericsError(const std::string& m) : Error(kExitNumerics, m) {}
};

/// A file is missing, not ours, truncated, of another version, or its hash differs (exit 4).
struct FileError : Error {
  explicit FileError(const std::string& m) : Error(kExitFile, m) {}
};

/// The machine failed us: disk full, no memory, write failed (exit 5).
struct MachineError : Error {
  explicit MachineError(const std::string& m) : Error(kExitMachine, m) {}
};

/// The candidate closest to `word` in edit distance, or "" when none is near (did-you-mean).
std::string closest_match(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace archetide
