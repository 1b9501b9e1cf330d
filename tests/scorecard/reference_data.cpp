#include "tests/scorecard/reference_data.h"

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "common/base/input_error.h"

namespace archetide {

std::vector<std::vector<double>> reference_rows(const std::string& name) {
  const std::string path = std::string(ARCHETIDE_REFERENCE) + "/" + name;
  std::ifstream file(path);
  if (!file) throw FileError(path + ": no such file");
  std::string line;
  std::getline(file, line), std::getline(file, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');)
      rows.back().push_back(std::strtod(cell.c_str(), nullptr));
  }
  return rows;
}

}  // namespace archetide
