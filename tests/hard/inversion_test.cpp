// Hard case H18: loads that would turn elements inside out; linear modes do not resist that.
#include "runtime/solid/inversion_limit.h"
#include "tests/hard/hard_case.h"
#include "tests/support/momenta.h"

namespace archetide {
namespace {

constexpr double kPull = 1.0;    // s, how long the load is on
constexpr double kTooFar = 3.0;  // of the amplitude that is allowed

/// A load along one modal direction d (r) that would reach q = amplitude d: half a sine over kPull.
Actuator modal_pull(const ReducedBody& body, const VecX& d, double amplitude) {
  auto pattern = std::make_shared<ActuationPattern>();
  pattern->modal = body.archetype->K_r * d;
  pattern->torque_of_modes = MatX::Zero(3, body.r);
  Actuator pull;
  pull.body = 0;
  pull.pattern = pattern;
  pull.amplitude = amplitude;
  pull.period = 2.0 * kPull;
  pull.end = kPull;
  return pull;
}

/// Amplitude along d at which the first element is down to a tenth of its volume.
double reach_along(const Archetype& a, const VecX& d) {
  constexpr double kFar = 1e3;
  return kFar * InversionLimit(a).allowed_share(kFar * d);
}

ReducedBody soft_blob(double beta) {
  SyntheticOptions options;
  options.seed = 3, options.r = 4, options.beta = beta;
  ReducedBody body = make_body(
      deformable_archetype(blob_tets(3, Vec3(0.5, 0.4, 0.3), Vec3i(4, 3, 3)), options).archetype,
      4);
  body.position = Vec3(0.5, 0.5, 0.5);
  return body;
}

double modal_energy(const StepReport& r) { return r.body_kinetic + r.body_elastic; }

struct Pulled {
  double least = 1.0;            // volume of an element over all steps, of its rest volume
  double least_later = 1.0;      // the same in the last half second
  int held = 0, held_later = 0;  // steps; in the last half second
  double gain = -INFINITY;  // energy beyond that of the start and the work done, of the largest
  double rise = 0.0;        // of energy less work above an earlier value, of the largest
  double largest = 0.0;     // energy, J
  int iterations = 0;
  int halved = 0;    // steps
  double gap = 0.0;  // of a joint, m
};

Pulled pull(Simulation& s, const InversionLimit& limit, double end, double dt) {
  Pulled out;
  double lowest = INFINITY, first = NAN, gain = -INFINITY, rise = 0.0;
  run_to(s, end, dt, [&](const StepReport& r) {
    const double least = limit.least_volume(s.bodies()[0].q);
    out.least = std::min(out.least, least);
    out.held += !r.held_bodies.empty();
    out.iterations = std::max({out.iterations, r.position.iterations, r.velocity.iterations});
    out.halved += r.halvings > 0;
    out.gap = std::max(out.gap, r.joint_drift);
    if (r.t > end - 0.5) {
      out.least_later = std::min(out.least_later, least);
      out.held_later += !r.held_bodies.empty();
    }
    const double energy = modal_energy(r) + r.water_kinetic, free = energy - r.actuation_work;
    if (std::isnan(first)) first = free;
    out.largest = std::max(out.largest, energy);
    gain = std::max(gain, free - first);
    rise = std::max(rise, free - lowest);
    lowest = std::min(lowest, free);
  });
  out.gain = gain / out.largest, out.rise = rise / out.largest;
  return out;
}

/// Without the limit: smallest volume on the way.
double unlimited_volume(ReducedBody body, const Actuator& load, const InversionLimit& limit) {
  double least = 1.0;
  for (double t = 0.0; t < kPull; t += 0.005) {
    VecX force = VecX::Zero(body.dofs());
    force.tail(body.r) = load.force_at(t + 0.0025) * load.pattern->modal;
    dry_step(body, force, 0.005, {});
    least = std::min(least, limit.least_volume(body.q));
  }
  return least;
}

// Pulled along every mode, both ways, and along all of them; the body spins and flies as well.
TEST(H18Inversion, PullIsStoppedAtATenthOfTheVolumeAndTheBodyRecovers) {
  const ReducedBody rest = soft_blob(0.01);
  const InversionLimit limit(*rest.archetype);
  std::vector<VecX> directions = {VecX::Ones(4), VecX::LinSpaced(4, 1.0, -1.0)};
  for (int i = 0; i < 4; ++i)
    for (const double sign : {1.0, -1.0}) directions.push_back(sign * VecX::Unit(4, i));
  double worst = 1.0, unlimited = 1.0, rise = 0.0, later = 1.0, moment = 0.0;
  for (const VecX& d : directions) {
    ReducedBody body = rest;
    const ConfigurationTerms terms =
        configuration_terms(body, current_configuration(body), ModalMass::kExact);
    body.P = Vec3(3, -1, 2);
    body.L = terms.inertia * Vec3(1.0, 1.5, -1.2);
    const Actuator load = modal_pull(body, d, kTooFar * reach_along(*body.archetype, d));
    SimulationOptions vacuum;
    vacuum.gravity.setZero();
    Simulation s(vacuum, {}, {body}, {});
    s.set_actuators({load});
    const Pulled out = pull(s, limit, 4.0, 0.005);
    EXPECT_GT(out.held, 10);
    EXPECT_EQ(out.held_later, 0);
    worst = std::min(worst, out.least), later = std::min(later, out.least_later);
    rise = std::max({rise, out.gain, out.rise});
    unlimited = std::min(unlimited, unlimited_volume(rest, load, limit));
    const ReducedBody& end = s.bodies()[0];
    moment = std::max({moment, (end.P - body.P).norm(), (end.L - body.L).norm()});
    std::printf("held in %d of 800 steps, energy less work rises by %.1e\n", out.held, out.rise);
  }
  expect_at_most("volume left without the limit", unlimited, 0.0);
  expect_at_most("0.1 less the smallest volume of an element", 0.1 - worst, 1e-12);
  expect_at_most("lost volume in the last half second", 1.0 - later, 0.5);
  // omega dt = 0.05 to 0.11; with steps four times as long up to 0.13, shorter ones less
  expect_at_most("rise of energy less work / largest energy", rise, 0.01);
  expect_at_most("change of the momenta", moment, 0.0);
}

// The same under water, where the pull works against the water's mass. The solves must know that
// the modes are held: when their rates were only cut afterwards, the water was pumped by a wall
// that did not move (70 J of 220 in a tenth of the load's time).
TEST(H18Inversion, PullUnderWaterIsStoppedToo) {
  for (const Scheme scheme : {Scheme::kNewmark, Scheme::kSingle}) {
    const ReducedBody body = soft_blob(0.01);
    const InversionLimit limit(*body.archetype);
    const VecX d = VecX::Ones(4);
    SimulationOptions o = unit_tank(12);
    o.scheme = scheme;
    o.gravity.setZero();
    Simulation s(o, water_to(o.grid, 0.9), {body}, {});
    s.set_actuators({modal_pull(body, d, kTooFar * reach_along(*body.archetype, d))});
    const Pulled out = pull(s, limit, 2.0, 0.01);
    EXPECT_GT(out.held, 5);
    EXPECT_EQ(out.held_later, 0);
    expect_at_most("0.1 less the smallest volume of an element", 0.1 - out.least, 1e-12);
    expect_at_most("lost volume in the last half second", 1.0 - out.least_later, 0.8);
    expect_at_most("rise of energy less work / largest energy", out.rise, 0.01);
    expect_at_most("iterations", out.iterations, 60);
  }
}

// H26 with the limit: beyond the first frequency the modes have no resting place, and are held.
TEST(H26FastSpin, ModesAreHeldBeyondTheFirstFrequency) {
  for (const double share : {0.9, 1.5, 3.0}) {
    ReducedBody body = soft_blob(0.0);
    const InversionLimit limit(*body.archetype);
    const ConfigurationTerms terms =
        configuration_terms(body, current_configuration(body), ModalMass::kExact);
    body.L = terms.inertia * Vec3(0, 0, share * std::sqrt(body.archetype->omega2[0]));
    const Vec3 L0 = body.L;
    const double e0 = kinetic_energy(body);
    SimulationOptions vacuum;
    vacuum.gravity.setZero();
    Simulation s(vacuum, {}, {body}, {});
    double least = 1.0, energy = 0.0;
    int held = 0;
    run_to(s, 8.0, 0.002, [&](const StepReport& r) {
      least = std::min(least, limit.least_volume(s.bodies()[0].q));
      energy = std::max(energy, modal_energy(r) / e0);
      held += !r.held_bodies.empty();
    });
    std::printf("spin %.1f of the first frequency: held in %d of 4000 steps\n", share, held);
    expect_at_most("0.1 less the smallest volume of an element", 0.1 - least, 1e-12);
    expect_at_most("energy against that of the start", energy, 1.02);
    expect_at_most("change of the angular momentum", (s.bodies()[0].L - L0).norm(), 0.0);
  }
}

/// A soft blob, pulled, with a rigid ball at its end.
struct Jointed {
  std::vector<ReducedBody> bodies;
  std::vector<Joint> joints;
};
Jointed blob_and_ball(int points) {
  Jointed out;
  out.bodies = {soft_blob(0.01), rigid_ball(0.1, 1000.0, Vec3(0.72, 0.5, 0.5))};
  out.bodies[0].position = Vec3(0.38, 0.5, 0.5);
  const std::vector<Vec3> at = {Vec3(0.24, 0, 0), Vec3(0.24, 0.1, 0), Vec3(0.24, 0, 0.1)};
  out.joints = {make_joint(out.bodies, 0, 1, {at.begin(), at.begin() + points})};
  return out;
}

// A body that is held while it hangs on another one: the joint is closed by what may still move.
// (When modes were cut after the joints had been closed, they opened by 8 mm.)
TEST(H18Inversion, HeldBodiesKeepTheirJointsClosed) {
  for (const bool water : {false, true})
    for (const int points : {1, 3}) {
      Jointed j = blob_and_ball(points);
      const InversionLimit limit(*j.bodies[0].archetype);
      SimulationOptions o = unit_tank(12, water);
      if (!water) o.grid = {};
      o.gravity.setZero();
      if (!water) {
        j.bodies[0].L = Vec3(2.0, 1.0, 1.5);
        j.bodies[1].P = Vec3(0.5, 1.0, -0.5);
      }
      Simulation s(o, water ? water_to(o.grid, 0.9) : FluidState(), j.bodies, {}, {}, j.joints);
      const VecX d = VecX::Ones(4);
      // a weld leaves one direction of four to bend in, across the pull for the most part
      const double far = (points == 1 ? 1.0 : 60.0) * kTooFar;
      s.set_actuators({modal_pull(j.bodies[0], d, far * reach_along(*j.bodies[0].archetype, d))});
      const Pulled out = water ? pull(s, limit, points == 1 ? 2.0 : 4.0, 0.01) : pull(s, limit, 4.0, 0.005);
      std::printf("%s, %d points: held in %d steps, later %d, halved %d\n", water ? "wet" : "dry",
                  points, out.held, out.held_later, out.halved);
      EXPECT_GT(out.held, 10);
      EXPECT_EQ(out.held_later, 0);
      expect_at_most("0.1 less the smallest volume of an element", 0.1 - out.least, 1e-12);
      expect_at_most("gap of the joint, m", out.gap, 1e-12);
      expect_at_most("rise of energy less work / largest energy", out.rise, 0.01);
      if (water) continue;
      const Vec3 P = s.bodies()[0].P + s.bodies()[1].P - j.bodies[0].P - j.bodies[1].P,
                 L = momenta_of(s.bodies()).L - momenta_of(j.bodies).L;
      expect_at_most("change of linear momentum, kg m/s", P.norm(), 1e-12);
      // points are 1e-13 m apart; times what they give each other in 4 s, some 1e3 N s in a weld
      expect_at_most("change of angular momentum, kg m^2/s", L.norm(), 1e-9);
    }
}

// Pinned to the world at both ends: nothing but its shape can give.
TEST(H18Inversion, AHeldBodyThatIsPinnedAtBothEndsKeepsItsPlace) {
  ReducedBody body = soft_blob(0.01);
  const InversionLimit limit(*body.archetype);
  SimulationOptions vacuum;
  vacuum.gravity.setZero();
  Simulation s(vacuum, {}, {body}, {}, {},
               {make_joint({body}, 0, -1, {Vec3(0.24, 0, 0), Vec3(-0.24, 0, 0)})});
  const VecX d = VecX::Ones(4);
  s.set_actuators({modal_pull(body, d, kTooFar * reach_along(*body.archetype, d))});
  const Pulled out = pull(s, limit, 4.0, 0.005);
  std::printf("held in %d steps, halved %d\n", out.held, out.halved);
  EXPECT_GT(out.held, 10);
  expect_at_most("0.1 less the smallest volume of an element", 0.1 - out.least, 1e-12);
  expect_at_most("gap of the joint, m", out.gap, 1e-12);
  expect_at_most("rise of energy less work / largest energy", out.rise, 0.01);
}

// Far from the limit nothing is touched.
TEST(H18Inversion, BodiesThatDeformLittleDoNotNotice) {
  ReducedBody body = soft_blob(0.0);
  body.q_dot = VecX::LinSpaced(4, 0.05, -0.05);
  ReducedBody alone = body;
  SimulationOptions vacuum;
  vacuum.gravity.setZero();
  Simulation s(vacuum, {}, {body}, {});
  run_to(s, 1.0, 0.005, [](const StepReport& r) { EXPECT_TRUE(r.held_bodies.empty()); });
  dry_steps(alone, 200, 0.005, {});
  EXPECT_LT((s.bodies()[0].q - alone.q).norm(), 1e-12 * alone.q.norm());
}

}  // namespace
}  // namespace archetide
