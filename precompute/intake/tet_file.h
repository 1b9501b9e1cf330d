#pragma once

#include <map>
#include <string>
#include <string_view>
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

// One reader for each format: `bytes` is the whole file, `path` its name in errors. Nothing else is
// read, nothing in it is run. They throw InputError. Which corners there are is for the caller to
// check.

/// A VTK XML UnstructuredGrid of one piece, little endian, not compressed: ASCII, base64 or raw.
/// Cells of lower dimension are left out.
TetFile parse_vtu(const std::string& path, std::string_view bytes);

/// Gmsh's MSH 2.0 to 2.2, 4.0 and 4.1, text or binary, not partitioned, with its physical groups.
TetFile parse_msh(const std::string& path, std::string_view bytes);

/// Medit's text format, in three dimensions.
TetFile parse_medit(const std::string& path, std::string_view bytes);

}  // namespace archetide
