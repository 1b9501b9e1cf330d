#include "precompute/intake.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <sstream>

#include "common/input_error.h"
#include "precompute/surface_formats.h"
#include "precompute/surface_topology.h"

namespace archetide {
namespace {

constexpr std::size_t kNamed = 5;  // defects named with face and place; the rest are only counted
constexpr double kFlat =
    1e-6;  // V / A^(3/2) below which a surface counts as enclosing nothing (ball: 0.094)

/// A surface on its way in, with the file's face number of every triangle.
struct Candidate {
  const SurfaceFile& file;
  TriMesh mesh;
  std::vector<int> face_numbers;  // nf, 1-based
};

// ---- words ------------------------------------------------------------------------------------

std::string place(const Vec3& x) {
  std::ostringstream text;
  text.precision(6);
  text << "(" << x[0] << ", " << x[1] << ", " << x[2] << ")";
  return text.str();
}

std::string counted(std::size_t n, const std::string& one, const std::string& many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

std::string face(const Candidate& c, int t) { return "face " + std::to_string(c.face_numbers[t]); }

Vec3 middle(const TriMesh& mesh, int t) {
  const Vec3i& corners = mesh.triangles[t];
  return (mesh.vertices[corners[0]] + mesh.vertices[corners[1]] + mesh.vertices[corners[2]]) / 3.0;
}

/// "3 degenerate faces: face 4 at (..); face 9 at (..); ..."
template <class List, class Describe>
Diagnostic defect(const Candidate& c, const List& list, const std::string& name, Describe describe,
                  const std::string& hint) {
  std::string text = name + ": ";
  for (std::size_t i = 0; i < std::min(list.size(), kNamed); ++i) {
    text += (i ? "; " : "") + describe(list[i]);
  }
  if (list.size() > kNamed) text += "; ...";
  return {{c.file.path, 0, 0}, text, hint};
}

// ---- steps: collect_.. lists defects, demand_.. passes or throws ------------------------------

void demand_finite(const SurfaceFile& file) {
  std::vector<int> bad;
  for (int v = 0; v < static_cast<int>(file.mesh.vertices.size()); ++v) {
    if (!file.mesh.vertices[v].allFinite()) bad.push_back(v);
  }
  if (bad.empty()) return;
  const Candidate c{file, {}, {}};
  throw InputError({defect(
      c, bad, counted(bad.size(), "vertex", "vertices") + " with a coordinate that is not a number",
      [&](int v) {
        return "vertex " + std::to_string(v + 1) + " at " + place(file.mesh.vertices[v]);
      },
      "export the mesh again; NaN or infinity cannot be placed")});
}

/// One vertex for equal coordinates; triangles that lose a corner by it and vertices without a face
/// are dropped.
Candidate weld(const SurfaceFile& file, IntakeReport& report) {
  Candidate c{file, {}, {}};
  const auto key = [](const Vec3& x) {
    return std::array{x[0] + 0.0, x[1] + 0.0, x[2] + 0.0};
  };  // -0 is 0
  std::map<std::array<double, 3>, int> first_with;
  std::vector<int> same_as, number(file.mesh.vertices.size(), -1);
  for (int v = 0; v < static_cast<int>(file.mesh.vertices.size()); ++v) {
    const auto [found, is_new] = first_with.try_emplace(key(file.mesh.vertices[v]), v);
    same_as.push_back(found->second);
    if (!is_new) ++report.welded;
  }
  for (std::size_t t = 0; t < file.mesh.triangles.size(); ++t) {
    const Vec3i corners = file.mesh.triangles[t].unaryExpr([&](int v) { return same_as[v]; });
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
      ++report.collapsed;
      continue;
    }
    c.mesh.triangles.push_back(corners);
    c.face_numbers.push_back(file.face_numbers[t]);
    for (const int v : corners) number[v] = 0;
  }
  for (int v = 0; v < static_cast<int>(number.size()); ++v) {
    if (number[v] < 0) {
      if (same_as[v] == v) ++report.unused;
      continue;
    }
    number[v] = static_cast<int>(c.mesh.vertices.size());
    c.mesh.vertices.push_back(file.mesh.vertices[v]);
  }
  for (Vec3i& corners : c.mesh.triangles)
    corners = corners.unaryExpr([&](int v) { return number[v]; });
  if (c.mesh.triangles.empty()) refuse(file.path, 0, "all faces have repeated corners");
  return c;
}

void collect_improper_faces(const Candidate& c, std::vector<Diagnostic>& found) {
  std::vector<int> flat, repeated;
  std::map<std::array<int, 3>, int> seen;
  for (int t = 0; t < static_cast<int>(c.mesh.triangles.size()); ++t) {
    std::array<int, 3> key = {c.mesh.triangles[t][0], c.mesh.triangles[t][1],
                              c.mesh.triangles[t][2]};
    const Vec3 a = c.mesh.vertices[key[1]] - c.mesh.vertices[key[0]];
    const Vec3 b = c.mesh.vertices[key[2]] - c.mesh.vertices[key[0]];
    // Collinear to round-off: |a × b| of three exactly collinear doubles is at most a few ulp of
    // |a||b|.
    if (a.cross(b).norm() <= 1e-15 * a.norm() * b.norm()) flat.push_back(t);
    std::sort(key.begin(), key.end());
    if (!seen.try_emplace(key, t).second) repeated.push_back(t);
  }
  const auto where = [&](int t) { return face(c, t) + " at " + place(middle(c.mesh, t)); };
  if (!flat.empty()) {
    found.push_back(defect(c, flat,
                           counted(flat.size(), "degenerate face", "degenerate faces") +
                               " without area (three corners in a line)",
                           where, "collapse or dissolve them in the modelling program"));
  }
  if (!repeated.empty()) {
    found.push_back(defect(c, repeated,
                           counted(repeated.size(), "duplicate face", "duplicate faces"), where,
                           "delete the copies (an internal wall or a double surface)"));
  }
}

void collect_bad_edges(const Candidate& c, const std::vector<SurfaceEdge>& edges,
                       std::vector<Diagnostic>& found) {
  std::vector<const SurfaceEdge*> open, crowded;
  for (const SurfaceEdge& edge : edges) {
    if (edge.triangles.size() == 1) open.push_back(&edge);
    if (edge.triangles.size() > 2) crowded.push_back(&edge);
  }
  const auto where = [&](const SurfaceEdge* edge) {
    std::string faces;
    for (const int t : edge->triangles) faces += (faces.empty() ? "" : ", ") + face(c, t);
    return "edge " + place(c.mesh.vertices[edge->a]) + " - " + place(c.mesh.vertices[edge->b]) +
           " of " + faces;
  };
  if (!open.empty()) {
    found.push_back(defect(
        c, open, "the surface is open: " + counted(open.size(), "boundary edge", "boundary edges"),
        where, "fill the holes, or weld vertices that only nearly coincide"));
  }
  if (!crowded.empty()) {
    found.push_back(defect(c, crowded,
                           counted(crowded.size(), "non-manifold edge", "non-manifold edges") +
                               " with more than two faces",
                           where, "remove internal walls; two parts may not share an edge"));
  }
}

void demand_single_fans(const Candidate& c, const std::vector<SurfaceEdge>& edges) {
  const std::vector<int> pinched = pinched_vertices(c.mesh, edges);
  if (pinched.empty()) return;
  throw InputError({defect(
      c, pinched,
      counted(pinched.size(), "non-manifold vertex", "non-manifold vertices") +
          " where parts of the surface touch in a point",
      [&](int v) { return place(c.mesh.vertices[v]); },
      "separate the parts, or join them by faces")});
}

void orient(Candidate& c, const std::vector<SurfaceEdge>& edges, IntakeReport& report) {
  report.reoriented = orient_consistently(c.mesh, edges);
  if (report.reoriented >= 0) return;
  refuse(c.file.path, 0, "the surface has only one side (it is not orientable)",
         "a surface that bounds a body has an inside and an outside");
}

TriMesh shell_mesh(const Candidate& c, const std::vector<int>& shell, int s) {
  TriMesh part;
  part.vertices = c.mesh.vertices;
  for (std::size_t t = 0; t < shell.size(); ++t) {
    if (shell[t] == s) part.triangles.push_back(c.mesh.triangles[t]);
  }
  return part;
}

void demand_one_shell(const Candidate& c, const std::vector<SurfaceEdge>& edges) {
  int count = 0;
  const std::vector<int> shell = shells(c.mesh, edges, count);
  if (count == 1) return;
  std::vector<TriMesh> parts;
  for (int s = 0; s < std::min(count, 20); ++s) parts.push_back(shell_mesh(c, shell, s));

  // Which shell lies in which other one decides what to advise.
  std::string nested;
  std::vector<std::string> list;
  for (std::size_t s = 0; s < parts.size(); ++s) {
    const Vec3& x = parts[s].vertices[parts[s].triangles[0][0]];
    const int first = static_cast<int>(std::find(shell.begin(), shell.end(), static_cast<int>(s)) -
                                       shell.begin());
    std::string text = "shell " + std::to_string(s + 1) + " of " +
                       counted(parts[s].triangles.size(), "triangle", "triangles") + " from " +
                       face(c, first) + " at " + place(x);
    for (std::size_t o = 0; o < parts.size(); ++o) {
      if (o == s || std::abs(winding_number(parts[o], x)) < 0.5) continue;
      text += " inside shell " + std::to_string(o + 1);
      nested = " (nested shells, such as cavities, come later)";
    }
    list.push_back(text);
  }
  throw InputError({defect(
      c, list, std::to_string(count) + " separate shells" + nested,
      [](const std::string& s) { return s; },
      "a body is one closed surface: join the parts (boolean union), or give each its own body "
      "file")});
}

void turn_outward(Candidate& c, IntakeReport& report) {
  const double volume = enclosed_volume(c.mesh), area = surface_area(c.mesh);
  if (std::abs(volume) <= kFlat * std::pow(area, 1.5)) {
    std::ostringstream text;
    text << "the surface encloses no volume (" << volume << " with an area of " << area << ")";
    refuse(c.file.path, 0, text.str(), "give the body a thickness");
  }
  report.turned_inside_out = volume < 0;
  if (!report.turned_inside_out) return;
  for (Vec3i& t : c.mesh.triangles) std::swap(t[1], t[2]);
}

void demand_no_self_intersections(const Candidate& c) {
  const std::vector<std::pair<int, int>> pairs = self_intersections(c.mesh);
  if (pairs.empty()) return;
  throw InputError({defect(
      c, pairs,
      "the surface intersects itself: " +
          counted(pairs.size(), "pair of faces that cross", "pairs of faces that cross"),
      [&](const std::pair<int, int>& p) {
        return face(c, p.first) + " and " + face(c, p.second) + " near " +
               place(middle(c.mesh, p.first));
      },
      "repair it in the modelling program (boolean union, remesh)")});
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
}

}  // namespace

TriMesh accept_surface(const SurfaceFile& file, double scale, IntakeReport& report) {
  report = {};
  demand_finite(file);
  Candidate c = weld(file, report);
  const std::vector<SurfaceEdge> edges = surface_edges(c.mesh);
  std::vector<Diagnostic> found;
  collect_improper_faces(c, found);
  collect_bad_edges(c, edges, found);
  if (!found.empty()) throw InputError(found);
  demand_single_fans(c, edges);
  orient(c, edges, report);
  demand_one_shell(c, edges);
  turn_outward(c, report);
  demand_no_self_intersections(c);
  for (Vec3& x : c.mesh.vertices) x *= scale;
  measure(c.mesh, report);
  return std::move(c.mesh);
}

std::vector<std::string> IntakeReport::notes() const {
  std::vector<std::string> lines;
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
  return lines;
}

}  // namespace archetide
