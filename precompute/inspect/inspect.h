#pragma once

#include <string>

#include "common/archetype/archetype.h"
#include "precompute/base/build_record.h"

namespace archetide {

/// What `info` prints: for people, or as JSON with the keys volume, mass, center, inertia,
/// frequencies_hz, residuals, quality, surface (the solid that it encloses, exact), orthogonality,
/// hash, bytes, provenance and, where it was recorded, build. `file_bytes`: size of the archetype's
/// file.
std::string info_text(const Archetype& a, std::size_t file_bytes,
                      const std::optional<BuildRecord>& record = {});
std::string info_json(const Archetype& a, std::size_t file_bytes,
                      const std::optional<BuildRecord>& record = {});

/// Longest side of the bounding box at rest, m.
double longest_side(const Archetype& a);

/// Writes the tets as a VTK XML file for ParaView. mode 0: the rest shape with every mode as a
/// vector field; mode 1..r: the shape displaced by that mode, the farthest node by `amplitude` (m),
/// with the displacement as a field. Throws InputError when there is no such mode, MachineError.
void write_vtu(const std::string& path, const Archetype& a, int mode, double amplitude);

/// Writes the tets at rest with every mode as a vector field mode_1 .. mode_r as VTKHDF, which
/// ParaView 5.11 opens under a name that ends in .hdf. The modes stand once, in /modes (r x n x 3);
/// the fields are views of it. Throws MachineError.
void write_vtkhdf(const std::string& path, const Archetype& a);

}  // namespace archetide
