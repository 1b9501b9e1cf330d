#include "precompute/modal/canonical_basis.h"

#include <cmath>

namespace archetide {
namespace {

constexpr int kDegree = 4;
constexpr double kGoodPart = 0.5;  // of the largest remaining projection
constexpr double kNothing = 1e-6;  // projection that is round-off, relative to the field

/// Monomials of degree 0 to kDegree at the nodes, n x 35, each of unit M-norm.
MatX monomials(const std::vector<Vec3>& nodes, const SparseMatrix& mass) {
  double size = 0.0;
  for (const Vec3& x : nodes) size = std::max(size, x.norm());
  std::vector<VecX> columns;
  const auto power = [](double x, int k) { return k == 0 ? 1.0 : std::pow(x, k); };
  for (int degree = 0; degree <= kDegree; ++degree)
    for (int i = degree; i >= 0; --i)
      for (int j = degree - i; j >= 0; --j) {
        VecX column(Eigen::Index(nodes.size()));
        for (std::size_t v = 0; v < nodes.size(); ++v) {
          const Vec3 y = nodes[v] / size;
          column[Eigen::Index(v)] = power(y[0], i) * power(y[1], j) * power(y[2], degree - i - j);
        }
        columns.push_back(column / std::sqrt(column.dot(mass * column)));
      }
  MatX result(Eigen::Index(nodes.size()), Eigen::Index(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) result.col(Eigen::Index(c)) = columns[c];
  return result;
}

/// Projections of the reference fields on the modes, m x (3 x 35): column 3 monomial + axis.
MatX projections(const MatX& weighted_monomials, const MatX& modes) {
  const Eigen::Index n = weighted_monomials.rows(), fields = weighted_monomials.cols();
  MatX result(modes.cols(), 3 * fields);
  for (Eigen::Index k = 0; k < modes.cols(); ++k) {
    const Eigen::Map<const MatX> mode(modes.col(k).data(), 3, n);
    const MatX along = mode * weighted_monomials;  // 3 x fields
    result.row(k) = along.reshaped().transpose();
  }
  return result;
}

/// Orthogonal matrix whose columns turn the modes into their canonical basis; see the header.
MatX rotation(MatX rest) {
  const Eigen::Index m = rest.rows();
  MatX Q = MatX::Zero(m, m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const double largest = rest.colwise().norm().maxCoeff();
    if (!(largest > kNothing)) return {};
    Eigen::Index c = 0;
    while (rest.col(c).norm() < kGoodPart * largest) ++c;
    Q.col(k) = rest.col(c).normalized();
    for (Eigen::Index j = 0; j < k; ++j) Q.col(k) -= Q.col(j).dot(Q.col(k)) * Q.col(j);
    Q.col(k).normalize();
    rest -= Q.col(k) * (Q.col(k).transpose() * rest);
  }
  return Q;
}

}  // namespace

void canonicalise_signs(MatX& modes) {
  for (Eigen::Index k = 0; k < modes.cols(); ++k) {
    // The first of the components that are largest up to round-off: symmetric modes have several.
    const double largest = modes.col(k).cwiseAbs().maxCoeff();
    Eigen::Index at = 0;
    while (std::abs(modes(at, k)) < (1.0 - 1e-6) * largest) ++at;
    if (modes(at, k) < 0.0) modes.col(k) *= -1.0;
  }
}

void canonicalise(const std::vector<Vec3>& nodes, const SparseMatrix& mass, const VecX& omega2,
                  MatX& modes) {
  MatX weighted;  // made when the first cluster is met
  for (Eigen::Index first = 0, next; first < modes.cols(); first = next) {
    for (next = first + 1; next < modes.cols(); ++next)
      if (omega2[next] > (1.0 + kEqualEigenvalues) * omega2[next - 1]) break;
    if (next - first == 1) continue;
    if (weighted.size() == 0) weighted = mass * monomials(nodes, mass);
    const MatX cluster = modes.middleCols(first, next - first);
    const MatX Q = rotation(projections(weighted, cluster));
    if (Q.size() > 0) modes.middleCols(first, next - first) = cluster * Q;
  }
  canonicalise_signs(modes);
}

}  // namespace archetide
