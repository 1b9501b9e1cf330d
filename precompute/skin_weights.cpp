#include "precompute/skin_weights.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace archetide {
namespace {

using SparseMatrix = Eigen::SparseMatrix<double>;

/// M + h^2 L, an M-matrix.
SparseMatrix screened_laplacian(const TriMesh& mesh, const std::vector<double>& areas, double h) {
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t v = 0; v < areas.size(); ++v) entries.emplace_back(int(v), int(v), areas[v]);
  for (const Vec3i& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const int i = t[(k + 1) % 3], j = t[(k + 2) % 3];
      const Vec3 a = mesh.vertices[i] - mesh.vertices[t[k]],
                 b = mesh.vertices[j] - mesh.vertices[t[k]];
      // cot(angle) / 2, kept below that of one degree
      const double area = a.cross(b).norm();
      const double w = h * h * 0.5 * std::clamp(a.dot(b), 0.0, 57.0 * area) / area;
      if (!(w > 0.0)) continue;
      for (const auto& [row, column, value] :
           {std::tuple(i, i, w), std::tuple(j, j, w), std::tuple(i, j, -w), std::tuple(j, i, -w)})
        entries.emplace_back(row, column, value);
    }
  SparseMatrix A(int(areas.size()), int(areas.size()));
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

double smooth_step(double x) {
  const double t = std::clamp(x, 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace

void find_skin_weights(const std::vector<int>& owner, double blend, Skin& skin) {
  // Across a straight hand-over w = exp(-x / h) / 2: h takes it to kCut at half the blend's width.
  constexpr double kCut = 0.02;
  const double h = 0.5 * blend / std::log(0.5 / kCut);
  const auto n = static_cast<long>(owner.size());
  std::vector<Vec3> normals;
  std::vector<double> areas;
  vertex_normals_and_areas(skin.surface, normals, areas);
  const Eigen::SimplicialLDLT<SparseMatrix> factor(screened_laplacian(skin.surface, areas, h));

  const int parts = int(skin.parts.size());
  MatX weight(n, parts);
  for (int p = 0; p < parts; ++p) {
    VecX load(n);
    for (long v = 0; v < n; ++v) load[v] = owner[std::size_t(v)] == p ? areas[std::size_t(v)] : 0.0;
    weight.col(p) = factor.solve(load).unaryExpr(
        [](double w) { return smooth_step((w - kCut) / (1.0 - 2.0 * kCut)); });
  }

  skin.part_of.assign(std::size_t(n), {});
  skin.weights.assign(std::size_t(Skin::kMostParts * n), 0.0);
  const int kept = std::min(parts, Skin::kMostParts);
  std::vector<int> order(std::size_t(parts), 0);
  for (long v = 0; v < n; ++v) {
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(),
                     [&](int p, int q) { return weight(v, p) > weight(v, q); });
    double sum = 0.0;
    for (int k = 0; k < kept; ++k) sum += weight(v, order[std::size_t(k)]);
    for (int k = 0; k < kept; ++k) {
      const double w = weight(v, order[std::size_t(k)]) / sum;
      if (w > 0.0) skin.part_of[std::size_t(v)][std::size_t(k)] = order[std::size_t(k)];
      skin.weights[std::size_t(Skin::kMostParts * v + k)] = w;
    }
  }
}

}  // namespace archetide
