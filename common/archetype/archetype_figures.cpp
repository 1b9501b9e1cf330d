#include "common/archetype/archetype_figures.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/axial.h"

namespace archetide {

std::vector<double> frequencies_hz(const Archetype& a) {
  std::vector<double> hz;
  for (const double w2 : a.omega2) hz.push_back(std::sqrt(w2) / (2 * std::numbers::pi));
  return hz;
}

std::string kind_of(const Archetype& a, int k) { return a.is_static[k] ? "static" : "mode"; }

std::optional<double> frequency_error(const Archetype& a, int k) {
  if (k >= a.frequency_error.size()) return {};
  return a.frequency_error[k];
}

Mat3 inertia(const Archetype& a) {
  return a.integrals.Sxx.trace() * Mat3::Identity() - a.integrals.Sxx;  // I = tr(S) 1 - S
}

Vec3 principal_moments(const Mat3& inertia) {
  return Eigen::SelfAdjointEigenSolver<Mat3>(inertia, Eigen::EigenvaluesOnly).eigenvalues();
}

SolidFigures solid_of_surface(const Archetype& a) {
  SolidFigures s;
  s.mass = a.density * enclosed_volume(a.surface);
  s.centre = enclosed_centroid(a.surface);
  const Mat3 S =
      a.density * enclosed_second_moment(a.surface) - s.mass * s.centre * s.centre.transpose();
  s.inertia = S.trace() * Mat3::Identity() - S;
  return s;
}

Orthogonality orthogonality(const Archetype& a) {
  Orthogonality o;
  if (a.r() == 0) return o;
  o.mass = (a.M_r - MatX::Identity(a.r(), a.r())).cwiseAbs().maxCoeff();
  for (int i = 0; i < a.r(); ++i) {
    o.translation = std::max(o.translation, a.integrals.I3[i].norm() / std::sqrt(a.integrals.mass));
    o.rotation =
        std::max(o.rotation, axial(a.integrals.A[i]).norm() / std::sqrt(inertia(a).trace()));
  }
  return o;
}

}  // namespace archetide
