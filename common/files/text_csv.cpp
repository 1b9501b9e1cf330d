#include "common/files/text_csv.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/base/number_text.h"
#include "common/files/atomic_file.h"

namespace archetide {
namespace {

std::string quoted(const std::string& cell) {
  if (cell.find_first_of(",\"\n\r") == std::string::npos) return cell;
  std::string text = "\"";
  for (char c : cell) text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return text + '"';
}

std::string line_of(const std::vector<std::string>& cells) {
  std::string line;
  for (std::size_t c = 0; c < cells.size(); ++c) line += (c ? "," : "") + quoted(cells[c]);
  return line + '\n';
}

// All rows of a text; a quoted cell may hold line ends.
std::vector<std::vector<std::string>> parse(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> row(1);
  bool in_quotes = false;
  for (std::size_t n = 0; n < text.size(); ++n) {
    const char c = text[n];
    if (in_quotes && c == '"' && n + 1 < text.size() && text[n + 1] == '"') {
      row.back() += '"', ++n;
    } else if (c == '"') {
      in_quotes = !in_quotes;
    } else if (c == ',' && !in_quotes) {
      row.emplace_back();
    } else if (c == '\n' && !in_quotes) {
      rows.push_back(std::move(row));
      row.assign(1, "");
    } else if (c != '\r') {
      row.back() += c;
    }
  }
  if (row.size() > 1 || !row[0].empty()) rows.push_back(std::move(row));
  return rows;
}

}  // namespace

bool TextTable::has(const std::string& name) const {
  return std::find(names.begin(), names.end(), name) != names.end();
}

const std::string& TextTable::at(std::size_t row, const std::string& name) const {
  static const std::string none;
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? none : rows[row][found - names.begin()];
}

double TextTable::number(std::size_t row, const std::string& name) const {
  return cell_number(at(row, name));
}

double cell_number(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return text.empty() || *end != '\0' ? std::numeric_limits<double>::quiet_NaN() : value;
}

TextTable parse_text_csv(const std::string& text, const std::string& path) {
  TextTable table;
  table.rows = parse(text);
  if (table.rows.empty()) return table;
  table.names = std::move(table.rows.front());
  table.rows.erase(table.rows.begin());
  for (std::size_t r = 0; r < table.rows.size(); ++r)
    if (table.rows[r].size() != table.names.size())
      throw FileError(fmt::format("{}: row {} has {} cells under {} names", path, r + 2,
                                  table.rows[r].size(), table.names.size()));
  return table;
}

TextTable read_text_csv(const std::string& path) {
  TextTable table = parse_text_csv(read_whole_file(path), path);
  if (table.names.empty()) throw FileError(path + ": the file is empty");
  return table;
}

void write_text_csv(const std::string& path, const TextTable& table) {
  std::string text = line_of(table.names);
  for (const auto& row : table.rows) text += line_of(row);
  write_file_atomically(path, text);
}

std::string cell_text(double value) { return std::isnan(value) ? "" : number_text(value); }

}  // namespace archetide
