#include "precompute/meshing/tetrahedralize.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numbers>
#include <set>
#include <vector>

#include "common/base/input_error.h"
#include "common/mesh/surface_topology.h"
#include "precompute/base/child_process.h"
#include "precompute/base/defects.h"
#include "precompute/base/packing.h"
#include "precompute/base/tet_element.h"
#include "precompute/intake/intake.h"
#include "precompute/intake/remesh_surface.h"
#include "precompute/meshing/meshers.h"
#include "precompute/meshing/quadratic_tets.h"
#include "precompute/meshing/restore_volume.h"

namespace archetide {
namespace {

/// gmsh keeps the surface's triangles: finer ones than this (in units of the size) are made
/// coarser.
constexpr double kFinerThanWanted = 0.8;
/// Surfaces that the mesher could not take as they are get triangles of this edge (in units of the
/// size): small folds and noise vanish, and the volume changes little.
constexpr double kRemeshedEdge = 0.6;
/// Parts of the missing volume that are tried, the most first.
constexpr double kRestored[] = {1.0, 0.75, 0.5, 0.0};
/// Rounds in which nodes of harmed tets move less, and the share of the last move that they keep.
constexpr int kGentlerRounds = 12;
constexpr double kGentler = 0.5;
/// Sizes that are tried when no way gives tets that pass: near the limit of what a thin part
/// allows, which tets turn out flat is a matter of chance.
constexpr double kOtherSizes[] = {0.95, 0.9, 0.85};
constexpr double kSecondsPerTet = 2e-4;  // allowed beyond options.cpu_seconds; both take 2e-5
constexpr double kSharpAngle = 60.0;     // degrees between face normals that the mesh must follow
/// Largest distance of a boundary facet to the surface in units of the size; restore_volume does
/// the rest.
constexpr double kFacetDistance = 0.1;

/// A way to fill the surface; the next one is tried when the tets fail the quality gate.
struct Way {
  Mesher mesher;
  bool sharp;         // follow sharp edges
  bool remesh;        // make the triangles of the surface even first
  double edge;        // then: their edge, in units of the size
  double size = 1.0;  // in units of the size that gives the wanted number
};

const char* name_of(Mesher mesher) { return mesher == Mesher::kGmsh ? "gmsh" : "cgal"; }

/// An open surface would crash the mesher, so nothing else comes through.
void require_closed(const TriMesh& surface, const std::vector<SurfaceEdge>& edges) {
  const auto bad = std::count_if(edges.begin(), edges.end(), [](const SurfaceEdge& e) {
    return e.triangles.size() != 2 || e.runs_a_to_b[0] == e.runs_a_to_b[1];
  });
  if (surface.triangles.empty() || bad > 0)
    throw InputError(fmt::format("the surface is not closed, manifold and consistently oriented: "
                                 "{} edges without two opposite triangles",
                                 bad),
                     "repair the mesh; archetide-precompute check names the edges");
  if (!(enclosed_volume(surface) > 0.0))
    throw InputError("the surface encloses no volume or is inside out", "flip its orientation");
}

bool has_sharp_edges(const TriMesh& surface, const std::vector<SurfaceEdge>& edges) {
  const double limit = std::cos(kSharpAngle * std::numbers::pi / 180.0);
  return std::any_of(edges.begin(), edges.end(), [&](const SurfaceEdge& e) {
    return unit_normal(surface, e.triangles[0]).dot(unit_normal(surface, e.triangles[1])) < limit;
  });
}

double mean_edge(const TriMesh& surface, const std::vector<SurfaceEdge>& edges) {
  double sum = 0.0;
  for (const SurfaceEdge& e : edges) sum += (surface.vertices[e.a] - surface.vertices[e.b]).norm();
  return sum / double(edges.size());
}

/// Tets per (volume / size^3) that each back end makes, measured on spheres and tori of 7k to 260k
/// tets.
double tets_per_cube(Mesher mesher) { return mesher == Mesher::kCgal ? 4.43 : 3.9; }

/// The triangles at the ends of each shell along the axes: the mesher meets its first surface
/// points by chance and may never see a small shell. Sharp edges, which it follows, need no help.
std::vector<int> seed_triangles(const TriMesh& surface, bool sharp) {
  int shell_count = 0;
  const std::vector<int> shell = shells(surface, surface_edges(surface), shell_count);
  if (shell_count == 1) return {};
  std::vector<std::vector<int>> lists(shell_count);
  for (int t = 0; t < int(shell.size()); ++t) lists[shell[t]].push_back(t);
  std::set<int> seeds;
  for (const std::vector<int>& list : lists) {
    const TriMesh part = part_of(surface, list);
    if (sharp && has_sharp_edges(part, surface_edges(part))) continue;
    for (int axis = 0; axis < 3; ++axis) {
      const auto [low, high] = std::minmax_element(list.begin(), list.end(), [&](int s, int t) {
        return surface.vertices[surface.triangles[s][0]][axis] <
               surface.vertices[surface.triangles[t][0]][axis];
      });
      seeds.insert({*low, *high});
    }
  }
  return {seeds.begin(), seeds.end()};
}

TriMesh even_surface(const TriMesh& surface, double edge, double sharp_angle) {
  TriMesh even = remesh_surface(surface, edge, sharp_angle);
  if (!self_intersections(even).empty())
    throw NumericsError("the surface cannot be made even without folds");
  return even;
}

TetMesh fill(const TriMesh& input, const Way& way, MeshRequest request) {
  const TriMesh surface =
      way.remesh ? even_surface(input, way.edge * request.size, way.sharp ? kSharpAngle : 180.0)
                 : input;
  if (way.mesher == Mesher::kGmsh) return mesh_with_gmsh(surface, request);
  request.seeds = seed_triangles(surface, way.sharp);
  return way.sharp ? mesh_with_cgal_sharp(surface, kSharpAngle, request)
                   : mesh_with_cgal(surface, request);
}

TetMesh fill_in_time(const TriMesh& input, const Way& way, const MeshRequest& request,
                     double& cpu_seconds) {
  Unpacker unpack(in_child_process(name_of(way.mesher), cpu_seconds, [&] {
    Packer pack;
    pack(fill(input, way, request));
    return std::move(pack.bytes);
  }));
  TetMesh mesh;
  unpack(mesh);
  return mesh;
}

/// Dihedral angle below which tets are perturbed away, degrees. Where a body is few tets thick (a
/// jellyfish's bell in 7k to 20k tets) the perturbation cannot reach 12 and takes minutes to find
/// out; 6 takes a few seconds and passes the gate.
double sliver_bound(const TriMesh& surface, double volume, double edge) {
  const double layers = 2.0 * volume / (surface_area(surface) * edge);
  return layers < 2.2 ? 6.0 : 12.0;
}

/// Up to two attempts: the second one corrects the size when the first missed the target.
TetrahedralizeResult fill_to_target(const TriMesh& surface, const Way& way, double volume,
                                    const TetrahedralizeOptions& options, double& cpu_seconds) {
  TetrahedralizeResult result;
  result.edge = std::cbrt(tets_per_cube(options.mesher) * volume / options.target);
  for (result.attempts = 1;; ++result.attempts) {
    MeshRequest request;
    request.size = way.size * result.edge;
    request.facet_distance = kFacetDistance * request.size;
    request.seed = options.seed;
    request.sliver_bound = sliver_bound(surface, volume, request.size);
    result.mesh = fill_in_time(surface, way, request, cpu_seconds);
    const double ratio = double(result.mesh.tets.size()) * std::pow(way.size, 3) / options.target;
    if (std::abs(ratio - 1.0) <= options.target_tolerance || result.attempts == 2 || ratio == 0.0)
      return result;
    result.edge *= std::cbrt(ratio);
  }
}

/// Curved tets whose Jacobian has become too small.
std::vector<int> folded_tets(const TetMesh& mesh) {
  std::vector<int> folded;
  for (int t = 0; t < int(mesh.mids.size()); ++t) {
    const auto x = element_positions<10>(mesh, element_nodes<10>(mesh, t));
    constexpr double kJacobianRounding = 1e-9;
    if (!is_straight(x) && smallest_jacobian(x) < kSmallestJacobian - kJacobianRounding)
      folded.push_back(t);
  }
  return folded;
}

/// Nodes of a harmed tet move alike, by `gentler` times what the stillest of them did.
template <class Nodes>
void move_together(const Nodes& nodes, double gentler, std::vector<double>& share) {
  double least = 1.0;
  for (const int node : nodes) least = std::min(least, share[node]);
  for (const int node : nodes) share[node] = gentler * least;
}

/// Moves the boundary to restore the volume where that harms no tet: the nodes of harmed ones move
/// less, and those of one tet alike, until all pass; at last, only a part of the volume is
/// restored.
void restore(const QualityLimits& limits, double volume, int shell_count,
             TetrahedralizeResult& result) {
  result.quality = measure_quality(result.mesh, volume, shell_count);
  result.raw_volume_error = result.quality.volume_error;
  const double missing = volume - result.quality.volume;
  const std::vector<int> bad = bad_tets(result.mesh, limits);
  const std::set<int> flat(bad.begin(), bad.end());  // standing still cannot cure these
  for (const double part : kRestored) {
    std::vector<double> share(result.mesh.nodes.size(), 1.0);
    for (int round = 0; round < kGentlerRounds; ++round) {
      TetMesh restored = result.mesh;
      if (part > 0 && !restore_volume(restored, volume - (1 - part) * missing, share)) break;
      const TetQuality after = measure_quality(restored, volume, shell_count);
      const std::vector<int> folded = folded_tets(restored);
      if (folded.empty() && quality_complaints(after, limits).empty()) {
        result.mesh = std::move(restored);
        result.quality = after;
        return;
      }
      if (part == 0) break;
      for (const int t : bad_tets(restored, limits))
        move_together(restored.tets[t], flat.count(t) ? 1.0 : kGentler, share);
      for (const int t : folded) {
        move_together(restored.tets[t], kGentler, share);
        move_together(restored.mids[t], kGentler, share);
      }
    }
  }
}

std::vector<Way> ways(const TriMesh& surface, const std::vector<SurfaceEdge>& edges, double volume,
                      const TetrahedralizeOptions& options) {
  const bool sharp = has_sharp_edges(surface, edges);
  if (options.mesher == Mesher::kGmsh) {
    const double size = std::cbrt(tets_per_cube(Mesher::kGmsh) * volume / options.target);
    const Way kept = {Mesher::kGmsh, sharp, false, 0.0}, even = {Mesher::kGmsh, sharp, true, 1.0};
    if (mean_edge(surface, edges) < kFinerThanWanted * size) return {even, kept};
    return {kept, even};
  }
  std::vector<Way> list = {{Mesher::kCgal, false, false, 0.0},
                           {Mesher::kCgal, false, true, kRemeshedEdge}};
  if (sharp) list.insert(list.begin(), {Mesher::kCgal, true, false, 0.0});
  for (const double smaller : kOtherSizes) {
    list.push_back(list.front());
    list.back().size = smaller;
  }
  return list;
}

const char* hint(Mesher mesher) {
  return mesher == Mesher::kGmsh
             ? "use tet.mesher = \"cgal\", or raise tet.target"
             : "raise tet.target, repair thin and folded places of the surface, or set repair = "
               "\"wrap\"";
}

}  // namespace

TetrahedralizeResult tetrahedralize(const TriMesh& surface, const TetrahedralizeOptions& options) {
  const std::vector<SurfaceEdge> edges = surface_edges(surface);
  require_closed(surface, edges);
  const double volume = enclosed_volume(surface);
  int shell_count = 0;
  shells(surface, edges, shell_count);
  double cpu_seconds = options.cpu_seconds + kSecondsPerTet * options.target;
  TetrahedralizeResult best;  // the first one that gave tets at all
  std::string failure;
  for (const Way& way : ways(surface, edges, volume, options)) {
    try {
      TetrahedralizeResult result = fill_to_target(surface, way, volume, options, cpu_seconds);
      const std::clock_t start = std::clock();
      if (options.order == 2) {
        result.mesh = with_middle_nodes(result.mesh);
        result.curved = curve_boundary(result.mesh, surface, kSharpAngle);
      }
      restore(options.limits, volume, shell_count, result);
      if (quality_complaints(result.quality, options.limits).empty()) return result;
      if (best.mesh.tets.empty()) best = std::move(result);
      cpu_seconds -= double(std::clock() - start) / CLOCKS_PER_SEC;
      if (cpu_seconds <= 0.0)
        throw OutOfTime(std::string(name_of(options.mesher)) +
                        " gave no tets that pass the quality gate in time");
    } catch (const OutOfTime& error) {
      // No other way: whether this one ends in time must not decide which tets there are.
      throw OutOfTime(std::string(error.what()) + "\n  " + hint(options.mesher));
    } catch (const NumericsError& error) {
      if (failure.empty()) failure = error.what();
    }
  }
  if (best.mesh.tets.empty()) throw NumericsError(failure + "\n  " + hint(options.mesher));
  require_quality(best.mesh, best.quality, options.limits, name_of(options.mesher),
                  hint(options.mesher));
  return best;
}

}  // namespace archetide
