#pragma once

#include <string>
#include <vector>

#include "common/base/input_error.h"
#include "common/base/types.h"

namespace archetide {

/// A row of a table over time, s, and its values in the order in which they were asked for.
struct TimedRow {
  double t = 0.0;
  VecX values;
};

/// A CSV file with the column t and some of `columns`; those that it lacks are 0. Throws FileError when
/// it cannot be read, InputError at `where`: other columns, nothing but times, times that do not
/// ascend, cells that are no numbers.
std::vector<TimedRow> read_timed_rows(const std::string& path, const SourceLocation& where,
                                      const std::vector<std::string>& columns);

}  // namespace archetide
