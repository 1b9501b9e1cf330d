#include "precompute/tetrahedralize.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "common/input_error.h"
#include "precompute/meshers.h"
#include "precompute/restore_volume.h"

namespace archetide {
namespace {

constexpr double kSharpAngle = 60.0;  // degrees between face normals that the mesh must follow
/// Largest distance of a boundary facet to the surface in units of the size; restore_volume does
/// the rest.
constexpr double kFacetDistance = 0.1;

struct Edge {
  std::array<int, 2> ends;  // ascending
  int triangle;
  bool forward;
  bool operator<(const Edge& o) const { return ends < o.ends; }
};

std::vector<Edge> sorted_edges(const TriMesh& surface) {
  std::vector<Edge> edges;
  for (int t = 0; t < int(surface.triangles.size()); ++t)
    for (int k = 0; k < 3; ++k) {
      const int a = surface.triangles[t][k], b = surface.triangles[t][(k + 1) % 3];
      edges.push_back({{std::min(a, b), std::max(a, b)}, t, a < b});
    }
  std::stable_sort(edges.begin(), edges.end());
  return edges;
}

Vec3 unit_normal(const TriMesh& s, int t) {
  const Vec3i& v = s.triangles[t];
  return (s.vertices[v[1]] - s.vertices[v[0]])
      .cross(s.vertices[v[2]] - s.vertices[v[0]])
      .normalized();
}

/// An open surface would crash the mesher, so nothing else comes through.
void require_closed(const TriMesh& surface, const std::vector<Edge>& edges) {
  int bad = 0;
  for (std::size_t i = 0, next; i < edges.size(); i = next) {
    for (next = i; next < edges.size() && edges[next].ends == edges[i].ends;) ++next;
    bad += next - i != 2 || edges[i].forward == edges[i + 1].forward;
  }
  if (surface.triangles.empty() || bad > 0)
    throw InputError("the surface is not closed, manifold and consistently oriented: " +
                         std::to_string(bad) + " edges without two opposite triangles",
                     "repair the mesh; archetide-precompute check names the edges");
  if (!(enclosed_volume(surface) > 0.0))
    throw InputError("the surface encloses no volume or is inside out", "flip its orientation");
}

bool has_sharp_edges(const TriMesh& surface, const std::vector<Edge>& edges) {
  const double limit = std::cos(kSharpAngle * std::numbers::pi / 180.0);
  for (std::size_t i = 0; i + 1 < edges.size(); i += 2)
    if (unit_normal(surface, edges[i].triangle).dot(unit_normal(surface, edges[i + 1].triangle)) <
        limit)
      return true;
  return false;
}

/// Tets per (volume / size^3) that each back end makes, measured on spheres and tori of 7k to 260k
/// tets.
double tets_per_cube(Mesher mesher) { return mesher == Mesher::kCgal ? 4.43 : 3.9; }

TetMesh fill(const TriMesh& surface, bool sharp, Mesher mesher, const MeshRequest& request) {
  if (mesher == Mesher::kGmsh) return mesh_with_gmsh(surface, request);
  return sharp ? mesh_with_cgal_sharp(surface, kSharpAngle, request)
               : mesh_with_cgal(surface, request);
}

/// Dihedral angle below which tets are perturbed away, degrees. Where a body is few tets thick (a
/// jellyfish's bell in 7k to 20k tets) the perturbation cannot reach 12 and takes minutes to find
/// out; 6 takes a few seconds and passes the gate.
double sliver_bound(const TriMesh& surface, double volume, double edge) {
  const double layers = 2.0 * volume / (surface_area(surface) * edge);
  return layers < 2.2 ? 6.0 : 12.0;
}

/// Up to two attempts: the second one corrects the size when the first missed the target.
void fill_to_target(const TriMesh& surface, bool sharp, double volume,
                    const TetrahedralizeOptions& options, TetrahedralizeResult& result) {
  result.edge = std::cbrt(tets_per_cube(options.mesher) * volume / options.target);
  for (result.attempts = 1;; ++result.attempts) {
    MeshRequest request;
    request.size = result.edge;
    request.facet_distance = kFacetDistance * result.edge;
    request.seed = options.seed;
    request.sliver_bound = sliver_bound(surface, volume, result.edge);
    result.mesh = fill(surface, sharp, options.mesher, request);
    const double ratio = double(result.mesh.tets.size()) / options.target;
    if (std::abs(ratio - 1.0) <= options.target_tolerance || result.attempts == 2 || ratio == 0.0)
      return;
    result.edge *= std::cbrt(ratio);
  }
}

const char* hint(Mesher mesher) {
  return mesher == Mesher::kGmsh
             ? "gmsh keeps the triangles of the surface, good or bad: use tet.mesher = \"cgal\", "
               "which "
               "remeshes it"
             : "raise tet.target, or repair thin and folded places of the surface";
}

}  // namespace

TetrahedralizeResult tetrahedralize(const TriMesh& surface, const TetrahedralizeOptions& options) {
  const std::vector<Edge> edges = sorted_edges(surface);
  require_closed(surface, edges);
  const double volume = enclosed_volume(surface);
  TetrahedralizeResult result;
  fill_to_target(surface, has_sharp_edges(surface, edges), volume, options, result);
  if (options.order == 2) {
    result.mesh = with_middle_nodes(result.mesh);
    result.curved = curve_boundary(result.mesh, surface, kSharpAngle);
  }
  result.quality = measure_quality(result.mesh, volume);
  result.raw_volume_error = result.quality.volume_error;

  // Keep the restored volume only where it harms no tet.
  TetMesh restored = result.mesh;
  restore_volume(restored, volume);
  const TetQuality after = measure_quality(restored, volume);
  if (quality_complaints(after, options.limits).empty()) {
    result.mesh = std::move(restored);
    result.quality = after;
  }
  require_quality(result.quality, options.limits, options.mesher == Mesher::kCgal ? "cgal" : "gmsh",
                  hint(options.mesher));
  return result;
}

}  // namespace archetide
