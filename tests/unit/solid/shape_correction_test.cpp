// The correction that keeps volume and centroid of a body drawn by linear modes.
#include <gtest/gtest.h>

#include "common/archetype/elastic_volume.h"
#include "common/archetype/swelling.h"
#include "tests/support/dry_body.h"
#include "tests/support/full_blob.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

struct Enclosed {
  double volume, log_volume;
  Vec3 centroid;
};

Enclosed enclosed_by(const TriMesh& surface) {
  const double volume = enclosed_volume(surface);
  return {volume, std::log(volume), enclosed_centroid(surface)};
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
  const Swelling swelling = second_order_swelling(a.surface, a.surface_modes);
  const double second = (plain(a, eps * q).log_volume + plain(a, -eps * q).log_volume -
                         2.0 * plain(a, 0.0 * q).log_volume) /
                        (2 * eps * eps);
  // central difference: error eps^2 times the fourth derivative, and round-off 1e-16 / eps^2
  EXPECT_NEAR(q.dot(swelling.volume * q), second, 1e-6 * swelling.volume.norm() * q.squaredNorm());
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

// It bends without a change of volume, however far it goes.
TEST(ShapeCorrection, ABentBarKeepsItsVolume) {
  const SyntheticBody bar = bent_bar();
  ReducedBody body = make_body(bar.archetype, 1);
  const double rest = corrected(body, VecX::Zero(1)).log_volume;
  const VecX q = VecX::Constant(1, 6.0);
  EXPECT_GE(plain(*bar.archetype, q).log_volume - rest, 0.8);
  EXPECT_NEAR(corrected(body, q).log_volume, rest, 1e-13);
}

// ln V(0) + ln f(a.q) and c(0) + b.q, at any q (P7).
TEST(ShapeCorrection, LeavesVolumeAndCentroidOfTheLinearStrain) {
  const SyntheticBody blob = random_archetype(5, 6);
  // off its centre, as the centre of mass of a body of two materials is
  auto shape = std::make_shared<Archetype>(*blob.archetype);
  for (Vec3& x : shape->surface.vertices) x += Vec3(0.05, -0.03, 0.02);
  derive_shapes(*shape);
  ReducedBody body = make_body(shape, 6);
  const Enclosed rest = corrected(body, VecX::Zero(6));
  std::srand(2);
  const VecX direction = VecX::Random(6);
  constexpr double eps = 1e-5;
  const Enclosed ahead = plain(*shape, eps * direction), back = plain(*shape, -eps * direction);
  const double rate = (ahead.log_volume - back.log_volume) / (2.0 * eps);
  const Vec3 drift = (ahead.centroid - back.centroid) / (2.0 * eps);
  for (const double t : {-1.0, -0.1, 0.1, 0.5}) {
    const double strain = t * rate;
    const double wanted = t * rate < 0.0 ? strain : std::log(1.0 + strain + 0.5 * strain * strain);
    const Enclosed now = corrected(body, t * direction);
    // central differences: their third derivatives times eps^2
    EXPECT_NEAR(now.log_volume - rest.log_volume, wanted, 1e-9) << t;
    EXPECT_LE((now.centroid - rest.centroid - t * drift).norm(), 1e-9) << t;
  }
}

// A uniform pressure does the work of V: with f convex it never drives a body away from the shape that
// it presses it to, as it did at the third order of the modes (a slender arm whipped, a jellyfish under
// gravity was torn).
TEST(ShapeCorrection, TheWorkOfAPressureIsConvex) {
  const SyntheticBody blob = random_archetype(5, 6);
  ReducedBody body = make_body(blob.archetype, 6);
  std::srand(5);
  const auto volume = [&](const VecX& q) { return std::exp(corrected(body, q).log_volume); };
  const double rest = volume(VecX::Zero(6));
  double least = INFINITY, least_plain = INFINITY;
  for (int k = 0; k < 20; ++k) {
    const VecX q = 0.5 * VecX::Random(6), d = 1e-3 * VecX::Random(6).normalized();
    const auto curvature = [&](const auto& of) {
      return (of(q + d) + of(q - d) - 2.0 * of(q)) / (d.squaredNorm() * rest);
    };
    least = std::min(least, curvature(volume));
    least_plain = std::min(least_plain, curvature([&](const VecX& x) {
                             return std::exp(plain(*blob.archetype, x).log_volume);
                           }));
  }
  EXPECT_LT(least_plain, -1e-2);
  EXPECT_GT(least, -1e-8);  // round-off of the second difference
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
    derive_shapes(*shape);
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

// The points of its elastic energy, of any volumes, tell the volume of a nonlinear body from the second
// order on: ln V = a.q + ln J - (ln J)'.q. So a pressure is resisted where it works.
TEST(ShapeCorrection, NonlinearModesHaveTheVolumeThatTheirEnergyResists) {
  auto shape = std::make_shared<Archetype>(*random_archetype(5, 6).archetype);
  std::srand(7);
  shape->elastic = ElasticCubature(0.3 * MatX::Random(27, 6), VecX::Constant(3, 0.01),
                                   VecX::Constant(3, 1e4), VecX::Constant(3, 1e4));
  shape->ladder = {SurfaceRung{shape->surface, 1.1 * shape->surface_modes, 0.0}};
  derive_shapes(*shape);
  const double rest = plain(*shape, VecX::Zero(6)).log_volume;
  const ElasticVolume at_rest = elastic_volume(shape->elastic, VecX::Zero(6));
  const VecX q = 0.5 * VecX::Random(6);
  const double points = std::log(elastic_volume(shape->elastic, q).value / at_rest.value) -
                        at_rest.rate.dot(q) / at_rest.value;
  ReducedBody body = make_body(shape, 6);
  EXPECT_NEAR(corrected(body, q).log_volume - rest, shape->linear.rates.col(0).dot(q) + points,
              1e-13);
  body.rung = &shape->ladder[0];
  body.q = q;
  TriMesh surface = body.rung->surface;
  wet_points(body, surface.vertices);
  EXPECT_NEAR(enclosed_by(surface).log_volume - rest,
              body.rung->linear.rates.col(0).dot(q) + points, 1e-13);
  // the second derivatives, by differences of the rates
  const auto rates = [&](const VecX& at) -> VecX {
    ReducedBody there = body;
    there.q = at;
    TriMesh moved = body.rung->surface;
    wet_points(there, moved.vertices);
    VecX grad(6);
    for (int i = 0; i < 6; ++i) {
      double volume[2];
      for (const int side : {0, 1}) {
        there.q = at + (side ? 1e-5 : -1e-5) * VecX::Unit(6, i);
        wet_points(there, moved.vertices);
        volume[side] = enclosed_volume(moved);
      }
      grad[i] = (volume[1] - volume[0]) / 2e-5;
    }
    return grad;
  };
  const MatX K = volume_curvature(body);
  for (int j = 0; j < 6; ++j) {
    const VecX d = 1e-4 * VecX::Unit(6, j);
    EXPECT_LT((K.col(j) - (rates(q + d) - rates(q - d)) / 2e-4).norm(), 1e-5 * K.norm());
  }
}

// 3: the modes have turned the surface inside out.
TEST(ShapeCorrection, RatesAreTheDerivatives) {
  const SyntheticBody blob = random_archetype(5, 6);
  const ReducedBody body = make_body(blob.archetype, 6);
  std::srand(3);
  const VecX direction = VecX::Random(6);
  double least = INFINITY;
  for (const double size : {-3.0, -0.3, 0.3, 1.0, 3.0}) {
    const VecX q = size * direction;
    const ShapeCorrection at = *shape_correction(body, q);
    least = std::min(least, plain(*blob.archetype, q).volume);
    for (int i = 0; i < 6; ++i) {
      const VecX d = 1e-6 * VecX::Unit(6, i);
      const ShapeCorrection ahead = *shape_correction(body, q + d),
                            back = *shape_correction(body, q - d);
      EXPECT_NEAR(at.slope[i], std::log(ahead.s / back.s) / 2e-6, 1e-6 * (1.0 + at.slope.norm()));
      const Vec3 rate = (ahead.shift - back.shift) / 2e-6;
      EXPECT_LE((at.shift_rate.col(i) + at.slope[i] * at.shift - rate).norm(),
                1e-6 * (1.0 + at.shift_rate.norm()));
    }
  }
  EXPECT_LT(least, 0.0);
}

TEST(ShapeCorrection, IsKeptUntilTheBodyChanges) {
  std::srand(6);
  auto shape = std::make_shared<Archetype>(*random_archetype(5, 6).archetype);
  shape->ladder = {SurfaceRung{shape->surface, 1.1 * shape->surface_modes, 0.0}};
  derive_shapes(*shape);
  ReducedBody body = make_body(shape, 6);
  const VecX q = VecX::Random(6);
  const auto first = shape_correction(body, q);
  EXPECT_EQ(shape_correction(body, q), first);
  EXPECT_EQ(shape_correction(ReducedBody(body), q), first);
  EXPECT_NE(shape_correction(body, 2.0 * q)->s, first->s);
  EXPECT_EQ(shape_correction(body, q), first);
  body.rung = &shape->ladder[0];
  EXPECT_NE(shape_correction(body, q)->s, first->s);
}

TEST(ShapeCorrection, IsNothingAtRestAndOfARigidBody) {
  const SyntheticBody blob = random_archetype(5, 6);
  for (const int r : {0, 6}) {
    const ShapeCorrection at = *shape_correction(make_body(blob.archetype, r), VecX::Zero(r));
    EXPECT_EQ(at.s, 1.0);
    EXPECT_EQ(at.shift, Vec3::Zero());
  }
}

}  // namespace
}  // namespace archetide
