#include "runtime/output/csv.h"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/base/number_text.h"
#include "common/files/text_csv.h"

namespace archetide {

CsvWriter::CsvWriter(std::string path, bool keep)
    : path_(std::move(path)),
      file_(path_, std::ios::binary | (keep ? std::ios::app : std::ios::trunc)) {
  if (!file_) throw MachineError(path_ + ": cannot be written");
}

std::vector<std::string> CsvWriter::keep_rows(std::int64_t rows) {
  const std::string bytes = read_whole_file(path_);
  if (bytes.empty() && rows == 0) return {};
  std::size_t end = 0;
  for (std::int64_t line = 0; line <= rows; ++line) {
    end = bytes.find('\n', end);
    if (end == std::string::npos)
      throw FileError(
          fmt::format("{}: has fewer rows than its checkpoint tells ({}); "
                      "start again with --resume never --replace",
                      path_, rows));
    ++end;
  }
  file_.close();
  std::filesystem::resize_file(path_, end);
  file_.open(path_, std::ios::binary | std::ios::app);
  if (!file_) throw MachineError(path_ + ": cannot be written");
  return parse_text_csv(bytes.substr(0, bytes.find('\n')), path_).names;
}

void CsvWriter::header(const std::vector<std::string>& names) {
  for (const std::string& name : names) separate(), rows_ += name;
  end_row();
}

void CsvWriter::separate() {
  if (row_started_) rows_ += ',';
  row_started_ = true;
}

CsvWriter& CsvWriter::cell(double value) {
  separate();
  rows_ += number_text(value);
  return *this;
}

CsvWriter& CsvWriter::cell(int value) {
  separate();
  rows_ += std::to_string(value);
  return *this;
}

CsvWriter& CsvWriter::empty_cell() {
  separate();
  return *this;
}

void CsvWriter::end_row() {
  rows_ += '\n';
  row_started_ = false;
}

void CsvWriter::flush() {
  file_ << rows_ << std::flush;
  rows_.clear();
  if (!file_) throw MachineError(path_ + ": write failed, is the disk full?");
}

bool CsvTable::has(const std::string& name) const {
  return std::find(names.begin(), names.end(), name) != names.end();
}

const std::vector<double>& CsvTable::column(const std::string& name) const {
  static const std::vector<double> none;
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? none : columns[at - names.begin()];
}

CsvTable read_csv(const std::string& path) {
  std::string bytes = read_whole_file(path);
  bytes.resize(bytes.rfind('\n') + 1);
  const TextTable text = parse_text_csv(bytes, path);
  CsvTable table;
  table.names = text.names;
  table.columns.resize(table.names.size());
  for (const std::vector<std::string>& row : text.rows)
    for (std::size_t c = 0; c < row.size(); ++c) table.columns[c].push_back(cell_number(row[c]));
  return table;
}

}  // namespace archetide
