#include "precompute/intake/intake.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <sstream>

#include "common/files/surface_formats.h"
#include "common/mesh/surface_topology.h"
#include "common/mesh/weld.h"
#include "precompute/base/child_process.h"
#include "precompute/base/defects.h"
#include "precompute/base/packing.h"
#include "precompute/intake/nesting.h"

namespace archetide {
namespace {

constexpr std::size_t kNamed = 5;  // defects named with face and place; the rest are only counted
constexpr double kFlat =
    1e-6;  // V / A^(3/2) below which a surface counts as enclosing nothing (ball: 0.094)

constexpr int kCrowded = 500;  // boxes that overlap with one triangle's: tidy meshes have 20

/// A surface on its way in, with the file's face number of every triangle.
struct Candidate {
  const std::string& path;
  TriMesh mesh;
  std::vector<int> face_numbers;  // nf, 1-based
};

/// Defects found so far, and the triangles that show them.
struct Findings {
  const Candidate& surface;
  std::vector<Diagnostic> list;
  std::vector<int> triangles;

  /// "3 degenerate faces: face 4 at (..); face 9 at (..); ..."
  template <class List, class Describe>
  void add(const List& items, const std::string& name, Describe describe, const std::string& hint) {
    std::string text = name + ": ";
    for (std::size_t i = 0; i < std::min(items.size(), kNamed); ++i) {
      text += (i ? "; " : "") + describe(items[i]);
    }
    if (items.size() > kNamed) text += "; ...";
    list.push_back({{surface.path, 0, 0}, text, hint});
  }
  void throw_if_any() const {
    if (!list.empty()) throw SurfaceDefects(list, part_of(surface.mesh, triangles));
  }
};

/// Refuses the surface as a whole.
[[noreturn]] void refuse_all(const Candidate& c, const std::string& what, const std::string& hint) {
  throw SurfaceDefects({{{c.path, 0, 0}, what, hint}}, c.mesh);
}

std::string face(const Candidate& c, int t) { return fmt::format("face {}", c.face_numbers[t]); }

Vec3 middle(const TriMesh& mesh, int t) {
  const Vec3i& corners = mesh.triangles[t];
  return (mesh.vertices[corners[0]] + mesh.vertices[corners[1]] + mesh.vertices[corners[2]]) / 3.0;
}

// ---- steps: collect_.. lists defects, demand_.. passes or throws ------------------------------

void demand_finite(const SurfaceFile& file) {
  std::vector<int> bad;
  for (int v = 0; v < static_cast<int>(file.mesh.vertices.size()); ++v) {
    if (!file.mesh.vertices[v].allFinite()) bad.push_back(v);
  }
  if (bad.empty()) return;
  const Candidate c{file.path, {}, {}};
  Findings found{c, {}, {}};
  found.add(
      bad, counted(bad.size(), "vertex", "vertices") + " with a coordinate that is not a number",
      [&](int v) { return fmt::format("vertex {} at {}", v + 1, place(file.mesh.vertices[v])); },
      "export the mesh again; NaN or infinity cannot be placed");
  throw InputError(found.list);
}

Candidate weld_file(const SurfaceFile& file, IntakeReport& report) {
  Weld w = weld(file.mesh);
  report.welded = w.welded;
  report.unused = w.unused;
  report.collapsed = w.collapsed;
  if (w.mesh.triangles.empty()) refuse(file.path, 0, "all faces have repeated corners");
  Candidate c{file.path, std::move(w.mesh), {}};
  for (const int t : w.kept) c.face_numbers.push_back(file.face_numbers[t]);
  return c;
}

void collect_improper_faces(const Candidate& c, Findings& found) {
  std::vector<int> flat, repeated;
  std::map<std::array<int, 3>, int> seen;
  for (int t = 0; t < static_cast<int>(c.mesh.triangles.size()); ++t) {
    std::array<int, 3> key = {c.mesh.triangles[t][0], c.mesh.triangles[t][1],
                              c.mesh.triangles[t][2]};
    if (is_degenerate(c.mesh, t)) flat.push_back(t);
    std::sort(key.begin(), key.end());
    if (!seen.try_emplace(key, t).second) repeated.push_back(t);
  }
  const auto where = [&](int t) { return face(c, t) + " at " + place(middle(c.mesh, t)); };
  found.triangles.insert(found.triangles.end(), flat.begin(), flat.end());
  found.triangles.insert(found.triangles.end(), repeated.begin(), repeated.end());
  if (!flat.empty()) {
    found.add(flat,
              counted(flat.size(), "degenerate face", "degenerate faces") +
                  " without area (three corners in a line)",
              where,
              "collapse or dissolve them in the modelling program, or set repair = \"fill\"");
  }
  if (!repeated.empty()) {
    found.add(repeated, counted(repeated.size(), "duplicate face", "duplicate faces"), where,
              "delete the copies (an internal wall or a double surface), or set repair = \"fill\"");
  }
}

void collect_bad_edges(const Candidate& c, const std::vector<SurfaceEdge>& edges, Findings& found) {
  std::vector<const SurfaceEdge*> open, crowded;
  for (const SurfaceEdge& edge : edges) {
    if (edge.triangles.size() == 2) continue;
    (edge.triangles.size() == 1 ? open : crowded).push_back(&edge);
    found.triangles.insert(found.triangles.end(), edge.triangles.begin(), edge.triangles.end());
  }
  const auto where = [&](const SurfaceEdge* edge) {
    std::string faces;
    for (const int t : edge->triangles) faces += (faces.empty() ? "" : ", ") + face(c, t);
    return "edge " + place(c.mesh.vertices[edge->a]) + " - " + place(c.mesh.vertices[edge->b]) +
           " of " + faces;
  };
  if (!open.empty()) {
    found.add(open,
              "the surface is open: " + counted(open.size(), "boundary edge", "boundary edges"),
              where,
              "fill the holes, or weld vertices that only nearly coincide; or set repair = "
              "\"fill\" (\"wrap\" for large gaps and loose parts)");
  }
  if (!crowded.empty()) {
    found.add(crowded,
              counted(crowded.size(), "non-manifold edge", "non-manifold edges") +
                  " with more than two faces",
              where,
              "remove internal walls; two parts may not share an edge; or set repair = "
              "\"union\" (overlapping closed parts) or \"wrap\"");
  }
}

void demand_single_fans(const Candidate& c, const std::vector<SurfaceEdge>& edges) {
  const std::vector<int> pinched = pinched_vertices(c.mesh, edges);
  Findings found{c, {}, {}};
  for (int t = 0; t < static_cast<int>(c.mesh.triangles.size()); ++t) {
    for (const int v : c.mesh.triangles[t]) {
      if (std::binary_search(pinched.begin(), pinched.end(), v)) found.triangles.push_back(t);
    }
  }
  if (!pinched.empty()) {
    found.add(
        pinched,
        counted(pinched.size(), "non-manifold vertex", "non-manifold vertices") +
            " where parts of the surface touch in a point",
        [&](int v) { return place(c.mesh.vertices[v]); },
        "separate the parts, or join them by faces; or set repair = \"wrap\"");
  }
  found.throw_if_any();
}

void orient(Candidate& c, const std::vector<SurfaceEdge>& edges, IntakeReport& report) {
  report.reoriented = orient_consistently(c.mesh, edges);
  if (report.reoriented >= 0) return;
  refuse_all(c, "the surface has only one side (it is not orientable)",
             "a surface that bounds a body has an inside and an outside");
}

/// "shell 2 of 12 triangles from face 13 at (3, 0, 0)"
std::string shell_text(const Candidate& c, const Nesting& n, int s) {
  const auto first = std::find(n.shell.begin(), n.shell.end(), s) - n.shell.begin();
  return fmt::format("shell {} of {} from {} at {}", s + 1,
                     counted(n.parts[s].triangles.size(), "triangle", "triangles"),
                     face(c, static_cast<int>(first)), place(n.parts[s].vertices[0]));
}

void demand_volume(const Candidate& c, const Nesting& n) {
  std::vector<int> flat;
  for (int s = 0; s < n.count(); ++s) {
    const double area = surface_area(n.parts[s]);
    if (std::abs(n.volume[s]) <= kFlat * std::pow(area, 1.5)) flat.push_back(s);
  }
  if (flat.empty()) return;
  Findings found{c, {}, {}};
  for (int t = 0; t < static_cast<int>(n.shell.size()); ++t) {
    if (std::binary_search(flat.begin(), flat.end(), n.shell[t])) found.triangles.push_back(t);
  }
  found.add(
      flat,
      n.count() == 1 ? std::string("the surface encloses no volume")
                     : counted(flat.size(), "shell encloses", "shells enclose") + " no volume",
      [&](int s) {
        std::ostringstream text;
        text << n.volume[s] << " with an area of " << surface_area(n.parts[s]) << ", "
             << shell_text(c, n, s);
        return text.str();
      },
      "give the body a thickness");
  found.throw_if_any();
}

/// So many faces on top of each other that the check below would take minutes.
void demand_few_neighbours(const Candidate& c) {
  const Crowd crowded = crowd(c.mesh, most_candidates(c.mesh.triangles.size()));
  if (!crowded.too_many) return;
  Findings found{c, {}, {}};
  for (int t = 0; t < int(crowded.neighbours.size()); ++t)
    if (crowded.neighbours[t] > kCrowded) found.triangles.push_back(t);
  std::vector<int> worst = found.triangles;
  std::sort(worst.begin(), worst.end(),
            [&](int s, int t) { return crowded.neighbours[s] > crowded.neighbours[t]; });
  found.add(
      worst,
      fmt::format("more than {} pairs of faces may intersect, too many to check; {} next to more "
                  "than {} others",
                  crowded.pairs - 1, counted(worst.size(), "face is", "faces are"), kCrowded),
      [&](int t) { return face(c, t) + " at " + place(middle(c.mesh, t)); },
      "long needles or many copies on top of each other: remesh it in the modelling program, or "
      "set repair = \"wrap\"");
  found.throw_if_any();
}

void demand_no_self_intersections(const Candidate& c, const Nesting& n,
                                  const std::vector<std::pair<int, int>>& pairs) {
  if (pairs.empty()) return;
  Findings found{c, {}, {}};
  bool between_shells = false;
  for (const auto& [s, t] : pairs) {
    found.triangles.insert(found.triangles.end(), {s, t});
    between_shells |= n.shell[s] != n.shell[t];
  }
  std::sort(found.triangles.begin(), found.triangles.end());
  found.triangles.erase(std::unique(found.triangles.begin(), found.triangles.end()),
                        found.triangles.end());
  found.add(
      pairs,
      std::string(between_shells ? "shells of the surface overlap: "
                                 : "the surface intersects itself: ") +
          (pairs.size() >= kMostCrossings ? "at least " : "") +
          counted(pairs.size(), "pair of faces that cross", "pairs of faces that cross"),
      [&](const std::pair<int, int>& p) {
        return face(c, p.first) + " and " + face(c, p.second) + " near " +
               place(middle(c.mesh, p.first));
      },
      between_shells
          ? "join the parts in the modelling program, or set repair = \"union\" (or \"wrap\")"
          : "repair it in the modelling program (boolean union, remesh), or set repair = \"wrap\"");
  found.throw_if_any();
}

/// One outer shell; inside it only shells that face the other way, side by side: its cavities.
void demand_one_solid(const Candidate& c, const Nesting& n) {
  std::vector<int> outer, doubled, deep;
  for (int s = 0; s < n.count(); ++s) {
    if (n.depth[s] == 0) outer.push_back(s);
    if (n.depth[s] == 1 && n.sense(s) > 0) doubled.push_back(s);
    if (n.depth[s] > 1) deep.push_back(s);
  }
  Findings found{c, {}, {}};
  const auto describe = [&](int s) {
    return shell_text(c, n, s) +
           (n.parent[s] < 0 ? "" : fmt::format(" inside shell {}", n.parent[s] + 1));
  };
  const auto show = [&](const std::vector<int>& list) {
    for (int t = 0; t < static_cast<int>(n.shell.size()); ++t) {
      if (std::binary_search(list.begin(), list.end(), n.shell[t])) found.triangles.push_back(t);
    }
  };
  if (outer.size() > 1) {
    show(outer);
    found.add(outer, fmt::format("{} separate shells", outer.size()), describe,
              "a body is one connected solid: join the parts, or give each its own body file (or "
              "set repair = \"wrap\" with a wrap.alpha above half the gap)");
  }
  if (!doubled.empty()) {
    show(doubled);
    found.add(doubled,
              counted(doubled.size(), "shell lies", "shells lie") +
                  " inside another one and face the same way: a cavity or a doubled solid?",
              describe,
              "turn the inner shell round (facing inward) for a cavity, or set repair = \"union\" "
              "to drop it");
  }
  if (!deep.empty()) {
    show(deep);
    found.add(deep, counted(deep.size(), "shell lies", "shells lie") + " inside a cavity", describe,
              "a body is one connected solid: delete the loose part, or give it its own body file");
  }
  found.throw_if_any();
}

void turn_outward(Candidate& c, const Nesting& n, IntakeReport& report) {
  for (int s = 0; s < n.count(); ++s) {
    if (n.depth[s] == 0) report.turned_inside_out = n.volume[s] < 0;
    if (n.depth[s] != 1) continue;
    ++report.cavities;
    report.cavity_volume += std::abs(n.volume[s]);
  }
  if (report.turned_inside_out) turn_round(c.mesh);
}

void measure(const TriMesh& mesh, IntakeReport& report) {
  report.vertices = static_cast<int>(mesh.vertices.size());
  report.faces = static_cast<int>(mesh.triangles.size());
  report.volume = enclosed_volume(mesh);
  report.area = surface_area(mesh);
  report.low = report.high = mesh.vertices[0];
  for (const Vec3& x : mesh.vertices) {
    report.low = report.low.cwiseMin(x);
    report.high = report.high.cwiseMax(x);
  }
  // About the centroid, I = tr(S) 1 - S.
  report.centroid = enclosed_centroid(mesh);
  const Mat3 S =
      enclosed_second_moment(mesh) - report.volume * report.centroid * report.centroid.transpose();
  report.inertia = S.trace() * Mat3::Identity() - S;
}

}  // namespace

TriMesh accept_surface(const SurfaceFile& file, double scale, IntakeReport& report) {
  report = {};
  demand_finite(file);
  Candidate c = weld_file(file, report);
  const std::vector<SurfaceEdge> edges = surface_edges(c.mesh);
  Findings found{c, {}, {}};
  collect_improper_faces(c, found);
  collect_bad_edges(c, edges, found);
  found.throw_if_any();
  demand_single_fans(c, edges);
  orient(c, edges, report);
  demand_few_neighbours(c);
  const std::vector<std::pair<int, int>> crossing = self_intersections(c.mesh);
  const Nesting nesting = nest_shells(c.mesh, edges, crossing);
  demand_volume(c, nesting);
  demand_no_self_intersections(c, nesting, crossing);
  demand_one_solid(c, nesting);
  turn_outward(c, nesting, report);
  for (Vec3& x : c.mesh.vertices) x *= scale;
  report.cavity_volume *= scale * scale * scale;
  measure(c.mesh, report);
  return std::move(c.mesh);
}

template <class Archive>
void fields(Archive& archive, IntakeReport& r) {
  archive(r.vertices, r.faces, r.welded, r.unused, r.collapsed, r.reoriented, r.turned_inside_out,
          r.cavities, r.cavity_volume, r.volume, r.area, r.centroid, r.inertia, r.low, r.high,
          r.repair);
}

TriMesh in_time(const std::string& step, double& cpu_seconds, IntakeReport& report,
                const std::function<TriMesh(IntakeReport&)>& work) {
  Unpacker unpack(in_child_process(step, cpu_seconds, [&] {
    IntakeReport found;
    const TriMesh mesh = work(found);
    Packer pack;
    pack(mesh, found);
    return std::move(pack.bytes);
  }));
  TriMesh mesh;
  unpack(mesh, report);
  return mesh;
}

namespace {

TriMesh accept_repaired(const SurfaceFile& file, double scale, const RepairOptions& repair,
                        IntakeReport& report) {
  demand_finite(file);
  RepairReport done;
  const SurfaceFile repaired = repair_surface(file, scale, repair, done);
  try {
    TriMesh mesh = accept_surface(repaired, scale, report);
    report.repair = done;
    return mesh;
  } catch (const SurfaceDefects& error) {
    std::vector<Diagnostic> list = error.diagnostics;
    const bool wraps = repair.kind == Repair::kWrap;
    for (Diagnostic& d : list) {
      d.hint = std::string("repair = \"") + name_of(repair.kind) + "\" left this; " +
               (wraps ? "try another wrap.alpha" : "set repair = \"wrap\"");
    }
    throw SurfaceDefects(list, error.offenders);
  }
}

const char* out_of_time_hint(Repair kind) {
  if (kind == Repair::kNone) return kOutOfTimeHint;
  if (kind == Repair::kWrap)
    return "raise wrap.alpha, make the surface coarser in the modelling program, or allow more "
           "with "
           "--time-limit";
  return "repair the surface in the modelling program, set repair = \"wrap\", or allow more with "
         "--time-limit";
}

}  // namespace

TriMesh accept_surface(const SurfaceFile& file, double scale, const RepairOptions& repair,
                       double& cpu_seconds, IntakeReport& report) {
  const std::string of_faces = " of " + counted(file.mesh.triangles.size(), "face", "faces");
  std::vector<Diagnostic> defects;  // for which the repair is made
  TriMesh offenders = file.mesh;
  std::string step = "the check" + of_faces;
  Repair kind = Repair::kNone;
  try {
    if (repair.kind != Repair::kWrap) {
      try {
        return in_time(step, cpu_seconds, report,
                       [&](IntakeReport& r) { return accept_surface(file, scale, r); });
      } catch (const SurfaceDefects& error) {
        if (repair.kind == Repair::kNone) throw;
        defects = error.diagnostics;
        for (Diagnostic& d : defects) d.hint.clear();  // it was taken
        offenders = error.offenders;
      }
    }
    kind = repair.kind;
    step = std::string("repair = \"") + name_of(kind) + "\"" + of_faces;
    return in_time(step, cpu_seconds, report,
                   [&](IntakeReport& r) { return accept_repaired(file, scale, repair, r); });
  } catch (const OutOfTime& error) {
    defects.push_back({{file.path, 0, 0}, error.what(), out_of_time_hint(kind)});
    throw SurfaceDefects(defects, offenders);
  }
}

std::vector<std::string> IntakeReport::notes() const {
  std::vector<std::string> lines;
  if (repair.kind != Repair::kNone) lines.push_back(repair.note());
  if (welded > 0)
    lines.push_back(counted(welded, "vertex", "vertices") + " welded to an equal one");
  if (unused > 0)
    lines.push_back(counted(unused, "vertex", "vertices") + " without a face dropped");
  if (collapsed > 0) {
    lines.push_back(counted(collapsed, "face", "faces") + " with a repeated corner dropped");
  }
  if (reoriented > 0) {
    lines.push_back(counted(reoriented, "face", "faces") +
                    " turned round to agree with the neighbours");
  }
  if (turned_inside_out) lines.push_back("the surface faced inward: turned inside out");
  if (cavities > 0) {
    std::ostringstream text;
    text << counted(cavities, "cavity", "cavities") << " of " << cavity_volume << " m^3 kept";
    lines.push_back(text.str());
  }
  return lines;
}

}  // namespace archetide
