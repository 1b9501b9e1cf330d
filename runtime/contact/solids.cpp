#include "runtime/contact/solids.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/LU>

#include "common/base/axial.h"
#include "common/base/check.h"
#include "common/mesh/mesh_sdf.h"

namespace archetide {
namespace {

// Slopes of the distance that are used: below one where it is rounded at edges and ridges,
// above where the body is compressed.
constexpr double kLeastSlope = 0.5, kLargestSlope = 2.0;

/// Gradient by central differences over a cell: continuous, unlike that of the interpolant.
Vec3 smooth_gradient(const GridSdf& sdf, const Vec3& x) {
  Vec3 g;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 h = 0.5 * sdf.spacing * Vec3::Unit(axis);
    g[axis] = (sdf.value(x + h) - sdf.value(x - h)) / sdf.spacing;
  }
  return g;
}

/// Gap and normal where a place X of the rest shape now is: grad_x phi(X(x)) = back grad phi, with
/// `back` the inverse transpose of dx/dX without the scale. False if the gap exceeds `within`.
bool gap_at(const GridSdf& sdf, const Vec3& place, double scale, const Mat3& back, double within,
            SolidPoint& at) {
  const double distance = scale * sdf.value(place);
  if (distance > kLargestSlope * within) return false;
  const Vec3 g = back * smooth_gradient(sdf, place);
  const double slope = std::max(g.norm(), 1e-12);
  at.gap = distance / std::clamp(slope, kLeastSlope, kLargestSlope);
  at.normal = g / slope;
  return at.gap <= within;
}

int sdf_cells(const TriMesh& surface, double spacing) {
  if (spacing <= 0.0) return 64;
  Vec3 low = surface.vertices[0], high = low;
  for (const Vec3& x : surface.vertices) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  return std::clamp(static_cast<int>(std::ceil((high - low).maxCoeff() / spacing)), 24, 256);
}

}  // namespace

StaticSolid::StaticSolid(const TriMesh& surface, double spacing)
    : sdf_(sample_distance(surface, {.cells = sdf_cells(surface, spacing), .margin = 3})),
      low_(surface.vertices[0]),
      high_(low_) {
  for (const Vec3& x : surface.vertices) {
    low_ = low_.cwiseMin(x);
    high_ = high_.cwiseMax(x);
  }
}

bool StaticSolid::locate(const Vec3& x, double within, SolidPoint& at) const {
  const double distance = sdf_.value(x);
  if (distance > within) return false;
  const Vec3 g = smooth_gradient(sdf_, x);
  const double slope = std::max(g.norm(), 1e-12);
  at = {distance / std::clamp(slope, kLeastSlope, 1.0), g / slope, x};
  return at.gap <= within;
}

DeformedBody::DeformedBody(const ReducedBody& body, const ContactShape& shape,
                           const std::vector<Vec3>* cover)
    : shape_(&shape),
      R_(body.rotation.toRotationMatrix()),
      centre_(body.position),
      gives_way_(body.r > 0) {
  ARCHETIDE_CHECK(body.rung == shape.rung);
  ARCHETIDE_CHECK((body.nodes != nullptr) == !shape.lattice.shares.empty());
  const auto shape_now = shape_correction(body, body.q);
  scale_ = shape_now->s;
  middle_ = centre_ + R_ * shape_now->shift;
  std::vector<Vec3> points;
  wet_points(body, points);
  samples_.reserve(shape.samples.size());
  const auto mean = [](const std::vector<Vec3>& x, const Vec3i& v, const Vec3& w) {
    return Vec3(w[0] * x[v[0]] + w[1] * x[v[1]] + w[2] * x[v[2]]);
  };
  for (const SurfaceSample& s : shape.samples) {
    Vec3 x = mean(points, s.vertices, s.weights);
    if (cover && shape.covered()) {
      const CoverPlace& place = shape.places[s.order];
      const Vec3 alone = x + R_ * place.offset;
      x = mean(*cover, place.vertices, place.weights);
      cover_shift_ = std::max(cover_shift_, (x - alone).norm());
    }
    samples_.push_back(x);
  }
  if (body.r > 0 && !cover) {
    std::vector<double> areas;
    vertex_normals_and_areas({points, shape.surface().triangles}, normals_, areas);
  }
  low_ = high_ = samples_[0];
  for (const SampleCluster& c : shape.clusters) {
    Vec3 low = samples_[c.begin], high = low;
    for (int s = c.begin; s < c.end; ++s) {
      low = low.cwiseMin(samples_[s]);
      high = high.cwiseMax(samples_[s]);
    }
    Ball ball{0.5 * (low + high), 0.0};
    for (int s = c.begin; s < c.end; ++s)
      ball.radius = std::max(ball.radius, (samples_[s] - ball.centre).norm());
    balls_.push_back(ball);
    low_ = low_.cwiseMin(low);
    high_ = high_.cwiseMax(high);
  }
  if (body.r == 0) return;
  if (body.nodes)
    lattice_ = shape.lattice.displacements(surface_displacements(body, body.q));
  else
    lattice_ = shape.lattice.modes.leftCols(body.r) * body.q;
  for (long n = 0; n + 2 < lattice_.size(); n += 3)
    largest_shift_ = std::max(largest_shift_, lattice_.segment<3>(n).norm());
}

Vec3 DeformedBody::displacement(const Vec3& rest) const {
  const ModeLattice::Stencil s = shape_->lattice.stencil(rest);
  Vec3 u = Vec3::Zero();
  for (int c = 0; c < 8; ++c) u += s.weight[c] * lattice_.segment<3>(3L * s.node[c]);
  return u;
}

Mat3 DeformedBody::displacement_gradient(const Vec3& rest) const {
  const ModeLattice::Stencil s = shape_->lattice.stencil(rest);
  Mat3 G = Mat3::Zero();
  for (int c = 0; c < 8; ++c) G += lattice_.segment<3>(3L * s.node[c]) * s.slope[c].transpose();
  return G;
}

Vec3 DeformedBody::normal(int sample) const {
  const SurfaceSample& s = shape_->samples[sample];
  if (lattice_.size() == 0) return R_ * s.normal;
  if (!normals_.empty()) {
    Vec3 n = Vec3::Zero();
    for (int c = 0; c < 3; ++c) n += s.weights[c] * normals_[s.vertices[c]];
    return n.normalized();
  }
  const Mat3 F = Mat3::Identity() + displacement_gradient(rest_place(shape_->surface(), s));
  return R_ * (cofactor(F) * s.normal).normalized();
}

double DeformedBody::least_gap(const Vec3& x) const {
  return scale_ * (shape_->sdf().value(unscaled(x)) - largest_shift_);
}

// Newton's method for X + u(X) = y; where the modes fold space over there is no answer.
bool DeformedBody::undeform(const Vec3& y, Vec3& rest, Mat3& stretch) const {
  constexpr int kTurns = 10;
  constexpr double kLeastVolume = 0.1;  // det(1 + du/dX) of a fold
  const double close = 1e-6 * shape_->sdf().spacing;
  rest = y - displacement(y);
  for (int turn = 0; turn < kTurns; ++turn) {
    stretch = Mat3::Identity() + displacement_gradient(rest);
    if (stretch.determinant() < kLeastVolume) return false;
    const Vec3 step = stretch.inverse() * (y - rest - displacement(rest));
    rest += step;
    if (step.norm() <= close) return true;
  }
  return (y - rest - displacement(rest)).norm() < 0.1 * shape_->sdf().spacing;
}

bool DeformedBody::to_rest(const Vec3& x, Vec3& rest, Mat3& stretch) const {
  rest = unscaled(x);
  stretch = Mat3::Identity();
  if (lattice_.size() > 0 && !undeform(Vec3(rest), rest, stretch)) return false;
  stretch = R_ * stretch;
  return true;
}

bool DeformedBody::locate(const Vec3& x, double within, SolidPoint& at) const {
  Vec3 rest;
  Mat3 stretch;
  if (!to_rest(x, rest, stretch)) return false;
  at.rest = rest;
  return gap_at(shape_->sdf(), rest, scale_, stretch.transpose().inverse(), within, at);
}

double CoveredSolid::least_gap(const Vec3& x) const {
  const DeformedBody& body = *bodies_[part_];
  const Vec3 place = body.unscaled(x) + cover_.centres[part_];
  return body.scale() * (cover_.distance.value(place) - body.largest_shift()) - body.cover_shift();
}

bool CoveredSolid::locate(const Vec3& x, double within, SolidPoint& at) const {
  constexpr double kAlike = 1e-3, kLittle = 1e-2;  // differences of weights; weights
  Vec3 rest;
  Mat3 stretch;
  if (!bodies_[part_]->to_rest(x, rest, stretch)) return false;
  const Vec3 here = rest + cover_.centres[part_];
  const VecX weights = cover_.weights_at(here);
  if (weights[part_] < weights.maxCoeff() - kAlike) return false;  // another body's

  Vec3 place = weights[part_] * here;
  Mat3 back = weights[part_] * stretch.transpose().inverse();
  double sum = weights[part_];
  for (int b = 0; b < static_cast<int>(bodies_.size()); ++b) {
    Vec3 other;
    Mat3 its;
    if (b == part_ || weights[b] < kLittle || !bodies_[b]->to_rest(x, other, its)) continue;
    place += weights[b] * (other + cover_.centres[b]);
    back += weights[b] * its.transpose().inverse();
    sum += weights[b];
  }
  at.rest = rest;
  return gap_at(cover_.distance, place / sum, bodies_[part_]->scale(), back / sum, within, at);
}

MatX modes_at_rest_place(const ContactShape& shape, const Vec3& rest, int r) {
  MatX modes = MatX::Zero(3, r);
  if (r == 0) return modes;
  const ModeLattice::Stencil s = shape.lattice.stencil(rest);
  for (int c = 0; c < 8; ++c)
    modes += s.weight[c] * shape.lattice.modes.block(3L * s.node[c], 0, 3, r);
  return modes;
}

MatX modes_at_sample(const ContactShape& shape, int sample, int r) {
  const MatX& S = shape.modes();
  MatX modes = MatX::Zero(3, r);
  for (const VertexShare& m : shares_of_sample(shape, sample))
    modes += m.weight * S.block(3L * m.vertex, 0, 3, r);
  return modes;
}

VertexShares shares_at_rest_place(const ContactShape& shape, const Vec3& rest) {
  const ModeLattice& lattice = shape.lattice;
  const ModeLattice::Stencil s = lattice.stencil(rest);
  std::map<int, double> weights;
  for (int c = 0; c < 8; ++c)
    for (int m = 0; m < lattice.shares_each; ++m) {
      const VertexShare& share = lattice.shares[lattice.shares_each * std::size_t(s.node[c]) + m];
      weights[share.vertex] += s.weight[c] * share.weight;
    }
  VertexShares moved;
  for (const auto& [vertex, weight] : weights) moved.push_back({vertex, weight});
  return moved;
}

VertexShares shares_of_sample(const ContactShape& shape, int sample) {
  const SurfaceSample& s = shape.samples[sample];
  VertexShares moved;
  for (int c = 0; c < 3; ++c)
    if (s.weights[c] != 0.0) moved.push_back({s.vertices[c], s.weights[c]});
  return moved;
}

}  // namespace archetide
