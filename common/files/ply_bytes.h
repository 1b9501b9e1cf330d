#pragma once

#include <string>
#include <vector>

#include "common/base/types.h"

namespace archetide {

/// Header of a binary little-endian PLY file of triangles: vertices with `properties`, all of one
/// `type` ("float", "double"), faces as uchar count and int32 indices. `comment`: one line, or "".
std::string ply_header(const std::string& comment, const std::string& type,
                       const std::vector<std::string>& properties, std::size_t vertices,
                       std::size_t faces);

/// Bytes of a face in such a file.
inline constexpr std::size_t kPlyFaceBytes = 1 + 3 * sizeof(int);
void append_ply_faces(std::string& bytes, const std::vector<Vec3i>& triangles);

}  // namespace archetide
