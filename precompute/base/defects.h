#pragma once

#include <string>
#include <vector>

#include "common/base/input_error.h"
#include "common/mesh/tri_mesh.h"

namespace archetide {

/// The elements that an error is about, as triangles in the coordinates of the mesh file.
struct Offenders {
  TriMesh offenders;
};

/// A surface that does not bound a body (exit 2).
struct SurfaceDefects : InputError, Offenders {
  SurfaceDefects(std::vector<Diagnostic> list, TriMesh elements)
      : InputError(std::move(list)), Offenders{std::move(elements)} {}
};

/// Tets that fail the quality gate (exit 3).
struct TetDefects : NumericsError, Offenders {
  TetDefects(const std::string& message, TriMesh elements)
      : NumericsError(message), Offenders{std::move(elements)} {}
};

/// Some triangles of a mesh, with only the vertices that they use.
TriMesh part_of(const TriMesh& mesh, const std::vector<int>& triangles);

/// Writes a binary PLY atomically (float64 coordinates). Throws MachineError.
void write_ply(const std::string& path, const TriMesh& mesh);

/// "(x, y, z)", for messages.
std::string place(const Vec3& x);

/// "1 face", "3 faces".
std::string counted(std::size_t n, const std::string& one, const std::string& many);

}  // namespace archetide
