#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/archetype/archetype.h"
#include "common/base/input_error.h"
#include "precompute/base/material.h"
#include "precompute/intake/tet_file.h"

namespace archetide {

/// A part of space: a box, a ball, a cylinder, a half-space, or the places nearest to a list of
/// points. Metres, in the coordinates of the input mesh times scale.
struct Region {
  struct Cylinder {
    Vec3 from, to;  // centres of its ends
    double radius;
  };
  struct HalfSpace {
    Vec3 point, normal;  // of its plane; the normal points out of it
  };
  std::optional<std::pair<Vec3, Vec3>> box;     // low and high corner
  std::optional<std::pair<Vec3, double>> ball;  // centre, radius
  std::optional<Cylinder> cylinder;
  std::optional<HalfSpace> half_space;
  std::vector<Vec3> list;
  std::string group;  // of tets, in the mesh file

  bool contains(const Vec3& x) const;  // the shapes, boundary included
};

/// Keeps what lies inside a region, or outside.
struct Cut {
  Region region;
  bool inside = true;
  SourceLocation where;
};
/// Whether all the cuts keep x, boundaries included.
bool keeps(const std::vector<Cut>& cuts, const Vec3& x);

/// A named region of the surface.
struct NamedRegion {
  std::string name;
  Region region;
  SourceLocation where;
};

/// Other material in a region (box, ball or group).
struct MaterialRegion {
  Region region;
  Material material;
  SourceLocation where;
};

/// The surface vertices in the region; `centre`: rest-frame origin in the region's coordinates.
/// Throws InputError when there are none.
PointSet find_points(const NamedRegion& named, const TriMesh& surface, const Vec3& centre);

/// `base` everywhere, replaced where a tet's centroid lies in a region or the tet in its group (the
/// last one wins). Throws InputError when a region holds no tet.
MaterialField find_materials(const Material& base, const std::vector<MaterialRegion>& regions,
                             const TetMesh& mesh, const Vec3& centre, const TetGroups& groups = {});

}  // namespace archetide
