#include "common/archetype/elastic_cubature.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/archetype/elastic_volume.h"
#include "common/base/check.h"

namespace archetide {
namespace {

/// Of one point: F, row-wise by axis of the rest shape: f[3 c + a] = dx_a / dX_c.
using Entries = std::array<double, 9>;

/// cof F = dJ/dF: its columns are the cross products of the other two columns of F.
Entries cofactor(const Entries& f) {
  return {f[4] * f[8] - f[5] * f[7], f[5] * f[6] - f[3] * f[8], f[3] * f[7] - f[4] * f[6],
          f[7] * f[2] - f[8] * f[1], f[8] * f[0] - f[6] * f[2], f[6] * f[1] - f[7] * f[0],
          f[1] * f[5] - f[2] * f[4], f[2] * f[3] - f[0] * f[5], f[0] * f[4] - f[1] * f[3]};
}

double determinant(const Entries& f, const Entries& cof) {
  return f[0] * cof[0] + f[1] * cof[1] + f[2] * cof[2];
}

/// The change of cof F with F + g, at first order.
Entries cofactor_change(const Entries& f, const Entries& g) {
  return {f[4] * g[8] + g[4] * f[8] - f[5] * g[7] - g[5] * f[7],
          f[5] * g[6] + g[5] * f[6] - f[3] * g[8] - g[3] * f[8],
          f[3] * g[7] + g[3] * f[7] - f[4] * g[6] - g[4] * f[6],
          f[7] * g[2] + g[7] * f[2] - f[8] * g[1] - g[8] * f[1],
          f[8] * g[0] + g[8] * f[0] - f[6] * g[2] - g[6] * f[2],
          f[6] * g[1] + g[6] * f[1] - f[7] * g[0] - g[7] * f[0],
          f[1] * g[5] + g[1] * f[5] - f[2] * g[4] - g[2] * f[4],
          f[2] * g[3] + g[2] * f[3] - f[0] * g[5] - g[0] * f[5],
          f[0] * g[4] + g[0] * f[4] - f[1] * g[3] - g[1] * f[3]};
}

Entries entries(const double* F, Eigen::Index p, Eigen::Index P) {
  Entries f;
  for (int k = 0; k < 9; ++k) f[k] = F[k * P + p];
  return f;
}

}  // namespace

NeoHookean::Volumetric NeoHookean::volumetric(double lambda, double mu, double J) {
  const double at = std::max(J, kLeastVolume), over = J - at, square = 1.0 / (at * at);
  const double curvature = mu * square + 0.25 * lambda * (1.0 + 3.0 * square * square);
  const double h = -mu * std::log(at) + 0.125 * lambda * (at * at + square - 2.0);
  const double end = slope(lambda, mu, J);
  return {h + over * (end - 0.5 * over * curvature), end, curvature};
}

ElasticCubature::ElasticCubature(MatX g, VecX w, VecX l, VecX m)
    : gradients(std::move(g)), weights(std::move(w)), lambda(std::move(l)), mu(std::move(m)) {
  const Eigen::Index P = weights.size();
  ARCHETIDE_CHECK_OP(gradients.rows(), ==, 9 * P);
  ARCHETIDE_CHECK(lambda.size() == P && mu.size() == P);
  const VecX shear = weights.cwiseProduct(mu);
  shear_ = MatX::Zero(gradients.cols(), gradients.cols());
  for (int k = 0; k < 9; ++k) {
    const auto block = gradients.middleRows(k * P, P);
    shear_.noalias() += block.transpose() * shear.asDiagonal() * block;
  }
}

namespace {

// F = 1 + Σ q_i ∇φ_i of every pose: 9 P x k.
MatX deformation(const MatX& gradients, const Eigen::Ref<const MatX>& q) {
  const Eigen::Index P = gradients.rows() / 9;
  MatX F(9 * P, q.cols());
  for (Eigen::Index k = 0; k < q.cols(); ++k)
    F.col(k).noalias() = gradients.leftCols(q.rows()) * q.col(k);
  for (const int k : {0, 4, 8}) F.middleRows(k * P, P).array() += 1.0;
  return F;
}

// Of an energy Σ w h(J) by the J of every point, times w.
struct VolumetricLaw {
  double slope, curvature;
};

// K += Σ w (h''(J) (Gᵀ c)(Gᵀ c)ᵀ + h'(J) Gᵀ (dc/dF) G), c = cof F, the lower half. law(p, J): w h', w h''.
template <class Law>
void add_volumetric_stiffness(const MatX& gradients, const VecX& q, const Law& law, MatX& K) {
  constexpr Eigen::Index kChunk = 256;
  const Eigen::Index P = gradients.rows() / 9, r = q.size();
  const MatX F = deformation(gradients, q);
  for (Eigen::Index begin = 0; begin < P; begin += kChunk) {
    const Eigen::Index n = std::min(kChunk, P - begin);
    MatX change(9 * n, r);  // w d(h' c) of every vector
    std::array<std::array<double, kChunk>, 9> f, c;
    std::array<double, kChunk> slope, curvature;
    for (Eigen::Index i = 0; i < n; ++i) {
      const Entries at = entries(F.data(), begin + i, P), cof = cofactor(at);
      const VolumetricLaw h = law(begin + i, determinant(at, cof));
      slope[i] = h.slope, curvature[i] = h.curvature;
      for (int e = 0; e < 9; ++e) f[e][i] = at[e], c[e][i] = cof[e];
    }
    for (Eigen::Index j = 0; j < r; ++j) {
      const double* g0 = gradients.col(j).data() + begin;
      double* out = change.col(j).data();
#pragma omp simd
      for (Eigen::Index i = 0; i < n; ++i) {
        Entries at, g;
        for (int e = 0; e < 9; ++e) at[e] = f[e][i], g[e] = g0[e * P + i];
        const Entries turned = cofactor_change(at, g);
        double along = 0.0;
        for (int e = 0; e < 9; ++e) along += c[e][i] * g[e];
        for (int e = 0; e < 9; ++e)
          out[e * n + i] = curvature[i] * along * c[e][i] + slope[i] * turned[e];
      }
    }
    for (int e = 0; e < 9; ++e)
      K.triangularView<Eigen::Lower>() +=
          gradients.block(e * P + begin, 0, n, r).transpose() * change.middleRows(e * n, n);
  }
}

}  // namespace

double ElasticCubature::energy(const VecX& q) const {
  const Eigen::Index P = points();
  const MatX F = deformation(gradients, q);
  double sum = 0.0;
  for (Eigen::Index p = 0; p < P; ++p) {
    const Entries f = entries(F.data(), p, P);
    double square = -3.0;
    for (const double x : f) square += x * x;
    const double J = determinant(f, cofactor(f));
    sum += weights[p] * (0.5 * mu[p] * square + NeoHookean::volumetric(lambda[p], mu[p], J).h);
  }
  return sum;
}

// w P(F) of every pose, P(F) = μ F + h'(J) cof F: 9 P x k.
MatX ElasticCubature::stresses(const MatX& q) const {
  const Eigen::Index P = points();
  MatX F = deformation(gradients, q);
  for (Eigen::Index k = 0; k < F.cols(); ++k) {
    double* stress = F.data() + k * F.rows();
#pragma omp simd
    for (Eigen::Index p = 0; p < P; ++p) {
      const Entries f = entries(stress, p, P), cof = cofactor(f);
      const double slope = NeoHookean::slope(lambda[p], mu[p], determinant(f, cof));
      for (int e = 0; e < 9; ++e) stress[e * P + p] = weights[p] * (mu[p] * f[e] + slope * cof[e]);
    }
  }
  return F;
}

VecX ElasticCubature::force(const VecX& q) const {
  return gradients.leftCols(q.size()).transpose() * stresses(q);
}

MatX ElasticCubature::forces(const MatX& q) const {
  MatX f(q.rows(), q.cols());
  const MatX stress = stresses(q);
  for (Eigen::Index k = 0; k < q.cols(); ++k)
    f.col(k).noalias() = gradients.leftCols(q.rows()).transpose() * stress.col(k);
  return f;
}

MatX ElasticCubature::force_of_points(const VecX& q) const {
  const Eigen::Index P = points();
  const VecX stress = stresses(q);
  MatX f = MatX::Zero(q.size(), P);
  for (int e = 0; e < 9; ++e)
    f.noalias() +=
        gradients.block(e * P, 0, P, q.size()).transpose() * stress.segment(e * P, P).asDiagonal();
  return f;
}

// Σ w μ Gᵀ G, and what the volumetric part adds.
MatX ElasticCubature::stiffness(const VecX& q) const {
  MatX K = shear_.topLeftCorner(q.size(), q.size());
  const auto law = [&](Eigen::Index p, double J) -> VolumetricLaw {
    const auto h = NeoHookean::volumetric(lambda[p], mu[p], J);
    return {weights[p] * h.slope, weights[p] * h.curvature};
  };
  add_volumetric_stiffness(gradients, q, law, K);
  return K.selfadjointView<Eigen::Lower>();
}

ElasticVolume elastic_volume(const ElasticCubature& elastic, const VecX& q) {
  const Eigen::Index P = elastic.points();
  VecX F = deformation(elastic.gradients, q);
  double sum = 0.0;
  for (Eigen::Index p = 0; p < P; ++p) {
    const Entries f = entries(F.data(), p, P), cof = cofactor(f);
    sum += elastic.weights[p] * determinant(f, cof);
    for (int e = 0; e < 9; ++e) F[e * P + p] = elastic.weights[p] * cof[e];
  }
  return {sum, elastic.gradients.leftCols(q.size()).transpose() * F};
}

MatX elastic_volume_curvature(const ElasticCubature& elastic, const VecX& q) {
  MatX K = MatX::Zero(q.size(), q.size());
  const auto law = [&](Eigen::Index p, double) { return VolumetricLaw{elastic.weights[p], 0.0}; };
  add_volumetric_stiffness(elastic.gradients, q, law, K);
  return K.selfadjointView<Eigen::Lower>();
}

VecX ElasticCubature::volumes(const VecX& q) const {
  const Eigen::Index P = points();
  const MatX F = deformation(gradients, q);
  VecX J(P);
  for (Eigen::Index p = 0; p < P; ++p) {
    const Entries f = entries(F.data(), p, P);
    J[p] = determinant(f, cofactor(f));
  }
  return J;
}

}  // namespace archetide
