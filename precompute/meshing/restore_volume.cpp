#include "precompute/meshing/restore_volume.h"

#include <cmath>
#include <utility>
#include <vector>

#include "common/mesh/tri_mesh.h"
#include "precompute/base/tet_element.h"

namespace archetide {
namespace {

/// Of the distance between a node and the mean of its neighbours; 1/4 is exact on a sphere with
/// equal triangles.
constexpr double kLargestMove = 0.75;
constexpr double kSmoothCosine =
    0.77;                   // node and triangle normals within 40 degrees: not a sharp edge
constexpr int kPasses = 8;  // Newton steps; the volume is nearly linear in the move
constexpr double kRoundOff = 1e-15;  // relative: the volume is reached
constexpr double kNothing = 1e-13;   // relative: too little to complain about

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

/// Moves the boundary nodes of `mesh` from `before` to `after`; edges inside stay straight.
void follow(const TriMesh& before, const TriMesh& after, const std::vector<int>& nodes,
            TetMesh& mesh) {
  std::vector<Vec3> moves(mesh.nodes.size(), Vec3::Zero());
  std::vector<char> done(mesh.nodes.size(), 0);
  for (std::size_t v = 0; v < nodes.size(); ++v) {
    moves[nodes[v]] = after.vertices[v] - before.vertices[v];
    mesh.nodes[nodes[v]] = after.vertices[v];
    done[nodes[v]] = 1;
  }
  for (std::size_t t = 0; t < mesh.mids.size(); ++t)
    for (int e = 0; e < 6; ++e) {
      const int node = mesh.mids[t][e];
      if (std::exchange(done[node], 1)) continue;
      mesh.nodes[node] +=
          0.5 * (moves[mesh.tets[t][kTetEdges[e][0]]] + moves[mesh.tets[t][kTetEdges[e][1]]]);
    }
}

}  // namespace

bool restore_volume(TriMesh& surface, double volume, const std::vector<double>& share) {
  std::vector<Vec3> normals;
  std::vector<double> areas;
  vertex_normals_and_areas(surface, normals, areas);
  std::vector<double> sag = sags(surface, normals);
  for (std::size_t v = 0; v < share.size(); ++v) sag[v] *= share[v];

  TriMesh moved = surface;
  double gain = 0.0;  // volume per unit of the move
  for (std::size_t v = 0; v < sag.size(); ++v) gain += areas[v] * sag[v];
  for (int pass = 0; pass < kPasses; ++pass) {
    const double missing = volume - enclosed_volume(moved);
    if (std::abs(missing) <= kRoundOff * volume) break;
    const double move = missing / gain;
    // Flat sides have no sag: nothing to move, and nothing missing but round-off.
    if (!(std::abs(move) <= kLargestMove)) {
      if (std::abs(missing) <= kNothing * volume) break;
      return false;
    }
    for (std::size_t v = 0; v < sag.size(); ++v) moved.vertices[v] += move * sag[v] * normals[v];
  }
  surface = std::move(moved);
  return true;
}

bool restore_volume(TetMesh& mesh, double volume, const std::vector<double>& share) {
  std::vector<int> nodes;
  const TriMesh before = boundary_surface(mesh, nodes);
  std::vector<double> vertex_share;
  if (!share.empty())
    for (const int node : nodes) vertex_share.push_back(share[node]);
  TriMesh surface = before;
  TetMesh moved = mesh;
  // Linear tets fill their surface; curved ones differ from its flat triangles by a nearly constant
  // volume.
  for (int pass = 0; pass < (mesh.order() == 1 ? 1 : 3); ++pass) {
    const double beyond = mesh.order() == 1 ? 0.0 : mesh_volume(moved) - enclosed_volume(surface);
    if (!restore_volume(surface, volume - beyond, vertex_share)) return false;
    moved = mesh;
    follow(before, surface, nodes, moved);
  }
  mesh = std::move(moved);
  return true;
}

}  // namespace archetide
