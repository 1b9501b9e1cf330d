#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

namespace archetide {

/// A growing CSV file: rows are buffered until flush(), so that readers see whole rows.
class CsvWriter {
 public:
  /// Starts an empty file, or (`keep`) leaves the one that is there until keep_rows(). Throws
  /// MachineError.
  explicit CsvWriter(std::string path, bool keep = false);
  /// Cuts the file that is there to its header and so many rows, and goes on behind them. Returns
  /// the names in its header ({} when it has none). Throws FileError when it has fewer rows.
  std::vector<std::string> keep_rows(std::int64_t rows);
  void header(const std::vector<std::string>& names);
  CsvWriter& cell(double value);  // shortest text that reads back exactly
  CsvWriter& cell(int value);
  CsvWriter& empty_cell();
  void end_row();
  void flush();  // throws MachineError when the disk is full

 private:
  void separate();

  std::string path_, rows_;
  std::ofstream file_;
  bool row_started_ = false;
};

/// A CSV file of numbers; empty cells read as NaN.
struct CsvTable {
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;  // one per name, all of the same length

  std::size_t rows() const { return columns.empty() ? 0 : columns.front().size(); }
  bool has(const std::string& name) const;
  /// The column called `name`; an empty vector when there is none.
  const std::vector<double>& column(const std::string& name) const;
};

/// A last row that is still being written is left out. Throws FileError.
CsvTable read_csv(const std::string& path);

}  // namespace archetide
