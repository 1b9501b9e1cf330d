// The correction that keeps volume and centroid of a body drawn by linear modes.
#include <gtest/gtest.h>

#include "common/archetype/swelling.h"
#include "tests/support/dry_body.h"
#include "tests/support/full_blob.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

struct Enclosed {
  double log_volume;
  Vec3 centroid;
};

Enclosed enclosed_by(const TriMesh& surface) {
  return {std::log(enclosed_volume(surface)), enclosed_centroid(surface)};
}

/// As the water sees it.
Enclosed corrected(ReducedBody& body, const VecX& q) {
  body.q = q;
  TriMesh surface = body.archetype->surface;
  surface_points(body, surface.vertices);
  return enclosed_by(surface);
}

/// The plain linear modes, without the correction.
Enclosed plain(const Archetype& a, const VecX& q) {
  TriMesh surface = a.surface;
  const VecX u = a.surface_modes * q;
  for (std::size_t v = 0; v < surface.vertices.size(); ++v)
    surface.vertices[v] += u.segment<3>(3 * static_cast<long>(v));
  return enclosed_by(surface);
}

TEST(Swelling, IsTheSecondDerivativeOfTheLogarithmOfTheVolume) {
  const SyntheticBody blob = random_archetype(5, 6);
  const Archetype& a = *blob.archetype;
  std::srand(1);
  const VecX q = VecX::Random(6);
  constexpr double eps = 1e-4;
  const double second = (plain(a, eps * q).log_volume + plain(a, -eps * q).log_volume -
                         2.0 * plain(a, 0.0 * q).log_volume) /
                        (2 * eps * eps);
  // central difference: error eps^2 times the fourth derivative, and round-off 1e-16 / eps^2
  EXPECT_NEAR(q.dot(a.swelling.volume * q), second,
              1e-6 * a.swelling.volume.norm() * q.squaredNorm());
}

// A bar of 1 m bent by the shape of a turn: displacement t (-2 x z, 0, x^2).
SyntheticBody bent_bar() {
  const TetMesh tets = box_tets(Vec3(1.0, 0.1, 0.1), Vec3i(12, 2, 2));
  MatX bend(3 * static_cast<long>(tets.nodes.size()), 1);
  for (std::size_t n = 0; n < tets.nodes.size(); ++n) {
    const Vec3& x = tets.nodes[n];
    bend.block<3, 1>(3 * static_cast<long>(n), 0) = Vec3(-2.0 * x[0] * x[2], 0.0, x[0] * x[0]);
  }
  return deformable_archetype(tets, 1000.0, bend, VecX::Constant(1, 10.0));
}

// Its volume is V(0) (1 + q^T E q), an even polynomial of the third degree: kept to round-off.
TEST(ShapeCorrection, ABentBarKeepsItsVolume) {
  const SyntheticBody bar = bent_bar();
  ReducedBody body = make_body(bar.archetype, 1);
  const double rest = corrected(body, VecX::Zero(1)).log_volume;
  const VecX q = VecX::Constant(1, 2.0);
  EXPECT_GE(plain(*bar.archetype, q).log_volume - rest, 0.1);
  EXPECT_NEAR(corrected(body, q).log_volume, rest, 1e-12);
}

TEST(ShapeCorrection, LeavesVolumeAndCentroidOfTheLinearStrain) {
  const SyntheticBody blob = random_archetype(5, 6);
  // off its centre, as the centre of mass of a body of two materials is
  auto shape = std::make_shared<Archetype>(*blob.archetype);
  for (Vec3& x : shape->surface.vertices) x += Vec3(0.05, -0.03, 0.02);
  shape->swelling = second_order_swelling(shape->surface, shape->surface_modes);
  ReducedBody body = make_body(shape, 6);
  const Enclosed rest = corrected(body, VecX::Zero(6));
  std::srand(2);
  const VecX q = VecX::Random(6);
  constexpr double eps = 1e-6;
  const Enclosed ahead = plain(*shape, eps * q), back = plain(*shape, -eps * q);
  const double rate = (ahead.log_volume - back.log_volume) / (2.0 * eps);
  const Vec3 drift = (ahead.centroid - back.centroid) / (2.0 * eps);
  double volume_error[2], centroid_error[2];
  for (int k = 0; k < 2; ++k) {
    const double t = 0.05 / (1 << k);
    const Enclosed now = corrected(body, t * q);
    volume_error[k] = std::abs(now.log_volume - rest.log_volume - t * rate);
    centroid_error[k] = (now.centroid - rest.centroid - t * drift).norm();
  }
  EXPECT_GE(volume_error[0] / volume_error[1], 6.0);  // third order: 8
  EXPECT_GE(centroid_error[0] / centroid_error[1], 6.0);
}

// Half the second difference of the logarithm of the volume that the water meets, along q.
double second_difference(ReducedBody body, const VecX& q) {
  constexpr double eps = 1e-4;
  const auto log_volume = [&](double t) {
    body.q = t * q;
    TriMesh surface = body.rung ? body.rung->surface : body.archetype->surface;
    wet_points(body, surface.vertices);
    return enclosed_by(surface).log_volume;
  };
  return (log_volume(eps) + log_volume(-eps) - 2.0 * log_volume(0.0)) / (2.0 * eps * eps);
}

// A rung whose modes are drawn a tenth too large swells 1.21 times as much by itself. As the water
// meets it, that of linear modes does not, and that of nonlinear ones does as the body's own surface
// [D81].
TEST(ShapeCorrection, ARungSwellsAsTheBodysOwnSurface) {
  std::srand(4);
  const std::shared_ptr<const Archetype> kinds[] = {random_archetype(5, 6).archetype,
                                                    nonlinear_blob()->archetype};
  for (const auto& blob : kinds) {
    auto shape = std::make_shared<Archetype>(*blob);
    shape->ladder = {SurfaceRung{shape->surface, 1.1 * shape->surface_modes, 0.0}};
    derive_swelling(*shape);
    ReducedBody body = make_body(shape, shape->r());
    const VecX q = VecX::Random(body.r);
    const double own = second_difference(body, q);
    body.rung = &shape->ladder[0];
    const double size =
        q.dot(second_order_swelling(shape->surface, shape->surface_modes).volume * q);
    EXPECT_GT(std::abs(size), 1e-3);
    EXPECT_NEAR(second_difference(body, q), shape->nonlinear() ? own : 0.0, 1e-5 * std::abs(size));
  }
}

TEST(ShapeCorrection, RatesAreTheDerivatives) {
  const SyntheticBody blob = random_archetype(5, 6);
  const ReducedBody body = make_body(blob.archetype, 6);
  std::srand(3);
  for (const double size : {1.0, 10.0}) {
    const VecX q = size * VecX::Random(6);
    const ShapeCorrection at = shape_correction(body, q);
    for (int i = 0; i < 6; ++i) {
      const VecX d = 1e-6 * VecX::Unit(6, i);
      const ShapeCorrection ahead = shape_correction(body, q + d),
                            back = shape_correction(body, q - d);
      EXPECT_NEAR(at.slope[i], std::log(ahead.s / back.s) / 2e-6, 1e-6 * (1.0 + at.slope.norm()));
      const Vec3 rate = (ahead.shift - back.shift) / 2e-6;
      EXPECT_LE((at.shift_rate.col(i) + at.slope[i] * at.shift - rate).norm(),
                1e-6 * (1.0 + at.shift_rate.norm()));
    }
  }
}

TEST(ShapeCorrection, IsNothingAtRestAndOfARigidBody) {
  const SyntheticBody blob = random_archetype(5, 6);
  for (const int r : {0, 6}) {
    const ShapeCorrection at = shape_correction(make_body(blob.archetype, r), VecX::Zero(r));
    EXPECT_EQ(at.s, 1.0);
    EXPECT_EQ(at.shift, Vec3::Zero());
  }
}

}  // namespace
}  // namespace archetide
