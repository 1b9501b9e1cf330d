#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/base/types.h"
#include "common/mesh/tri_mesh.h"

namespace archetide {

/// Points where two parts of a skin stay together.
struct SkinJoint {
  int a = -1, b = -1;        // parts
  std::vector<Vec3> points;  // m, coordinates of the input mesh times scale
};

/// A coarser surface of a skin, for water of large cells (SurfaceRung).
struct SkinRung {
  TriMesh surface;                          // n, nf, m
  std::vector<std::array<int, 4>> part_of;  // n, as those of the skin
  std::vector<double> weights;              // 4 n
  double deviation = 0.0;                   // m, root mean square distance from the skin
};

/// One closed surface over bodies that were cut out of it. A vertex moves as the mean of where its
/// parts would move it. Needs no part to be computed: the parts are named only.
struct Skin {
  static constexpr int kFormatVersion = 1;
  static constexpr int kMostParts = 4;  // that move one vertex

  // Provenance, as that of an archetype.
  std::string name, generator, recipe, mesh_file, mesh_hash, content_hash;

  double blend = 0.0;  // m, width along the surface where one part hands over to another
  TriMesh surface;     // n, nf, m: the input mesh times scale, outward
  std::vector<std::string> parts;                    // names of the bodies' archetypes
  std::vector<std::array<int, kMostParts>> part_of;  // n, of each weight; unused: 0
  std::vector<double> weights;                       // n kMostParts, >= 0, sum of a vertex 1
  std::vector<SkinJoint> joints;
  std::vector<SkinRung> ladder;  // finest first; may be empty

  double weight(std::size_t vertex, int part) const;
};

/// The skin with a coarser surface, and without a ladder.
Skin on_rung(const Skin& skin, const SkinRung& rung);

/// Throws AssertionError with the field's name if sizes or values are inconsistent.
void validate(const Skin& skin);

/// Writes atomically and byte-reproducibly; returns the content hash. Throws MachineError.
std::string write_skin(const std::string& path, const Skin& skin);

/// Throws FileError: missing, not HDF5, not a skin, other version, truncated, hash mismatch.
Skin read_skin(const std::string& path);

constexpr char kSkinFormat[] = "archetide skin";  // attribute "format" of the file

/// Whether the file is a skin, of whatever version. Throws FileError when it is missing or not
/// HDF5.
bool is_skin_file(const std::string& path);

}  // namespace archetide
