#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/mesh/tri_mesh.h"

namespace archetide {

/// A surface as it stands in a file: polygons cut into fans of triangles, nothing welded or checked
/// yet.
struct SurfaceFile {
  std::string path;
  TriMesh mesh;  // n, nf, in the unit of the file
  std::vector<int>
      face_numbers;  // nf, 1-based number in the file of the face that the triangle is part of
  int polygons = 0;  // faces with more than three corners
};

/// True for OBJ, OFF, PLY and STL, by the file name's extension.
bool is_surface_file(const std::string& path);

/// Reads an OBJ, OFF, PLY (ASCII or binary) or STL (ASCII or binary) file. Throws FileError when it
/// is missing, InputError with the line (or the element) when it cannot be understood.
SurfaceFile read_surface(const std::string& path);

/// The same from the bytes of a file; `path` gives its kind and names it in errors.
SurfaceFile parse_surface(const std::string& path, std::string_view bytes);

}  // namespace archetide
