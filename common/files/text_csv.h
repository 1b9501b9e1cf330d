#pragma once

#include <string>
#include <vector>

namespace archetide {

/// A CSV file of words and numbers; cells with commas, quotes or line ends stand in quotes (RFC
/// 4180).
struct TextTable {
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> rows;  // each as long as names

  bool has(const std::string& name) const;
  /// The cell under `name`, "" when there is no such column.
  const std::string& at(std::size_t row, const std::string& name) const;
  /// The same as a number; NaN when it is none.
  double number(std::size_t row, const std::string& name) const;
};

/// The table of a text, of a file called `path`; without names when the text is empty. Throws
/// FileError: a row of another length than the first line.
TextTable parse_text_csv(const std::string& text, const std::string& path);
/// Throws FileError: missing, empty, or a row of another length than the first line.
TextTable read_text_csv(const std::string& path);
/// Atomic; throws MachineError.
void write_text_csv(const std::string& path, const TextTable& table);

/// A cell as a number; NaN when it is none.
double cell_number(const std::string& text);
/// The shortest text that reads back as exactly `value`; "" for NaN.
std::string cell_text(double value);

}  // namespace archetide
