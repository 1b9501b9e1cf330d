#include "common/base/input_error.h"

#include <fmt/core.h>

#include <algorithm>
#include <numeric>

namespace archetide {
namespace {

std::string list_text(const std::vector<Diagnostic>& list) {
  const std::size_t printed = std::min<std::size_t>(list.size(), InputError::kMaxDiagnostics);
  std::string text;
  for (std::size_t n = 0; n < printed; ++n) text += (n ? "\n" : "") + list[n].text();
  if (printed < list.size()) {
    text += fmt::format("\n(and {} more errors)", list.size() - printed);
  }
  return text;
}

// Edit distance in which swapping two neighbours counts once (optimal string alignment).
int edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<int>> d(a.size() + 1, std::vector<int>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = static_cast<int>(i);
  std::iota(d[0].begin(), d[0].end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const int replace = d[i - 1][j - 1] + (a[i - 1] != b[j - 1]);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, replace});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

}  // namespace

std::string Diagnostic::text() const {
  std::string text;
  if (!where.file.empty()) text += where.file + ":";
  if (where.line > 0) text += fmt::format("{}:", where.line);
  if (where.line > 0 && where.column > 0) text += fmt::format("{}:", where.column);
  if (!text.empty()) text += " ";
  text += "error: " + what;
  if (!hint.empty()) text += "\n  " + hint;
  return text;
}

InputError::InputError(std::vector<Diagnostic> list)
    : Error(kExitInput, list_text(list)), diagnostics(std::move(list)) {}

InputError::InputError(const std::string& what, const std::string& hint)
    : InputError(std::vector<Diagnostic>{{{}, what, hint}}) {}

std::string closest_match(const std::string& word, const std::vector<std::string>& candidates) {
  // A third of the word (at least one letter, at most three) may differ.
  int best = std::clamp(static_cast<int>(word.size() + 1) / 3, 1, 3) + 1;
  std::string match;
  for (const std::string& candidate : candidates) {
    const int distance = edit_distance(word, candidate);
    if (distance < best) best = distance, match = candidate;
  }
  return match;
}

}  // namespace archetide
