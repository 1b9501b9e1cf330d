#include "runtime/scene/timed_rows.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "common/files/text_csv.h"

namespace archetide {

std::vector<TimedRow> read_timed_rows(const std::string& path, const SourceLocation& where,
                                      const std::vector<std::string>& columns) {
  const TextTable table = read_text_csv(path);
  const auto refuse = [&](const std::string& what) {
    throw InputError({{where, path + ": " + what,
                       fmt::format("a table begins with a line of names: t and some of {}",
                                   fmt::join(columns, ", "))}});
  };
  bool any = false;
  for (const std::string& name : table.names) {
    const bool known = std::find(columns.begin(), columns.end(), name) != columns.end();
    if (!known && name != "t") refuse("no column may be called \"" + name + "\"");
    any = any || known;
  }
  if (!table.has("t") || !any || table.rows.empty()) refuse("it has no times, or no values");
  std::vector<TimedRow> rows;
  for (std::size_t n = 0; n < table.rows.size(); ++n) {
    TimedRow row{table.number(n, "t"), VecX::Zero(static_cast<long>(columns.size()))};
    for (std::size_t c = 0; c < columns.size(); ++c)
      if (table.has(columns[c])) row.values[static_cast<long>(c)] = table.number(n, columns[c]);
    if (!std::isfinite(row.t) || !row.values.allFinite())
      refuse(fmt::format("line {} holds something that is no number", n + 2));
    if (!rows.empty() && row.t <= rows.back().t)
      refuse(fmt::format("line {}: times must ascend", n + 2));
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace archetide
