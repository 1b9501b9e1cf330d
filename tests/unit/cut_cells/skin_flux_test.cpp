#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include "runtime/cut_cells/dual_faces.h"
#include "tests/support/random_vectors.h"
#include "tests/support/skinned_bar.h"

namespace archetide {
namespace {

Grid grid() { return {12, 12, 12, 0.1, Vec3::Constant(-0.6)}; }
Quat oblique() { return Quat(0.8, -0.3, 0.2, 0.4).normalized(); }

SolidFractions no_solids(const Grid& g) {
  SolidFractions f;
  f.face.resize(g, 0.0);
  f.cell.resize(g.nx, g.ny, g.nz, 0.0);
  return f;
}

struct CutSkin {
  std::vector<BodySurface> surfaces;
  std::vector<Vec3> points;
  SolidFractions solids;
  std::vector<BodyFlux> fluxes;

  CutSkin(const Grid& g, const SkinnedBodies& skin, const std::vector<ReducedBody>& bodies)
      : solids(no_solids(g)) {
    for (const ReducedBody& b : bodies) surfaces.push_back(body_surface(b, ModalMass::kExact));
    skin_points(
        skin, [&](int b) -> const ReducedBody& { return bodies[b]; }, points);
    fluxes = cut_skin(g, wet_surface(skin, surfaces, points), solids);
  }
};

/// Deformed parts, moved apart: nothing of the skin is where any part would have it alone.
SkinnedBar bent_bar() {
  SkinnedBar bar =
      skinned_bar({-0.3, -0.1, 0.1, 0.3}, 0.2, 0.0, 3, 1000.0, Vec3(0.03, 0.01, -0.02), oblique());
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (ReducedBody& b : bar.bodies) {
    for (int i = 0; i < b.r; ++i) b.q[i] = 0.02 * normal(random);
    b.position += 0.01 * random_vec3(normal, random);
    const Vec3 turn = 0.1 * random_vec3(normal, random);
    b.rotation = (Quat(1.0, turn[0], turn[1], turn[2]) * b.rotation).normalized();
  }
  return bar;
}

double volume_of(const SkinnedBar& bar, const std::vector<ReducedBody>& bodies) {
  TriMesh surface{{}, bar.skin.shape->skin->surface.triangles};
  skin_points(
      bar.skin, [&](int b) -> const ReducedBody& { return bodies[b]; }, surface.vertices);
  return enclosed_volume(surface);
}

TEST(SkinFlux, OfABodyThatIsItsOwnSkinIsThatOfTheBody) {
  const SyntheticBody shape = random_archetype(2, 4);
  ReducedBody body;
  body.archetype = shape.archetype;
  body.r = 4;
  body.q = 0.05 * VecX::LinSpaced(4, -1.0, 1.0);
  body.q_dot = VecX::Zero(4);
  body.rotation = oblique();
  body.position = Vec3(0.02, -0.05, 0.01);
  const Grid g = grid();
  const CutSkin skin(g, own_skin(body, 0), {body});
  SolidFractions solids = no_solids(g);
  DualFaces faces;
  const BodyFlux own = cut_body(g, body_surface(body, ModalMass::kExact), solids, faces);
  double worst = 0.0;
  for (std::size_t c = 0; c < skin.fluxes[0].cell.size(); ++c) {
    const auto at = std::find(own.cell.begin(), own.cell.end(), skin.fluxes[0].cell[c]);
    ASSERT_NE(at, own.cell.end());
    worst = std::max(
        worst, (skin.fluxes[0].flux.col(static_cast<long>(c)) - own.flux.col(at - own.cell.begin()))
                   .cwiseAbs()
                   .maxCoeff());
  }
  EXPECT_LT(worst, 1e-13);
  for (std::size_t n = 0; n < solids.cell.size(); ++n)
    EXPECT_NEAR(solids.cell[n], skin.solids.cell[n], 1e-12);
}

// Any pressure on the skin: the forces and torques that reach the members are those of the
// pressure.
TEST(SkinFlux, GivesTheMembersAllLinearAndAngularMomentum) {
  const SkinnedBar bar = bent_bar();
  const Grid g = grid();
  const CutSkin skin(g, bar.skin, bar.bodies);
  // a rigid body of the same surface
  auto rigid = std::make_shared<Archetype>();
  rigid->surface = {skin.points, bar.skin.shape->skin->surface.triangles};
  rigid->surface_modes.resize(3 * static_cast<long>(skin.points.size()), 0);
  ReducedBody whole;
  whole.archetype = rigid;
  BodySurface surface;
  surface.body = &whole;
  surface.R = Mat3::Identity();
  surface.centre = Vec3::Zero();
  surface.points = skin.points;
  surface.terms.spin_of_modes = MatX::Zero(3, 0);
  SolidFractions solids = no_solids(g);
  DualFaces faces;
  const BodyFlux all = cut_body(g, surface, solids, faces);

  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  VecX pressure(static_cast<long>(g.cells()));
  for (long c = 0; c < pressure.size(); ++c) pressure[c] = normal(random);
  const auto impulse = [&](const BodyFlux& f) {
    VecX sum = VecX::Zero(f.flux.rows());
    for (std::size_t c = 0; c < f.cell.size(); ++c)
      sum += pressure[f.cell[c]] * f.flux.col(static_cast<long>(c));
    return sum;
  };
  Vec3 P = Vec3::Zero(), L = Vec3::Zero();
  double scale = 0.0;
  for (std::size_t b = 0; b < bar.bodies.size(); ++b) {
    const VecX f = impulse(skin.fluxes[b]);
    P += f.head<3>();
    L += f.segment<3>(3) + bar.bodies[b].position.cross(f.head<3>());
    scale += f.head<3>().norm();
  }
  const VecX expected = impulse(all);
  std::printf("momentum off by %.1e, angular by %.1e\n", (P - expected.head<3>()).norm() / scale,
              (L - expected.segment<3>(3)).norm() / scale);
  EXPECT_LT((P - expected.head<3>()).norm(), 1e-14 * scale);
  EXPECT_LT((L - expected.segment<3>(3)).norm(), 1e-14 * scale);
}

// Sum over cells of F^T y = rate of the enclosed volume, for every generalised velocity: central
// differences over poses.
TEST(SkinFlux, SumsToTheRateOfTheEnclosedVolume) {
  const SkinnedBar bar = bent_bar();
  const CutSkin skin(grid(), bar.skin, bar.bodies);
  constexpr double kStep = 1e-5;
  double worst = 0.0, scale = 0.0;
  for (std::size_t b = 0; b < bar.bodies.size(); ++b) {
    const VecX rate = skin.fluxes[b].flux.rowwise().sum();
    const ConfigurationTerms& terms = skin.surfaces[b].terms;
    for (int k = 0; k < rate.size(); ++k) {
      VecX y = VecX::Unit(rate.size(), k);
      double volume[2];
      for (const int side : {0, 1}) {
        std::vector<ReducedBody> moved = bar.bodies;
        ReducedBody& body = moved[b];
        const double h = side == 0 ? -kStep : kStep;
        // the frame spins with w - I^-1 D q_dot: a mode takes its own spin out
        const Vec3 spin = y.segment<3>(3) - terms.spin_of_modes * y.tail(body.r);
        body.position += h * y.head<3>();
        body.rotation =
            Quat(Eigen::AngleAxisd(h * spin.norm(), spin.stableNormalized())) * body.rotation;
        body.q += h * y.tail(body.r);
        volume[side] = volume_of(bar, moved);
      }
      worst = std::max(worst, std::abs((volume[1] - volume[0]) / (2.0 * kStep) - rate[k]));
      scale = std::max(scale, std::abs(rate[k]));
    }
  }
  std::printf("off by %.1e of the largest\n", worst / scale);
  EXPECT_LT(worst, 1e-8 * scale);  // h^2 and round-off / h, both 1e-10
}

}  // namespace
}  // namespace archetide
