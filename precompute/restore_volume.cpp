#include "precompute/restore_volume.h"

#include <cmath>
#include <vector>

#include "common/tri_mesh.h"

namespace archetide {
namespace {

/// Of the distance between a node and the mean of its neighbours; 1/4 is exact on a sphere with
/// equal triangles.
constexpr double kLargestMove = 0.75;
constexpr double kSmoothCosine =
    0.77;                   // node and triangle normals within 40 degrees: not a sharp edge
constexpr int kPasses = 3;  // Newton steps; the volume is nearly linear in the move

/// How far each vertex stands out from its neighbours along its normal, m; 0 at sharp edges.
std::vector<double> sags(const TriMesh& surface, const std::vector<Vec3>& normals) {
  const std::size_t n = surface.vertices.size();
  std::vector<Vec3> sums(n, Vec3::Zero());
  std::vector<int> counts(n, 0);
  std::vector<char> smooth(n, 1);
  for (const Vec3i& t : surface.triangles) {
    const Vec3 &a = surface.vertices[t[0]], &b = surface.vertices[t[1]],
               &c = surface.vertices[t[2]];
    const Vec3 normal = (b - a).cross(c - a).normalized();
    for (int k = 0; k < 3; ++k) {
      sums[t[k]] += a + b + c - surface.vertices[t[k]];
      counts[t[k]] += 2;
      if (normal.dot(normals[t[k]]) < kSmoothCosine) smooth[t[k]] = 0;
    }
  }
  std::vector<double> result(n, 0.0);
  for (std::size_t v = 0; v < n; ++v)
    if (smooth[v]) result[v] = normals[v].dot(surface.vertices[v] - sums[v] / counts[v]);
  return result;
}

}  // namespace

void restore_volume(TetMesh& mesh, double volume) {
  std::vector<int> nodes;
  TriMesh surface = boundary_surface(mesh, nodes);
  std::vector<Vec3> normals;
  std::vector<double> areas;
  vertex_normals_and_areas(surface, normals, areas);
  const std::vector<double> sag = sags(surface, normals);

  double gain = 0.0;  // volume per unit of the move
  for (std::size_t v = 0; v < sag.size(); ++v) gain += areas[v] * sag[v];
  for (int pass = 0; pass < kPasses; ++pass) {
    const double move = (volume - enclosed_volume(surface)) / gain;
    if (!(std::abs(move) <= kLargestMove)) return;
    for (std::size_t v = 0; v < sag.size(); ++v) surface.vertices[v] += move * sag[v] * normals[v];
  }
  for (std::size_t v = 0; v < sag.size(); ++v) mesh.nodes[nodes[v]] = surface.vertices[v];
}

}  // namespace archetide
