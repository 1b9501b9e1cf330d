#include "precompute/intake/repair.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <sstream>

#include "common/base/input_error.h"
#include "common/files/surface_formats.h"
#include "common/mesh/weld.h"
#include "precompute/intake/intake.h"
#include "precompute/intake/nesting.h"
#include "precompute/intake/repair_steps.h"

namespace archetide {
namespace {

constexpr double kSeam = 1e-5;  // of the diagonal: vertices of a boundary closer than this meet
constexpr double kFinestWrap = 0.02;  // of the diagonal: the automatic alpha
constexpr double kOffset = 1.0 / 30;  // of alpha, CGAL's default
constexpr double kWrapFaces = 4.0;    // of a wrap times alpha^2 / area
constexpr double kMostWrapFaces = 1e6;
constexpr double kCollapsed = 0.7;  // a wrap of less volume than this has entered through a hole

double diagonal(const TriMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.vertices) box.extend(x);
  return box.sizes().norm();
}

/// Cones that close the boundary loops, each to the middle of its edges.
void add_caps(TriMesh& mesh, const std::vector<SurfaceEdge>& edges) {
  std::vector<const SurfaceEdge*> open;
  for (const SurfaceEdge& edge : edges)
    if (edge.triangles.size() == 1) open.push_back(&edge);
  std::vector<int> loop(mesh.vertices.size());
  std::iota(loop.begin(), loop.end(), 0);
  const auto root = [&](int v) {
    while (loop[v] != v) v = loop[v] = loop[loop[v]];
    return v;
  };
  for (const SurfaceEdge* edge : open) loop[root(edge->a)] = root(edge->b);
  std::map<int, std::pair<Vec3, int>> middles;  // sum and number of the vertices of each loop
  for (const SurfaceEdge* edge : open) {
    auto& [sum, n] = middles.try_emplace(root(edge->a), Vec3::Zero(), 0).first->second;
    sum += mesh.vertices[edge->a] + mesh.vertices[edge->b];
    n += 2;
  }
  std::map<int, int> tip;
  for (const auto& [r, middle] : middles) {
    tip[r] = static_cast<int>(mesh.vertices.size());
    mesh.vertices.push_back(middle.first / middle.second);
  }
  for (const SurfaceEdge* edge : open) {
    const int from = edge->runs_a_to_b[0] ? edge->b : edge->a, to = edge->a + edge->b - from;
    mesh.triangles.push_back(Vec3i(from, to, tip[root(edge->a)]));
  }
}

/// Sum of the volumes of the shells, each facing outward (cavities: inward), holes closed by cones.
/// False when some edge has more than two faces or a part has one side only.
bool rough_volume(TriMesh mesh, double& volume) {
  std::vector<SurfaceEdge> edges = surface_edges(mesh);
  for (const SurfaceEdge& edge : edges)
    if (edge.triangles.size() > 2) return false;
  std::vector<SurfaceEdge> inner;
  for (const SurfaceEdge& edge : edges)
    if (edge.triangles.size() == 2) inner.push_back(edge);
  if (orient_consistently(mesh, inner) < 0) return false;
  edges = surface_edges(mesh);
  add_caps(mesh, edges);
  const Nesting n = nest_shells(mesh, surface_edges(mesh), {});
  volume = 0.0;
  for (int s = 0; s < n.count(); ++s) volume += n.sense(s) * std::abs(n.volume[s]);
  return true;
}

TriMesh fill(const TriMesh& input, RepairReport& report) {
  TriMesh mesh = input;
  close_seams(mesh, kSeam * diagonal(input), report);
  return fill_holes(mesh, report);
}

/// Closed shells as the file connects them or, where it does not (STL), as equal corners do.
TriMesh closed_shells(const SurfaceFile& file, std::vector<SurfaceEdge>& edges) {
  const auto closed = [&edges](const TriMesh& mesh) {
    edges = surface_edges(mesh);
    return std::all_of(edges.begin(), edges.end(),
                       [](const SurfaceEdge& e) { return e.triangles.size() == 2; }) &&
           pinched_vertices(mesh, edges).empty();
  };
  for (TriMesh mesh : {weld(file.mesh).mesh, file.mesh}) {
    if (closed(mesh) && orient_consistently(mesh, edges) >= 0) return mesh;
  }
  refuse(file.path, 0, "repair = \"union\" needs parts that are closed, manifold and orientable",
         "set repair = \"fill\" when there are holes, \"wrap\" otherwise");
}

TriMesh unite_shells(const SurfaceFile& file, RepairReport& report) {
  std::vector<SurfaceEdge> edges;
  const TriMesh mesh = closed_shells(file, edges);
  if (crowd(mesh, most_candidates(mesh.triangles.size())).too_many)
    refuse(file.path, 0, "repair = \"union\": too many faces lie on top of each other to check",
           "set repair = \"wrap\"");
  const Nesting n = nest_shells(mesh, edges, self_intersections(mesh));
  std::vector<TriMesh> solids;
  std::vector<int> solid_of(n.count(), -1);
  for (int s = 0; s < n.count(); ++s) {
    if (n.sense(s) < 0) continue;
    solid_of[s] = static_cast<int>(solids.size());
    solids.push_back(n.facing_outward(s));
  }
  // A cavity belongs to the smallest solid around it.
  for (int s = 0; s < n.count(); ++s) {
    int around = s;
    while (solid_of[around] < 0) around = n.parent[around];
    if (around == s) continue;
    TriMesh& solid = solids[solid_of[around]];
    const TriMesh cavity = n.facing_outward(s);
    const int shift = static_cast<int>(solid.vertices.size());
    solid.vertices.insert(solid.vertices.end(), cavity.vertices.begin(), cavity.vertices.end());
    for (const Vec3i& t : cavity.triangles) solid.triangles.push_back(t.array() + shift);
  }
  report.shells = n.count();
  return unite(solids);
}

/// A wrap has about so many faces of edges alpha; the wrap of more takes minutes.
void demand_coarse_wrap(const SurfaceFile& file, const TriMesh& input, double alpha) {
  const double faces = kWrapFaces * surface_area(input) / (alpha * alpha);
  if (faces <= kMostWrapFaces) return;
  std::ostringstream text;
  text.precision(2);
  text << "wrap.alpha is too fine: the wrap would have about " << faces << " faces (at most "
       << kMostWrapFaces << ")";
  std::ostringstream hint;
  hint.precision(2);
  hint << "raise wrap.alpha to " << alpha * std::sqrt(faces / kMostWrapFaces)
       << " (file units times scale), or leave it out";
  refuse(file.path, 0, text.str(), hint.str());
}

TriMesh wrapped(const SurfaceFile& file, const TriMesh& input, double scale,
                const RepairOptions& options, RepairReport& report) {
  // Cones over the holes spare the wrap an alpha as wide as the widest of them.
  TriMesh capped = input;
  if (options.alpha == 0) add_caps(capped, surface_edges(input));
  report.alpha = options.alpha > 0 ? options.alpha / scale : kFinestWrap * diagonal(input);
  report.offset = options.offset > 0 ? options.offset / scale : kOffset * report.alpha;
  demand_coarse_wrap(file, capped, report.alpha);
  TriMesh result = wrap(capped, report.alpha, report.offset);
  const double volume = enclosed_volume(result);
  if (report.volume_before_known && volume < kCollapsed * report.volume_before) {
    std::ostringstream text;
    text << "the wrap entered through a hole: volume " << volume << " of " << report.volume_before
         << " at alpha " << report.alpha << " (file units)";
    refuse(file.path, 0, text.str(),
           "raise wrap.alpha above half the width of the widest hole, or leave it out");
  }
  return result;
}

TriMesh repaired_mesh(const SurfaceFile& file, const TriMesh& input, double scale,
                      const RepairOptions& options, RepairReport& report) {
  switch (options.kind) {
    case Repair::kFill:
      return fill(input, report);
    case Repair::kUnion:
      return unite_shells(file, report);
    case Repair::kWrap:
      return wrapped(file, input, scale, options, report);
    case Repair::kNone:
      break;
  }
  return input;
}

}  // namespace

SurfaceFile repair_surface(const SurfaceFile& file, double scale, const RepairOptions& options,
                           RepairReport& report) {
  report = {};
  report.kind = options.kind;
  const TriMesh input = weld(file.mesh).mesh;
  if (input.triangles.empty()) refuse(file.path, 0, "all faces have repeated corners");
  report.volume_before_known = rough_volume(input, report.volume_before);
  SurfaceFile result;
  result.path = file.path + " (after repair = \"" + name_of(options.kind) + "\")";
  result.mesh = repaired_mesh(file, input, scale, options, report);
  result.face_numbers.resize(result.mesh.triangles.size());
  std::iota(result.face_numbers.begin(), result.face_numbers.end(), 1);
  report.volume_after = enclosed_volume(result.mesh);
  report.from_input = farthest_distance(result.mesh, input);
  report.from_result = farthest_distance(input, result.mesh);
  report.hausdorff = std::max(report.from_input, report.from_result);
  return result;
}

std::string RepairReport::note() const {
  if (kind == Repair::kNone) return "";
  std::ostringstream text;
  text.precision(4);
  text << "repair " << name_of(kind) << ":";
  if (kind == Repair::kFill) {
    text << " filled holes " << holes << ", welded vertices " << welded << ", split faces " << split
         << ", dropped faces " << dropped << ";";
  }
  if (kind == Repair::kUnion) text << " merged shells " << shells << ";";
  if (kind == Repair::kWrap) text << " alpha " << alpha << ", offset " << offset << ";";
  if (volume_before_known) {
    text << " volume " << volume_before << " -> " << volume_after << " ("
         << 100 * (volume_after / volume_before - 1) << " %),";
  } else {
    text << " volume " << volume_after << " (before: unknown, it cannot be oriented),";
  }
  text << " Hausdorff distance " << hausdorff << " (result from input " << from_input
       << ", input from result " << from_result << "), file units";
  return text.str();
}

}  // namespace archetide
