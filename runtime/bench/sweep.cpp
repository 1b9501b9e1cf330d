#include "runtime/bench/sweep.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <set>

#include "common/base/input_error.h"

namespace archetide {
namespace {

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

// Splits at the commas that stand outside of brackets, braces and quotes.
std::vector<std::string> split_values(const std::string& text) {
  std::vector<std::string> values(1);
  int depth = 0;
  char quote = 0;
  for (const char c : text) {
    if (quote)
      quote = c == quote ? 0 : quote;
    else if (c == '"' || c == '\'')
      quote = c;
    else if (c == '[' || c == '{')
      ++depth;
    else if (c == ']' || c == '}')
      --depth;
    if (c == ',' && depth == 0 && !quote)
      values.emplace_back();
    else
      values.back() += c;
  }
  for (std::string& value : values) value = trimmed(value);
  return values;
}

// "[nx, ny, nz]" of the same tank in cells of `cell` m.
std::string grid_of_tank(const FluidSpec& fluid, double cell, const std::string& value) {
  std::string text = "[";
  for (int axis = 0; axis < 3; ++axis) {
    const double exact = fluid.cells[axis] * fluid.cell / cell;
    const long cells = fluid.cells[axis] == 1 ? 1 : std::lround(exact);
    if (fluid.cells[axis] > 1 && (cells < 1 || std::abs(exact - cells) > 1e-6 * exact))
      throw InputError(
          fmt::format(
              "--sweep fluid.cell: the tank is {:f} m along axis {}, which is no multiple of {} m",
              fluid.cells[axis] * fluid.cell, axis, value),
          "choose cells that divide the tank's edges, or sweep fluid.grid too");
    text += fmt::format("{}{}", axis ? ", " : "", cells);
  }
  return text + "]";
}

// Letters that a folder's name may have on every system.
std::string folder_name(const std::string& text) {
  std::string name;
  for (const char c : text)
    if (std::isalnum(static_cast<unsigned char>(c)) ||
        std::string("._=+-").find(c) != std::string::npos)
      name += c;
    else if (c != '"' && c != ' ')
      name += c == '[' || c == ']' ? "" : "_";
  return name.substr(0, 120);
}

}  // namespace

Sweep parse_sweep(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string hint = "expected key=v1,v2,..., for example fluid.cell=1/32,1/64,1/128";
  if (equals == std::string::npos || equals == 0) throw InputError("--sweep " + text, hint);
  Sweep sweep{trimmed(text.substr(0, equals)), split_values(text.substr(equals + 1))};
  std::set<std::string> seen;
  for (const std::string& value : sweep.values) {
    if (value.empty()) throw InputError("--sweep " + text + ": an empty value", hint);
    if (!seen.insert(value).second)
      throw InputError("--sweep " + text + ": " + value + " stands there twice");
  }
  return sweep;
}

SweepPoint sweep_point(const std::vector<Sweep>& sweeps, const std::vector<std::string>& values,
                       const SceneSpec& base, bool keep_grid) {
  SweepPoint point;
  point.values = values;
  for (const Sweep& sweep : sweeps) keep_grid = keep_grid || sweep.key == "fluid.grid";
  for (std::size_t s = 0; s < sweeps.size(); ++s) {
    const std::string &key = sweeps[s].key, &value = values[s];
    point.overrides.push_back(key + '=' + value);
    point.name += (s ? "__" : "") + folder_name(key + '=' + value);
    const double cell = sweep_number(value);
    if (key == "fluid.cell" && !keep_grid && base.fluid && cell > 0.0)
      point.overrides.push_back("fluid.grid=" + grid_of_tank(*base.fluid, cell, value));
  }
  return point;
}

std::vector<SweepPoint> sweep_points(const std::vector<Sweep>& sweeps, const SceneSpec& base,
                                     bool keep_grid) {
  std::vector<std::vector<std::string>> choices(1);
  for (const Sweep& sweep : sweeps) {
    std::vector<std::vector<std::string>> longer;
    for (const auto& choice : choices)
      for (const std::string& value : sweep.values) {
        longer.push_back(choice);
        longer.back().push_back(value);
      }
    choices = std::move(longer);
  }
  std::vector<SweepPoint> points;
  std::set<std::string> names;
  for (const auto& values : choices) {
    points.push_back(sweep_point(sweeps, values, base, keep_grid));
    std::string& name = points.back().name;
    while (!names.insert(name).second) name += "_";
  }
  return points;
}

double sweep_number(const std::string& value) {
  std::string text;
  for (const char c : value)
    if (c != '"' && c != '\'' && c != '_' && c != ' ') text += c;
  const bool grid = text.starts_with("[");
  if (grid) text = text.substr(1, text.find(',') - 1);
  char* end = nullptr;
  double number = std::strtod(text.c_str(), &end);
  if (end == text.c_str()) return std::numeric_limits<double>::quiet_NaN();
  if (*end == '/') {
    const char* const below = end + 1;
    number /= std::strtod(below, &end);
    if (end == below) return std::numeric_limits<double>::quiet_NaN();
  }
  if (*end != '\0' && !(grid && *end == ']')) return std::numeric_limits<double>::quiet_NaN();
  return grid ? 1.0 / number : number;
}

}  // namespace archetide
