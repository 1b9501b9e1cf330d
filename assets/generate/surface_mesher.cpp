#include "assets/generate/surface_mesher.h"

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace archetide {
namespace {

constexpr double kTieMargin = 1e-6;  // relative; symmetric ties must not hang on round-off
constexpr int kSmoothingRounds = 8, kSmoothingStepsPerRound = 3;

using Edge = std::pair<int, int>;  // vertex indices, ascending

Edge edge_of(int a, int b) { return a < b ? Edge(a, b) : Edge(b, a); }

/// The shape's values on the nodes of a grid and the dual vertex of every cell that the surface
/// crosses.
class DualGrid {
 public:
  explicit DualGrid(const Shape& shape) : shape_(shape) {
    for (int a = 0; a < 3; ++a)
      nodes_[a] = int(std::ceil((shape.high[a] - shape.low[a]) / shape.cell)) + 1;
    values_.resize(std::size_t(nodes_.prod()));
    for (int k = 0; k < nodes_.z(); ++k)
      for (int j = 0; j < nodes_.y(); ++j)
        for (int i = 0; i < nodes_.x(); ++i)
          values_[index(Vec3i(i, j, k))] = shape.value(position(Vec3i(i, j, k)));
    dual_.assign(values_.size(), -1);
  }

  TriMesh polygons() {
    TriMesh mesh;
    for_each_node([&](const Vec3i& cell) { place_vertex(cell, mesh); });
    for_each_node([&](const Vec3i& node) {
      for (int axis = 0; axis < 3; ++axis) add_quad(node, axis, mesh);
    });
    return mesh;
  }

 private:
  template <class Visit>
  void for_each_node(Visit visit) const {
    for (int k = 1; k + 1 < nodes_.z(); ++k)
      for (int j = 1; j + 1 < nodes_.y(); ++j)
        for (int i = 1; i + 1 < nodes_.x(); ++i) visit(Vec3i(i, j, k));
  }
  std::size_t index(const Vec3i& n) const {
    return n.x() + std::size_t(nodes_.x()) * (n.y() + std::size_t(nodes_.y()) * n.z());
  }
  Vec3 position(const Vec3i& n) const { return shape_.low + shape_.cell * n.cast<double>(); }
  double value(const Vec3i& n) const { return values_[index(n)]; }
  bool inside(const Vec3i& n) const { return value(n) < 0.0; }

  /// The mean of the surface's crossings of the cell's twelve edges, moved onto the surface.
  void place_vertex(const Vec3i& cell, TriMesh& mesh) {
    Vec3 sum = Vec3::Zero();
    int crossings = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (int corner = 0; corner < 4; ++corner) {
        const Vec3i from = cell + (corner & 1) * Vec3i::Unit((axis + 1) % 3) +
                           (corner >> 1) * Vec3i::Unit((axis + 2) % 3);
        const Vec3i to = from + Vec3i::Unit(axis);
        if (inside(from) == inside(to)) continue;
        const double t = value(from) / (value(from) - value(to));
        sum += (1.0 - t) * position(from) + t * position(to);
        ++crossings;
      }
    if (crossings == 0) return;
    dual_[index(cell)] = int(mesh.vertices.size());
    mesh.vertices.push_back(project(shape_, sum / crossings));
  }

  /// The dual quad of a grid edge that the surface crosses, as two triangles along its shorter
  /// diagonal.
  void add_quad(const Vec3i& node, int axis, TriMesh& mesh) const {
    const Vec3i end = node + Vec3i::Unit(axis);
    if (inside(node) == inside(end)) return;
    const Vec3i u = Vec3i::Unit((axis + 1) % 3), v = Vec3i::Unit((axis + 2) % 3);
    std::array<int, 4> q = {dual_[index(node - u - v)], dual_[index(node - v)], dual_[index(node)],
                            dual_[index(node - u)]};
    if (!inside(node)) std::swap(q[1], q[3]);
    const auto& x = mesh.vertices;
    const double first = (x[q[2]] - x[q[0]]).norm(), second = (x[q[3]] - x[q[1]]).norm();
    if (second < first * (1.0 - kTieMargin)) q = {q[1], q[2], q[3], q[0]};
    mesh.triangles.emplace_back(q[0], q[1], q[2]);
    mesh.triangles.emplace_back(q[0], q[2], q[3]);
  }

  const Shape& shape_;
  Vec3i nodes_;
  std::vector<double> values_;  // one per node, m
  std::vector<int> dual_;       // vertex of the cell whose lowest corner is the node, or -1
};

Vec3 normal(const TriMesh& mesh, const Vec3i& t) {
  const auto& x = mesh.vertices;
  return (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]).normalized();
}

double angle_at(const Vec3& corner, const Vec3& a, const Vec3& b) {
  return std::atan2((a - corner).cross(b - corner).norm(), (a - corner).dot(b - corner));
}

/// The corner of t that is neither a nor b, as a position 0..2.
int opposite_corner(const Vec3i& t, const Edge& edge) {
  for (int c = 0; c < 3; ++c)
    if (t[c] != edge.first && t[c] != edge.second) return c;
  return -1;
}

/// Flips every edge whose opposite angles sum to more than pi; one pass, each triangle at most
/// once.
void flip_edges(TriMesh& mesh) {
  std::map<Edge, std::vector<int>> triangles_of;
  for (int t = 0; t < int(mesh.triangles.size()); ++t)
    for (int c = 0; c < 3; ++c)
      triangles_of[edge_of(mesh.triangles[t][c], mesh.triangles[t][(c + 1) % 3])].push_back(t);

  const auto& x = mesh.vertices;
  std::vector<bool> touched(mesh.triangles.size(), false);
  std::map<Edge, bool> added;
  for (const auto& [edge, pair] : triangles_of) {
    if (pair.size() != 2 || touched[pair[0]] || touched[pair[1]]) continue;
    Vec3i &s = mesh.triangles[pair[0]], &t = mesh.triangles[pair[1]];
    const int c = opposite_corner(s, edge);
    const int p = s[c], a = s[(c + 1) % 3], b = s[(c + 2) % 3], q = t[opposite_corner(t, edge)];
    const Edge diagonal = edge_of(p, q);
    if (triangles_of.count(diagonal) || added.count(diagonal)) continue;
    if (angle_at(x[p], x[a], x[b]) + angle_at(x[q], x[a], x[b]) < std::numbers::pi + 1e-3) continue;
    const Vec3i new_s(p, a, q), new_t(p, q, b);
    if (normal(mesh, new_s).dot(normal(mesh, new_t)) < 0.8) continue;
    s = new_s;
    t = new_t;
    touched[pair[0]] = touched[pair[1]] = true;
    added[diagonal] = true;
  }
}

/// Moves every vertex half-way to the mean of its neighbours along the surface.
void smooth(const Shape& shape, TriMesh& mesh) {
  std::vector<Vec3> sum(mesh.vertices.size(), Vec3::Zero());
  std::vector<int> count(mesh.vertices.size(), 0);
  for (const Vec3i& t : mesh.triangles)
    for (int c = 0; c < 3; ++c) {
      sum[t[c]] += mesh.vertices[t[(c + 1) % 3]];
      ++count[t[c]];
    }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    Vec3& x = mesh.vertices[v];
    const Vec3 up = gradient(shape, x).normalized();
    const Vec3 step = 0.5 * (sum[v] / count[v] - x);
    x = project(shape, x + step - step.dot(up) * up);
  }
}

}  // namespace

TriMesh mesh_surface(const Shape& shape) {
  TriMesh mesh = DualGrid(shape).polygons();
  for (int round = 0; round < kSmoothingRounds; ++round) {
    flip_edges(mesh);
    for (int step = 0; step < kSmoothingStepsPerRound; ++step) smooth(shape, mesh);
  }
  flip_edges(mesh);
  return mesh;
}

}  // namespace archetide
