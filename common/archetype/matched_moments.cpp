#include "common/archetype/matched_moments.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <vector>

#include "common/base/axial.h"

namespace archetide {

Mat3 matching_stretch(const Mat3& S, const Mat3& wanted) {
  const Eigen::SelfAdjointEigenSolver<Mat3> of_S(S);
  const Mat3 root = of_S.operatorSqrt(), inverse_root = of_S.operatorInverseSqrt();
  const Mat3 between = Eigen::SelfAdjointEigenSolver<Mat3>(root * wanted * root).operatorSqrt();
  return inverse_root * between * inverse_root;
}

void match_moments(const Mat3& Sxx, MomentumIntegrals& of) {
  const Mat3 stretch = matching_stretch(of.Sxx, Sxx);
  const Mat3 to_spin = (Sxx.trace() * Mat3::Identity() - Sxx).inverse();
  of.Sxx = Sxx;
  const std::size_t r = of.A.size();
  std::vector<Mat3> spin(r);  // [w_i], w_i = I^-1 sum m Sigma x x phi_i
  for (std::size_t i = 0; i < r; ++i) {
    of.A[i] = (stretch * of.A[i]).eval();
    spin[i] = skew(to_spin * axial(of.A[i]));
  }
  for (std::size_t i = 0; i < r; ++i)
    for (std::size_t j = 0; j < r; ++j)
      of.B[i * r + j] += spin[i] * Sxx * spin[j].transpose() - spin[i] * of.A[j] -
                         of.A[i].transpose() * spin[j].transpose();
  for (std::size_t i = 0; i < r; ++i) of.A[i] -= Sxx * spin[i].transpose();
}

}  // namespace archetide
