#include "precompute/meshing/quality.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <sstream>
#include <tuple>
#include <vector>

#include "precompute/base/defects.h"
#include "precompute/base/tet_element.h"

namespace archetide {
namespace {

using Face = std::array<int, 3>;
constexpr int kFaces[4][3] = {
    {1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};  // outward, opposite node k

struct TetNumbers {
  double volume, min_dihedral, radius_ratio;
};

TetNumbers tet_numbers(const TetMesh& mesh, const std::array<int, 4>& tet) {
  std::array<Vec3, 4> x;
  for (int k = 0; k < 4; ++k) x[k] = mesh.nodes[tet[k]];
  const Vec3 a = x[1] - x[0], b = x[2] - x[0], c = x[3] - x[0];
  const double volume = a.cross(b).dot(c) / 6.0;

  std::array<Vec3, 4> normals;  // outward, length 2 x face area
  double area = 0.0;
  for (int k = 0; k < 4; ++k) {
    const Vec3 p = x[kFaces[k][0]];
    normals[k] = (x[kFaces[k][1]] - p).cross(x[kFaces[k][2]] - p);
    area += normals[k].norm() / 2.0;
  }
  // The dihedral angle between two faces is pi minus the angle between their normals.
  double widest = -1.0;  // largest cosine of a dihedral angle
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j)
      widest = std::max(widest, -normals[i].dot(normals[j]) /
                                    std::max(normals[i].norm() * normals[j].norm(), 1e-300));
  // Circumradius from R = |a² b×c + b² c×a + c² a×b| / 12 V, inradius = 3 V / area.
  const Vec3 top =
      a.squaredNorm() * b.cross(c) + b.squaredNorm() * c.cross(a) + c.squaredNorm() * a.cross(b);
  const double ratio = 108.0 * volume * volume / std::max(area * top.norm(), 1e-300);
  return {volume, std::acos(std::min(widest, 1.0)) * 180.0 / std::numbers::pi,
          volume > 0.0 ? ratio : 0.0};
}

Face sorted(Face f) {
  std::sort(f.begin(), f.end());
  return f;
}

/// A face with the tet that it belongs to; equal faces become neighbours once sorted.
struct OwnedFace {
  Face face;
  int tet;
  bool operator<(const OwnedFace& o) const { return std::tie(face, tet) < std::tie(o.face, o.tet); }
};

int find_root(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

/// A boundary edge with the corners (3 triangle + place) of one triangle at its ends.
struct BoundaryEdge {
  std::array<int, 2> ends;
  std::array<int, 2> corners;
  bool operator<(const BoundaryEdge& o) const {
    return std::tie(ends, corners) < std::tie(o.ends, o.corners);
  }
};

/// Parts of the boundary that are connected across its edges.
void count_shells(const std::vector<BoundaryEdge>& edges, std::size_t triangles, TetQuality& q) {
  std::vector<int> parent(triangles);
  std::iota(parent.begin(), parent.end(), 0);
  q.shells = int(triangles);
  for (std::size_t i = 1; i < edges.size(); ++i) {
    if (edges[i].ends != edges[i - 1].ends) continue;
    const int a = find_root(parent, edges[i].corners[0] / 3),
              b = find_root(parent, edges[i - 1].corners[0] / 3);
    q.shells -= a != b;
    parent[a] = b;
  }
}

/// Boundary edges without exactly two boundary triangles, and boundary nodes at which several fans
/// meet.
void measure_boundary(const std::vector<Face>& boundary, TetQuality& q) {
  std::vector<BoundaryEdge> edges;
  std::vector<int> fan(3 * boundary.size());  // union-find over corners
  for (int c = 0; c < int(fan.size()); ++c) {
    fan[c] = c;
    const int next = c % 3 == 2 ? c - 2 : c + 1;
    const int a = boundary[c / 3][c % 3], b = boundary[next / 3][next % 3];
    edges.push_back(a < b ? BoundaryEdge{{a, b}, {c, next}} : BoundaryEdge{{b, a}, {next, c}});
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0, next; i < edges.size(); i = next) {
    for (next = i; next < edges.size() && edges[next].ends == edges[i].ends;) ++next;
    q.nonmanifold_edges += next - i != 2;
    for (int end = 0; next - i == 2 && end < 2; ++end)
      fan[find_root(fan, edges[i].corners[end])] = find_root(fan, edges[i + 1].corners[end]);
  }
  count_shells(edges, boundary.size(), q);
  std::vector<int> fans(q.nodes, 0);
  for (int c = 0; c < int(fan.size()); ++c) fans[boundary[c / 3][c % 3]] += fan[c] == c;
  q.nonmanifold_nodes = int(std::count_if(fans.begin(), fans.end(), [](int f) { return f > 1; }));
}

/// Faces, boundary edges and components from the sorted list of all faces.
void measure_topology(const TetMesh& mesh, TetQuality& q) {
  std::vector<OwnedFace> faces;
  faces.reserve(4 * mesh.tets.size());
  for (int t = 0; t < q.tets; ++t)
    for (const auto& f : kFaces)
      faces.push_back({sorted({mesh.tets[t][f[0]], mesh.tets[t][f[1]], mesh.tets[t][f[2]]}), t});
  std::sort(faces.begin(), faces.end());

  std::vector<int> parent(q.tets);
  for (int t = 0; t < q.tets; ++t) parent[t] = t;
  q.components = q.tets;
  std::vector<Face> boundary;
  for (std::size_t i = 0, next; i < faces.size(); i = next) {
    for (next = i + 1; next < faces.size() && faces[next].face == faces[i].face; ++next) {
      const int a = find_root(parent, faces[i].tet), b = find_root(parent, faces[next].tet);
      q.components -= a != b;
      parent[a] = b;
    }
    if (next - i == 1) boundary.push_back(faces[i].face);
    q.nonmanifold_faces += next - i > 2;
  }
  measure_boundary(boundary, q);
}

constexpr std::size_t kNamed = 5;  // bad tets named with their places; the rest are only counted

Vec3 middle(const TetMesh& mesh, int t) {
  Vec3 sum = Vec3::Zero();
  for (const int node : mesh.tets[t]) sum += mesh.nodes[node];
  return sum / 4.0;
}

TriMesh faces_of(const TetMesh& mesh, const std::vector<int>& tets) {
  TriMesh faces;
  for (const int t : tets) {
    for (const auto& f : kFaces)
      faces.triangles.emplace_back(int(faces.vertices.size()) + f[0],
                                   int(faces.vertices.size()) + f[1],
                                   int(faces.vertices.size()) + f[2]);
    for (const int node : mesh.tets[t]) faces.vertices.push_back(mesh.nodes[node]);
  }
  return faces;
}

}  // namespace

TetQuality measure_quality(const TetMesh& mesh, double surface_volume, int surface_shells) {
  TetQuality q;
  q.nodes = int(mesh.nodes.size());
  q.tets = int(mesh.tets.size());
  q.min_dihedral = 180.0;
  q.min_radius_ratio = 1.0;
  std::vector<char> used(mesh.nodes.size(), 0);
  for (int t = 0; t < q.tets; ++t) {
    const TetNumbers numbers = tet_numbers(mesh, mesh.tets[t]);
    q.volume += mesh.order() == 1 ? numbers.volume : tet_moments(mesh, t).volume;
    q.inverted += !(numbers.volume > 0.0);
    if (numbers.min_dihedral < q.min_dihedral || q.min_dihedral_tet < 0)
      q.min_dihedral = numbers.min_dihedral, q.min_dihedral_tet = t;
    if (numbers.radius_ratio < q.min_radius_ratio || q.min_radius_ratio_tet < 0)
      q.min_radius_ratio = numbers.radius_ratio, q.min_radius_ratio_tet = t;
    for (int node : mesh.tets[t]) used[node] = 1;
  }
  for (const auto& mids : mesh.mids)
    for (int node : mids) used[node] = 1;
  q.unused_nodes = int(std::count(used.begin(), used.end(), 0));
  measure_topology(mesh, q);
  q.surface_shells = surface_shells;
  q.surface_volume = std::max(surface_volume, 0.0);
  if (surface_volume > 0.0) q.volume_error = (q.volume - surface_volume) / surface_volume;
  return q;
}

std::vector<int> bad_tets(const TetMesh& mesh, const QualityLimits& limits) {
  std::vector<int> bad;
  for (int t = 0; t < int(mesh.tets.size()); ++t) {
    const TetNumbers numbers = tet_numbers(mesh, mesh.tets[t]);
    if (numbers.min_dihedral < limits.min_dihedral ||
        numbers.radius_ratio < limits.min_radius_ratio || !(numbers.volume > 0.0))
      bad.push_back(t);
  }
  return bad;
}

std::string quality_complaints(const TetQuality& q, const QualityLimits& limits) {
  std::ostringstream text;
  const auto complain = [&text]() -> std::ostream& {
    return text << (text.tellp() > 0 ? "; " : "");
  };
  if (q.tets == 0) complain() << "no tets";
  if (q.inverted > 0) complain() << q.inverted << " inverted or flat tets";
  if (q.min_dihedral < limits.min_dihedral)
    complain() << "smallest dihedral angle " << q.min_dihedral << " degrees at tet "
               << q.min_dihedral_tet << " (limit " << limits.min_dihedral << ")";
  if (q.min_radius_ratio < limits.min_radius_ratio)
    complain() << "smallest radius ratio " << q.min_radius_ratio << " at tet "
               << q.min_radius_ratio_tet << " (limit " << limits.min_radius_ratio << ")";
  if (q.nonmanifold_faces > 0) complain() << q.nonmanifold_faces << " faces in more than two tets";
  if (q.nonmanifold_edges > 0)
    complain() << q.nonmanifold_edges << " boundary edges without exactly two triangles";
  if (q.nonmanifold_nodes > 0) complain() << q.nonmanifold_nodes << " pinched boundary nodes";
  if (q.unused_nodes > 0) complain() << q.unused_nodes << " nodes that no tet uses";
  if (q.components > 1) complain() << q.components << " parts that are not connected";
  if (q.surface_shells > 0 && q.shells != q.surface_shells)
    complain() << q.shells << " boundary shells where the surface has " << q.surface_shells
               << " (a cavity smaller than the tets?)";
  if (std::abs(q.volume_error) > limits.max_volume_error)
    complain() << "volume off by " << 100.0 * q.volume_error << " % (limit "
               << 100.0 * limits.max_volume_error << " %)";
  return text.str();
}

std::vector<TetMeasure> tet_measures(const TetMesh& mesh) {
  std::vector<TetMeasure> shapes;
  for (const auto& tet : mesh.tets) {
    const TetNumbers numbers = tet_numbers(mesh, tet);
    shapes.push_back({numbers.min_dihedral, numbers.radius_ratio});
  }
  return shapes;
}

void require_quality(const TetMesh& mesh, const TetQuality& quality, const QualityLimits& limits,
                     const std::string& mesher, const std::string& hint) {
  const std::string complaints = quality_complaints(quality, limits);
  if (complaints.empty()) return;
  const std::vector<int> bad = bad_tets(mesh, limits);
  std::string text = "the tets of mesher " + mesher + " fail the quality gate: " + complaints;
  if (!bad.empty()) text += "; " + counted(bad.size(), "bad tet: ", "bad tets: ");
  for (std::size_t i = 0; i < std::min(bad.size(), kNamed); ++i)
    text += fmt::format("{}{} at {}", i ? "; tet " : "tet ", bad[i], place(middle(mesh, bad[i])));
  if (bad.size() > kNamed) text += "; ...";
  throw TetDefects(text + (hint.empty() ? "" : "\n  " + hint), faces_of(mesh, bad));
}

}  // namespace archetide
