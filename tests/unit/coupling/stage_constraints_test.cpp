#include "runtime/coupling/stage_constraints.h"

#include <gtest/gtest.h>

#include "tests/support/dry_body.h"
#include "tests/support/synthetic_archetype.h"

namespace archetide {
namespace {

// Two points a tenth of a millimetre apart that the contact solver, stopped before it had settled,
// lets press at speeds which only a spin of 1500 rad/s could have together.
TEST(StageConstraints, ContactsAreHeldAtSpeedsThatTheyCanHaveAtOnce) {
  ReducedBody body =
      make_body(rigid_surface_archetype(box_surface(Vec3::Constant(0.2), 0), 1000.0), 0);
  const ConfigurationTerms terms =
      configuration_terms(body, current_configuration(body), ModalMass::kExact);
  body.P = terms.mass * Vec3(0, 0, -1);
  const std::vector<StageBody> bodies = {{&body, current_configuration(body), {}, false, {}}};
  StageResult result;
  result.motion.terms = terms;
  result.motion.H =
      generalised_mass(body, terms, 0.01, Stage::kVelocityFull, ModalStep::kTrapezoid);
  std::vector<CoupledBody> coupled(1);
  coupled[0].inverse_mass = MatX::Zero(6, 6);
  coupled[0].inverse_mass.topLeftCorner<3, 3>() = Mat3::Identity() / terms.mass;
  coupled[0].inverse_mass.bottomRightCorner<3, 3>() = terms.inertia_inverse;

  const auto shape = contact_shape(body.archetype);
  GroupContacts contacts;
  contacts.shapes = {shape.get()};
  contacts.target = Eigen::Vector2d(0.0, -0.3);
  contacts.solve.max_sweeps = 0;
  const double h = 0.01;
  for (int k = 0; k < 2; ++k) {
    BodyContact c;
    c.a = 0, c.b = -1, c.sample = k;
    c.point = Vec3(k == 0 ? 1e-4 : -1e-4, 0, -0.1);
    c.normal = Vec3::UnitZ();
    contacts.contacts.push_back(c);
    contacts.start.push_back({0, -1, k, Vec3(0, 0, 0.4 * terms.mass / h)});
  }
  StageConstraints rows(CouplingOptions(), h, {}, bodies, contacts, coupled, {result},
                        {coupled[0].inverse_mass});
  const std::vector<VecX> y = {generalised_velocity(body, terms)};
  rows.start_from_last_step(contacts, h);
  rows.resolve(y);
  rows.hold();
  rows.start(y, coupled);
  // what the guesses leave: 0.4 of the momentum each
  EXPECT_NEAR(coupled[0].y_star[2], -0.2, 1e-9);
  EXPECT_LT(coupled[0].y_star.tail<3>().norm(), 1e-6);
}

}  // namespace
}  // namespace archetide
