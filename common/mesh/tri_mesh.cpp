#include "common/mesh/tri_mesh.h"

#include <cmath>

namespace archetide {
namespace {

/// Integrals of 1, y and y y^T over the enclosed solid, with y = x - p and p a vertex of the mesh,
/// so that a surface far from the origin loses no digits.
struct SolidIntegrals {
  Vec3 p = Vec3::Zero();       // m
  double volume = 0.0;         // m^3
  Vec3 first = Vec3::Zero();   // m^4
  Mat3 second = Mat3::Zero();  // m^5
};

SolidIntegrals integrate_solid(const TriMesh& mesh) {
  SolidIntegrals sum;
  if (!mesh.vertices.empty()) sum.p = mesh.vertices.front();
  for (const Vec3i& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]] - sum.p;
    const Vec3 b = mesh.vertices[t[1]] - sum.p;
    const Vec3 c = mesh.vertices[t[2]] - sum.p;
    const double v = a.dot(b.cross(c)) / 6.0;  // signed volume of the tet (p, a, b, c)
    const Vec3 s = a + b + c;
    sum.volume += v;
    sum.first += v / 4.0 * s;  // ∫ y = V (0 + a + b + c) / 4
    // ∫ y yᵀ = V / 20 (s sᵀ + a aᵀ + b bᵀ + c cᵀ)
    sum.second +=
        v / 20.0 * (s * s.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
  return sum;
}

Vec3 area_vector(const TriMesh& mesh, const Vec3i& t) {
  const Vec3& a = mesh.vertices[t[0]];
  return 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
}

}  // namespace

double enclosed_volume(const TriMesh& mesh) { return integrate_solid(mesh).volume; }

Vec3 enclosed_centroid(const TriMesh& mesh) {
  const SolidIntegrals sum = integrate_solid(mesh);
  return sum.p + sum.first / sum.volume;
}

Mat3 enclosed_second_moment(const TriMesh& mesh) {
  const SolidIntegrals sum = integrate_solid(mesh);
  // x = p + y: ∫ x xᵀ = ∫ y yᵀ + p (∫y)ᵀ + (∫y) pᵀ + V p pᵀ
  const Mat3 cross_term = sum.p * sum.first.transpose();
  return sum.second + cross_term + cross_term.transpose() + sum.volume * sum.p * sum.p.transpose();
}

Vec3 unit_normal(const TriMesh& mesh, int t) {
  return area_vector(mesh, mesh.triangles[t]).normalized();
}

TriMesh box_between(const Vec3& low, const Vec3& high) {
  TriMesh mesh;
  for (int corner = 0; corner < 8; ++corner)
    mesh.vertices.emplace_back(corner & 1 ? high[0] : low[0], corner & 2 ? high[1] : low[1],
                               corner & 4 ? high[2] : low[2]);
  for (int axis = 0; axis < 3; ++axis) {
    const int b = 1 << (axis + 1) % 3, c = 1 << (axis + 2) % 3;
    for (const int side : {0, 1 << axis}) {
      const int first = side ? b : c, second = side ? c : b;  // counter-clockwise from outside
      mesh.triangles.emplace_back(side, side + first, side + b + c);
      mesh.triangles.emplace_back(side, side + b + c, side + second);
    }
  }
  return mesh;
}

double surface_area(const TriMesh& mesh) {
  double area = 0.0;
  for (const Vec3i& t : mesh.triangles) area += area_vector(mesh, t).norm();
  return area;
}

void vertex_normals_and_areas(const TriMesh& mesh, std::vector<Vec3>& normals,
                              std::vector<double>& areas) {
  normals.assign(mesh.vertices.size(), Vec3::Zero());
  areas.assign(mesh.vertices.size(), 0.0);
  for (const Vec3i& t : mesh.triangles) {
    const Vec3 area = area_vector(mesh, t);
    for (const int v : t) {
      normals[v] += area;
      areas[v] += area.norm() / 3.0;
    }
  }
  // A vertex whose faces cancel (a needle tip of zero solid angle) keeps a zero normal.
  for (Vec3& n : normals) n.stableNormalize();
}

}  // namespace archetide
