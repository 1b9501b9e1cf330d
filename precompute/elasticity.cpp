#include "precompute/elasticity.h"

#include <algorithm>
#include <utility>

#include "common/check.h"
#include "common/input_error.h"

namespace archetide {
namespace {

/// Sorted neighbours (and itself) of every node: neighbours[start[i] .. start[i + 1]).
struct NodeGraph {
  std::vector<int> start, neighbours;

  /// Position of j among the neighbours of i.
  int slot(int i, int j) const {
    const auto first = neighbours.begin() + start[i], last = neighbours.begin() + start[i + 1];
    return int(std::lower_bound(first, last, j) - first);
  }
  int degree(int i) const { return start[i + 1] - start[i]; }
};

NodeGraph node_graph(const TetMesh& mesh) {
  const int n = int(mesh.nodes.size());
  // Tets of every node, bucketed by counting.
  std::vector<int> first(n + 1, 0), tets_of(4 * mesh.tets.size());
  for (const auto& tet : mesh.tets)
    for (int node : tet) ++first[node + 1];
  for (int i = 0; i < n; ++i) first[i + 1] += first[i];
  std::vector<int> fill(first.begin(), first.end() - 1);
  for (int t = 0; t < int(mesh.tets.size()); ++t)
    for (int node : mesh.tets[t]) tets_of[fill[node]++] = t;

  // Their nodes, sorted and unique.
  NodeGraph graph;
  graph.start.assign(1, 0);
  graph.neighbours.reserve(16 * std::size_t(n));
  std::vector<int> seen(n, -1);
  for (int i = 0; i < n; ++i) {
    const auto begin = graph.neighbours.size();
    for (int k = first[i]; k < first[i + 1]; ++k)
      for (int j : mesh.tets[tets_of[k]])
        if (std::exchange(seen[j], i) != i) graph.neighbours.push_back(j);
    std::sort(graph.neighbours.begin() + begin, graph.neighbours.end());
    graph.start.push_back(int(graph.neighbours.size()));
  }
  return graph;
}

/// Zero matrix of size (d n) x (d n) whose pattern is the graph in blocks of d x d.
SparseMatrix block_pattern(const NodeGraph& graph, int d) {
  const int n = int(graph.start.size()) - 1;
  SparseMatrix matrix(d * n, d * n);
  matrix.resizeNonZeros(Eigen::Index(d) * d * graph.neighbours.size());
  int* outer = matrix.outerIndexPtr();
  int* inner = matrix.innerIndexPtr();
  int at = 0;
  for (int j = 0; j < n; ++j)
    for (int b = 0; b < d; ++b) {
      outer[d * j + b] = at;
      for (int k = graph.start[j]; k < graph.start[j + 1]; ++k)
        for (int a = 0; a < d; ++a) inner[at++] = d * graph.neighbours[k] + a;
    }
  outer[d * n] = at;
  std::fill_n(matrix.valuePtr(), at, 0.0);
  return matrix;
}

struct TetShape {
  double volume;                          // m^3
  Eigen::Matrix<double, 3, 4> gradients;  // of the four hat functions, 1/m
};

/// Hat function gradients: rows of the inverse edge matrix; the first one balances the others.
TetShape tet_shape(const TetMesh& mesh, const std::array<int, 4>& tet) {
  Mat3 edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = mesh.nodes[tet[k + 1]] - mesh.nodes[tet[0]];
  TetShape shape;
  shape.volume = edges.determinant() / 6.0;
  ARCHETIDE_CHECK_OP(shape.volume, >, 0.0);
  shape.gradients.rightCols<3>() = edges.inverse().transpose();
  shape.gradients.col(0) = -shape.gradients.rightCols<3>().rowwise().sum();
  return shape;
}

void require_material(const Material& m) {
  if (!(m.density > 0.0) || !(m.young > 0.0) || !(m.poisson > -1.0 && m.poisson < 0.5))
    throw InputError("the material needs density > 0, young > 0 and -1 < poisson < 0.5",
                     "nearly incompressible materials: use poisson = 0.49 at most");
}

}  // namespace

SparseMatrix stiffness_matrix(const TetMesh& mesh, const Material& material) {
  require_material(material);
  const double E = material.young, nu = material.poisson;
  const double lambda = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));  // Pa
  const double mu = E / (2.0 * (1.0 + nu));                        // Pa
  const NodeGraph graph = node_graph(mesh);
  SparseMatrix K = block_pattern(graph, 3);
  double* values = K.valuePtr();
  for (const auto& tet : mesh.tets) {
    const TetShape shape = tet_shape(mesh, tet);
    for (int p = 0; p < 4; ++p)
      for (int q = 0; q < 4; ++q) {
        // K_pq = V (λ g_p g_qᵀ + μ g_q g_pᵀ + μ (g_p·g_q) 1)
        const Vec3 gp = shape.gradients.col(p), gq = shape.gradients.col(q);
        Mat3 block = shape.volume * (lambda * gp * gq.transpose() + mu * gq * gp.transpose());
        block.diagonal().array() += shape.volume * mu * gp.dot(gq);
        const int j = tet[q], degree = 3 * graph.degree(j);
        double* column = values + 9 * std::ptrdiff_t(graph.start[j]) + 3 * graph.slot(j, tet[p]);
        for (int b = 0; b < 3; ++b)
          for (int a = 0; a < 3; ++a) column[b * degree + a] += block(a, b);
      }
  }
  return K;
}

SparseMatrix mass_matrix(const TetMesh& mesh, double density, MassKind kind) {
  if (kind == MassKind::kLumped) {
    VecX diagonal = VecX::Zero(Eigen::Index(mesh.nodes.size()));
    for (const auto& tet : mesh.tets) {
      const double share = density * tet_shape(mesh, tet).volume / 4.0;
      for (int node : tet) diagonal[node] += share;
    }
    SparseMatrix M(diagonal.size(), diagonal.size());
    M = diagonal.asDiagonal();
    return M;
  }
  const NodeGraph graph = node_graph(mesh);
  SparseMatrix M = block_pattern(graph, 1);
  for (const auto& tet : mesh.tets) {
    const double share = density * tet_shape(mesh, tet).volume / 20.0;
    for (int p : tet)  // m_pq = ρ V / 20 (1 + δ_pq)
      for (int q : tet)
        M.valuePtr()[graph.start[q] + graph.slot(q, p)] += p == q ? 2 * share : share;
  }
  return M;
}

MatX apply_mass(const SparseMatrix& mass, const MatX& x) {
  ARCHETIDE_CHECK_OP(3 * mass.rows(), ==, x.rows());
  MatX y(x.rows(), x.cols());
  for (Eigen::Index c = 0; c < x.cols(); ++c) {
    const double* in = x.data() + c * x.rows();
    double* out = y.data() + c * x.rows();
    for (int j = 0; j < mass.outerSize(); ++j) {
      Vec3 sum = Vec3::Zero();
      for (SparseMatrix::InnerIterator m(mass, j); m; ++m)
        sum += m.value() * Eigen::Map<const Vec3>(in + 3 * m.row());
      Eigen::Map<Vec3>(out + 3 * j) = sum;
    }
  }
  return y;
}

Vec3 move_to_centre_of_mass(TetMesh& mesh) {
  Vec3 total = Vec3::Zero();
  // Twice: the second pass takes out the round-off of the first when the body is far from the
  // origin.
  for (int pass = 0; pass < 2; ++pass) {
    Vec3 moment = Vec3::Zero();  // m^4
    double volume = 0.0;         // m^3
    for (const auto& tet : mesh.tets) {
      const double v = tet_shape(mesh, tet).volume;
      volume += v;
      for (int node : tet) moment += v / 4.0 * mesh.nodes[node];
    }
    const Vec3 centre = moment / volume;
    for (Vec3& x : mesh.nodes) x -= centre;
    total += centre;
  }
  return total;
}

}  // namespace archetide
