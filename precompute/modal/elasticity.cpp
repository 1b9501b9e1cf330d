#include "precompute/modal/elasticity.h"

#include <algorithm>
#include <array>
#include <type_traits>
#include <utility>

#include "common/base/check.h"
#include "common/base/input_error.h"
#include "precompute/base/tet_element.h"

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

template <int N>
NodeGraph node_graph(const TetMesh& mesh) {
  const int n = int(mesh.nodes.size()), nt = int(mesh.tets.size());
  // Tets of every node, bucketed by counting.
  std::vector<int> first(n + 1, 0), tets_of(N * mesh.tets.size());
  for (int t = 0; t < nt; ++t)
    for (int node : element_nodes<N>(mesh, t)) ++first[node + 1];
  for (int i = 0; i < n; ++i) first[i + 1] += first[i];
  std::vector<int> fill(first.begin(), first.end() - 1);
  for (int t = 0; t < nt; ++t)
    for (int node : element_nodes<N>(mesh, t)) tets_of[fill[node]++] = t;

  // Their nodes, sorted and unique.
  NodeGraph graph;
  graph.start.assign(1, 0);
  graph.neighbours.reserve((N == 4 ? 16 : 30) * std::size_t(n));
  std::vector<int> seen(n, -1);
  for (int i = 0; i < n; ++i) {
    const auto begin = graph.neighbours.size();
    for (int k = first[i]; k < first[i + 1]; ++k)
      for (int j : element_nodes<N>(mesh, tets_of[k]))
        if (std::exchange(seen[j], i) != i) graph.neighbours.push_back(j);
    std::sort(graph.neighbours.begin() + std::ptrdiff_t(begin), graph.neighbours.end());
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

void require_material(const Material& m) {
  if (!(m.density > 0.0) || !(m.young > 0.0) || !(m.poisson > -1.0 && m.poisson < 0.5))
    throw InputError("the material needs density > 0, young > 0 and -1 < poisson < 0.5",
                     "nearly incompressible materials: use poisson = 0.49 at most");
}

/// Lame's constants, Pa.
struct Lame {
  double lambda, mu;
};
Lame lame(const Material& m) {
  return {m.young * m.poisson / ((1.0 + m.poisson) * (1.0 - 2.0 * m.poisson)),
          m.young / (2.0 * (1.0 + m.poisson))};
}

template <int N>
using NodePairs = Eigen::Matrix<double, N, N>;

/// Blocks of the element stiffness: ∫ λ g_p g_qᵀ + μ g_q g_pᵀ + μ (g_p·g_q) 1, p <= q only.
template <int N>
using PairBlocks = std::array<Mat3, N * N>;

// Eq. P1.
template <int N>
void element_stiffness(const Eigen::Matrix<double, 3, N>& x, const ShapeTable<N>& table,
                       const Lame& m, PairBlocks<N>& blocks) {
  // S_pq = ∫ g_p g_qᵀ holds all that is needed.
  for (Mat3& b : blocks) b.setZero();
  for (std::size_t k = 0; k < table.values.size(); ++k) {
    const Mat3 J = x * table.gradients[k].transpose();  // dx/dL
    const double w = table.rule.weights[k] * J.determinant();
    ARCHETIDE_CHECK_OP(w, >, 0.0);
    const Eigen::Matrix<double, 3, N> g = J.inverse().transpose() * table.gradients[k];
    const Eigen::Matrix<double, 3, N> wg = w * g;
    for (int q = 0; q < N; ++q)
      for (int p = 0; p <= q; ++p) blocks[p + N * q] += g.col(p) * wg.col(q).transpose();
  }
  for (int q = 0; q < N; ++q)
    for (int p = 0; p <= q; ++p) {
      const Mat3 S = blocks[p + N * q];
      Mat3& K = blocks[p + N * q];
      K = m.lambda * S + m.mu * S.transpose();
      K.diagonal().array() += m.mu * S.trace();
    }
}

/// Rules that integrate stiffness and mass on a straight tet exactly, and on a curved one well.
template <int N>
struct Rules {
  ShapeTable<N> stiffness, curved_stiffness, mass, curved_mass;
};
const Rules<4>& rules(std::integral_constant<int, 4>) {
  static const Rules<4> all{ShapeTable<4>(conical_rule(1)), ShapeTable<4>(conical_rule(1)),
                            ShapeTable<4>(four_point_rule()), ShapeTable<4>(four_point_rule())};
  return all;
}
const Rules<10>& rules(std::integral_constant<int, 10>) {
  // Mass: N N of degree 4, times the cubic Jacobian of a curved tet.
  static const Rules<10> all{ShapeTable<10>(four_point_rule()), ShapeTable<10>(conical_rule(3)),
                             ShapeTable<10>(conical_rule(3)), ShapeTable<10>(conical_rule(4))};
  return all;
}

/// Adds a 3 x 3 block at nodes (p, q) of a matrix with the graph's pattern.
void add_block(SparseMatrix& K, const NodeGraph& graph, int p, int q, const Mat3& block) {
  const int degree = 3 * graph.degree(q);
  double* column = K.valuePtr() + 9 * std::ptrdiff_t(graph.start[q]) + 3 * graph.slot(q, p);
  for (int b = 0; b < 3; ++b)
    for (int a = 0; a < 3; ++a) column[b * degree + a] += block(a, b);
}

template <int N>
SparseMatrix assemble_stiffness(const TetMesh& mesh, const MaterialField& material) {
  const NodeGraph graph = node_graph<N>(mesh);
  const Rules<N>& rule = rules(std::integral_constant<int, N>());
  SparseMatrix K = block_pattern(graph, 3);
  PairBlocks<N> blocks;
  for (int t = 0; t < int(mesh.tets.size()); ++t) {
    const std::array<int, N> nodes = element_nodes<N>(mesh, t);
    const auto x = element_positions<N>(mesh, nodes);
    element_stiffness<N>(x, is_straight(x) ? rule.stiffness : rule.curved_stiffness,
                         lame(material.at(t)), blocks);
    for (int q = 0; q < N; ++q)
      for (int p = 0; p <= q; ++p) {
        add_block(K, graph, nodes[p], nodes[q], blocks[p + N * q]);
        if (p < q) add_block(K, graph, nodes[q], nodes[p], blocks[p + N * q].transpose());
      }
  }
  return K;
}

/// ∫ N_p N_q over one tet of density 1.
template <int N>
NodePairs<N> element_mass(const Eigen::Matrix<double, 3, N>& x, const ShapeTable<N>& table) {
  NodePairs<N> m = NodePairs<N>::Zero();
  for (std::size_t k = 0; k < table.values.size(); ++k) {
    const Mat3 J = x * table.gradients[k].transpose();
    const double w = table.rule.weights[k] * J.determinant();
    ARCHETIDE_CHECK_OP(w, >, 0.0);
    m += w * table.values[k] * table.values[k].transpose();
  }
  return m;
}

template <int N>
SparseMatrix assemble_mass(const TetMesh& mesh, const MaterialField& material) {
  const NodeGraph graph = node_graph<N>(mesh);
  const Rules<N>& rule = rules(std::integral_constant<int, N>());
  // On straight tets it is always the same matrix, times the volume.
  const NodePairs<N> unit = 6.0 * element_mass<N>(reference_positions<N>(), rule.mass);
  SparseMatrix M = block_pattern(graph, 1);
  for (int t = 0; t < int(mesh.tets.size()); ++t) {
    const std::array<int, N> nodes = element_nodes<N>(mesh, t);
    const auto x = element_positions<N>(mesh, nodes);
    NodePairs<N> m;
    if (is_straight(x))
      m = tet_volume(mesh, t) * unit;
    else
      m = element_mass<N>(x, rule.curved_mass);
    m *= material.at(t).density;
    for (int q = 0; q < N; ++q)
      for (int p = 0; p < N; ++p)
        M.valuePtr()[graph.start[nodes[q]] + graph.slot(nodes[q], nodes[p])] +=
            p <= q ? m(p, q) : m(q, p);
  }
  return M;
}

SparseMatrix lumped_mass(const TetMesh& mesh, const MaterialField& material) {
  ARCHETIDE_CHECK_OP(mesh.order(), ==, 1);
  VecX diagonal = VecX::Zero(Eigen::Index(mesh.nodes.size()));
  for (int t = 0; t < int(mesh.tets.size()); ++t) {
    const double share = material.at(t).density * tet_volume(mesh, t) / 4.0;
    for (int node : mesh.tets[t]) diagonal[node] += share;
  }
  SparseMatrix M(diagonal.size(), diagonal.size());
  M = diagonal.asDiagonal();
  return M;
}

}  // namespace

SparseMatrix stiffness_matrix(const TetMesh& mesh, const MaterialField& material) {
  for (const Material& m : material.materials) require_material(m);
  return mesh.order() == 1 ? assemble_stiffness<4>(mesh, material)
                           : assemble_stiffness<10>(mesh, material);
}

// Eq. P2.
SparseMatrix mass_matrix(const TetMesh& mesh, const MaterialField& material, MassKind kind) {
  if (kind == MassKind::kLumped) return lumped_mass(mesh, material);
  return mesh.order() == 1 ? assemble_mass<4>(mesh, material) : assemble_mass<10>(mesh, material);
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

Vec3 move_to_centre_of_mass(TetMesh& mesh, const MaterialField& material) {
  Vec3 total = Vec3::Zero();
  // Twice: the second pass takes out the round-off of the first when the body is far from the
  // origin.
  for (int pass = 0; pass < 2; ++pass) {
    Vec3 moment = Vec3::Zero();  // kg m
    double mass = 0.0;           // kg
    for (int t = 0; t < int(mesh.tets.size()); ++t) {
      const TetMoments m = tet_moments(mesh, t);
      mass += material.at(t).density * m.volume;
      moment += material.at(t).density * m.first;
    }
    const Vec3 centre = moment / mass;
    for (Vec3& x : mesh.nodes) x -= centre;
    total += centre;
  }
  return total;
}

}  // namespace archetide
