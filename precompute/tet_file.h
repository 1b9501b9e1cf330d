#pragma once

#include <map>
#include <string>
#include <vector>

namespace archetide {

/// Named sets of tets (indices, ascending).
using TetGroups = std::map<std::string, std::vector<int>>;

/// Tets as they stand in a file.
struct TetFile {
  std::vector<std::size_t> tags;     // n, of the nodes, in the order of the file
  std::vector<double> coordinates;   // 3n
  std::vector<std::size_t> corners;  // 4nt, tags of the corners of each tet
  TetGroups groups;                  // physical groups of a .msh
};

/// A VTK XML UnstructuredGrid of one piece, little endian, not compressed: ASCII, base64 or raw.
/// Cells of lower dimension are left out. Throws FileError, InputError.
TetFile read_vtu(const std::string& path);

}  // namespace archetide
