// Hard case H23: the same scene in millimetres, metres and kilometres.
#include <fmt/core.h>

#include <algorithm>
#include <vector>

#include "tests/hard/hard_case.h"

namespace archetide {
namespace {

/// Of a scene whose lengths are multiples of `unit` (m) and whose times are of sqrt(unit): in these
/// units.
struct Meeting {
  std::vector<double> kinetic, elastic;  // of water and bodies; of bodies; after each step
  int halvings = 0, touched = 0;         // steps with contacts
  double deepest = 0.0;                  // cells
};

// A soft box falls onto another one that floats; both end on the floor of shallow water or on each
// other.
enum class Held { kByContact, kByWalls, kByAJoint };

Meeting meet(double unit, Held held) {
  const double second = std::sqrt(unit), energy = std::pow(unit, 4);
  SimulationOptions o;
  o.grid = {20, 16, 16, unit / 16, Vec3::Zero()};
  o.open_side[kZMax] = true;
  o.tolerance = 1e-10;
  o.max_dt = second / 64;
  o.body_contact = held == Held::kByContact;
  o.friction = 0.4;
  SyntheticOptions soft;
  soft.density = 500.0, soft.first_omega = 24.0 / second;
  const SyntheticBody box =
      deformable_archetype(box_tets(unit * Vec3(0.375, 0.25, 0.1875), Vec3i(3, 2, 2)), soft);
  std::vector<ReducedBody> bodies(2, make_body(box.archetype, 4));
  bodies[0].position = unit * Vec3(0.625, 0.5, 0.375);
  bodies[1].position = unit * Vec3(0.6875, 0.5, 0.71875);
  bodies[1].P = body_mass(bodies[1]) * Vec3(0, 0, -2.0) * second;
  std::vector<Joint> joints;
  if (held == Held::kByAJoint)
    joints = {make_joint(bodies, 1, -1, {unit * Vec3(0.1875, 0, 0)}),
              make_joint(bodies, 0, 1, {unit * Vec3(0.0625, 0, 0.171875)})};
  Simulation s(o, water_to(o.grid, 0.3125 * unit), bodies, {}, {}, joints);
  Meeting out;
  for (int n = 0; n < 64; ++n) {
    const StepReport r = s.step(std::min(o.max_dt, s.stable_dt()));
    out.kinetic.push_back((r.water_kinetic + r.body_kinetic) / energy);
    out.elastic.push_back(r.body_elastic / energy);
    out.halvings += r.halvings;
    out.touched += r.contacts > 0;
    out.deepest = std::max(out.deepest, r.max_penetration / o.grid.dx);
  }
  expect_sound(s.bodies());
  return out;
}

// With gravity, densities and the frequencies' sqrt(L) kept, all that is computed scales by powers of
// two, so that scenes of 1 mm and of 1 km are that of a metre to the last bit: whatever is held
// against a number with units, or against one that mixes them, shows here. (A limit in mixed units once
// let rows of contacts of the small scene go: overlaps of 0.5 to 5 cells.)
class H23Similarity : public ::testing::TestWithParam<Held> {};

TEST_P(H23Similarity, MillimetresAndKilometresAreTheSameScene) {
  const Meeting metre = meet(1.0, GetParam());
  ASSERT_GT(metre.touched, GetParam() == Held::kByAJoint ? -1 : 10);
  for (const double unit : {std::ldexp(1.0, -10), std::ldexp(1.0, 10)}) {
    const Meeting other = meet(unit, GetParam());
    double kinetic = 0.0, elastic = 0.0;
    for (std::size_t n = 0; n < metre.kinetic.size(); ++n) {
      kinetic = std::max(kinetic, std::abs(other.kinetic[n] / metre.kinetic[n] - 1.0));
      elastic = std::max(elastic, std::abs(other.elastic[n] - metre.elastic[n]));
    }
    elastic /= *std::max_element(metre.elastic.begin(), metre.elastic.end());
    const std::string at = fmt::format(" in units of {:g} m", unit);
    expect_at_most(("difference of kinetic energy" + at).c_str(), kinetic, 1e-13);
    expect_at_most(("difference of elastic energy" + at).c_str(), elastic, 1e-13);
    expect_at_most(("overlap, cells," + at).c_str(), other.deepest, 0.5);
    EXPECT_EQ(other.halvings, metre.halvings);
  }
}

INSTANTIATE_TEST_SUITE_P(All, H23Similarity,
                         ::testing::Values(Held::kByContact, Held::kByWalls, Held::kByAJoint),
                         [](const auto& at) {
                           return at.param == Held::kByContact ? "Contact"
                                  : at.param == Held::kByWalls ? "Walls"
                                                               : "Joint";
                         });

}  // namespace
}  // namespace archetide
