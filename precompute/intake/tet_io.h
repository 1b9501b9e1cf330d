#pragma once

#include <string>
#include <string_view>

#include "common/mesh/tet_mesh.h"
#include "precompute/intake/tet_file.h"

namespace archetide {

/// True for .msh, .mesh and .vtu, by the file name's extension.
bool is_tet_file(const std::string& path);

/// Linear tets of a Gmsh (.msh, version 2 or 4, beginning with $MeshFormat), Medit (.mesh) or VTK
/// XML (.vtu, uncompressed) file, multiplied by `scale`; positively oriented, without unused nodes,
/// both in the order of the file. Throws FileError when it is missing, InputError when it holds no
/// tets or others than linear ones. Nothing beside the file is read, nothing in it is run. `groups`:
/// the physical groups of tets of a .msh file.
TetMesh read_tets(const std::string& path, double scale, TetGroups* groups = nullptr);

/// The same from the bytes of a file; `path` gives its kind and names it in errors.
TetMesh parse_tets(const std::string& path, std::string_view bytes, double scale,
                   TetGroups* groups = nullptr);

}  // namespace archetide
