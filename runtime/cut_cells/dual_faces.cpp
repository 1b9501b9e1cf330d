#include "runtime/cut_cells/dual_faces.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <span>

#include "runtime/fluid/cell_list.h"

namespace archetide {
namespace {

// Largest |s| / w; a sphere of radius a has kappa dx A / 20 = 0.05 dx / a, a body within a cell
// 0.1.
constexpr double kMostSlip = 0.25;

// Velocity of the wall at the face along its axis per unit y, 6 + r. Spin and modes: its normal
// velocity in the two cells, F / A, along the axis, which is all of it where n = axis.
template <class Column>
void face_velocity(const Grid& g, const DualFace& f, const MatX& flux, Column&& Q) {
  const double scale = 0.5 * f.n_over_A / (g.dx * g.dx);
  Q = scale * (flux.col(f.low) + flux.col(f.high));
  Q.template head<3>() = Vec3::Unit(f.axis);
}

// Of some faces: sum of volume Q Q^T and of what slips.
MatX carried_by_some(const Grid& g, std::span<const DualFace> faces, const PlacedInnerFlow& inner,
                     const MatX& flux) {
  const auto count = static_cast<Eigen::Index>(faces.size());
  MatX Q = MatX::Zero(flux.rows(), 3 * count);  // wall, inner flow, its strain
  VecX volume = VecX::Zero(3 * count), whole, strain;
  for (Eigen::Index n = 0; n < count; ++n) {
    const DualFace& f = faces[n];
    if (!f.wet) continue;
    face_velocity(g, f, flux, Q.col(3 * n));
    volume[3 * n] = f.volume;
    if (f.slip == 0.0) continue;
    inner.at(g.face_centre(f.axis, f.face[0], f.face[1], f.face[2]), f.axis, whole, strain);
    Q.col(3 * n + 1) = whole, Q.col(3 * n + 2) = strain;
    volume[3 * n + 1] = volume[3 * n + 2] = f.slip;
  }
  return Q * volume.asDiagonal() * Q.transpose();
}

}  // namespace

// Eq. C6.
void bound_slip(double volume, std::vector<DualFace>& faces) {
  constexpr double kMost = 0.1;
  Vec3 total = Vec3::Zero();
  for (const DualFace& f : faces) total[f.axis] += std::max(f.curvature, 0.0);
  const double most = total.maxCoeff();
  if (most <= kMost * volume) return;
  for (DualFace& f : faces) f.curvature *= kMost * volume / most;
}

void share_dual_faces(const Array3<CellKind>& kind, const FaceField<double>& open,
                      std::vector<DualFace>& faces, FaceField<double>& weight) {
  const auto unknown = [&](const Vec3i& c) { return kind(c[0], c[1], c[2]) == CellKind::kUnknown; };
#pragma omp parallel for schedule(static) if (faces.size() > kParallelFrom)
  for (DualFace& f : faces) {  // each its own entry of `weight`
    const bool low = unknown(f.face - Vec3i::Unit(f.axis)), high = unknown(f.face);
    const double w = open[f.axis](f.face[0], f.face[1], f.face[2]);
    f.wet = w == 0.0 ? f.closed && (low || high) : low && high;
    f.slip = f.wet ? std::clamp(f.curvature, -kMostSlip * w, kMostSlip * w) : 0.0;
    weight[f.axis](f.face[0], f.face[1], f.face[2]) -= f.slip;
  }
}

// Eq. C7.
MatX carried_water(const Grid& g, const std::vector<DualFace>& faces, double density,
                   const PlacedInnerFlow& inner, BodyFlux& flux) {
  MatX mass = MatX::Zero(flux.flux.rows(), flux.flux.rows());
  for (const MatX& part : parts_of(faces, [&](std::span<const DualFace> some) {
         return carried_by_some(g, some, inner, flux.flux);
       }))
    mass += part;
  const double area = g.dx * g.dx;
  VecX whole, strain;
  for (const DualFace& f : faces) {
    if (f.slip == 0.0) continue;
    inner.at(g.face_centre(f.axis, f.face[0], f.face[1], f.face[2]), f.axis, whole, strain);
    flux.flux.col(f.low) -= area * f.slip * whole;
    flux.flux.col(f.high) += area * f.slip * whole;
  }
  return density * g.dx * g.dx * g.dx * mass;
}

void bound_carried_water(const MatX& H, MatX& carried) {
  constexpr double kLeast = -0.2;  // eigenvalue of H^-1 M
  const Eigen::LLT<MatX> factor(H);
  const auto L = factor.matrixL();
  const MatX scaled = L.solve(L.solve(carried).transpose());  // L^-1 M L^-T
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(scaled);
  if (eigen.eigenvalues()[0] >= kLeast) return;
  const MatX V = L * eigen.eigenvectors();
  carried = V * eigen.eigenvalues().cwiseMax(kLeast).asDiagonal() * V.transpose();
}

}  // namespace archetide
