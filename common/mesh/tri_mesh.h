#pragma once

#include <vector>

#include "common/base/types.h"

namespace archetide {

/// A triangle surface. Outward orientation (counter-clockwise seen from outside) where it is
/// closed.
struct TriMesh {
  std::vector<Vec3> vertices;    // n, m
  std::vector<Vec3i> triangles;  // nf, vertex indices
};

/// Volume enclosed by a closed, outward oriented surface, m^3 (divergence theorem; negative if
/// inward).
double enclosed_volume(const TriMesh& mesh);

/// Centroid of the enclosed solid, m.
Vec3 enclosed_centroid(const TriMesh& mesh);

/// Second moment about the origin, integral of x x^T over the enclosed solid, m^5.
Mat3 enclosed_second_moment(const TriMesh& mesh);

/// The surface of a box, two triangles a face.
TriMesh box_between(const Vec3& low, const Vec3& high);

double surface_area(const TriMesh& mesh);

/// Outward unit normal of triangle `t`.
Vec3 unit_normal(const TriMesh& mesh, int t);

/// Area-weighted vertex normals (unit) and vertex areas (a third of the adjacent triangles), m^2.
void vertex_normals_and_areas(const TriMesh& mesh, std::vector<Vec3>& normals,
                              std::vector<double>& areas);

}  // namespace archetide
