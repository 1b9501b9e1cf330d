// Cost of contact between two bodies that lie on one another, for archetypes of different meshes:
// the search of a step (both surfaces placed, one tried against the other's distance) and the
// contacts themselves (rows of both bodies, one sweep of impulses).
//   bench_contact MODES ARCHETYPE.h5 ...
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "common/base/input_error.h"
#include "runtime/contact/body_contacts.h"
#include "tests/support/bench_main.h"
#include "tests/support/best_time.h"
#include "tests/support/dry_body.h"

namespace archetide {
namespace {

// The body and one that lies on it, turned a little, as deep as the contact tolerance.
std::vector<ReducedBody> pair_of(const ReducedBody& body, double tolerance) {
  const BodyReach reach = body_reach(*body.archetype);
  std::vector<ReducedBody> pair(2, body);
  pair[1].rotation = Quat(Eigen::AngleAxisd(0.3, Vec3::UnitZ()));
  BodyContactOptions options;
  options.tolerance = tolerance;
  double low = 0.0, high = 2.5 * reach.rest;  // touching and apart, m
  for (int n = 0; n < 40; ++n) {
    pair[1].position = Vec3(0, 0, 0.5 * (low + high));
    BodyContacts contacts(options, pair, Surroundings());
    const bool touch = contacts.resolve(pair, {0.0, 0.0}, 1e-3).penetration.touching > 0;
    (touch ? low : high) = pair[1].position[2];
  }
  pair[1].position[2] = low - tolerance;
  return pair;
}

// Rows of both bodies and impulses that stop the contacts, each.
double microseconds_per_contact(const std::vector<ReducedBody>& pair,
                                const GroupContacts& reachable) {
  std::vector<ConfigurationTerms> terms;
  std::vector<GeneralisedMass> H;
  std::vector<VecX> y;
  for (const ReducedBody& b : pair) {
    terms.push_back(configuration_terms(b, current_configuration(b), ModalMass::kExact));
    H.push_back(
        generalised_mass(b, terms.back(), 1e-3, Stage::kVelocityFull, ModalStep::kTrapezoid));
    y.push_back(VecX::Zero(b.dofs()));
  }
  y[1][2] = -0.1;
  std::vector<ContactBody> masses;
  for (std::size_t b = 0; b < 2; ++b)
    masses.push_back({&pair[b], reachable.shapes[b], &terms[b], &H[b], nullptr});
  ContactSolveOptions once;
  once.friction = 0.4, once.max_sweeps = 1;
  const VecX target = VecX::Zero(static_cast<long>(reachable.contacts.size()));
  return best_microseconds(100,
                           [&](int times) {
                             for (int k = 0; k < times; ++k) {
                               const ContactSystem system(reachable.contacts, masses);
                               std::vector<Vec3> lambda(reachable.contacts.size(), Vec3::Zero());
                               std::vector<VecX> moved = y;
                               system.solve(target, once, lambda, moved);
                             }
                           }) /
         static_cast<double>(reachable.contacts.size());
}

int main_of(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: bench_contact MODES ARCHETYPE.h5 ...\n");
    return kExitInput;
  }
  const int r = std::atoi(argv[1]);
  std::printf(
      "archetype                         tets   surface   modes  contacts   search us   "
      "us/contact\n");
  for (int n = 2; n < argc; ++n) {
    const auto archetype = std::make_shared<const Archetype>(read_archetype(argv[n]));
    const ReducedBody body = make_body(archetype, std::min(r, archetype->r()));
    BodyContactOptions options;
    options.tolerance = 1e-3 * body_reach(*archetype).rest;
    options.friction = 0.4;
    const std::vector<ReducedBody> pair = pair_of(body, options.tolerance);
    const BodyContacts contacts(options, pair, Surroundings());
    const std::vector<double> speed(2, 0.1);
    const GroupContacts reachable = contacts.reachable_contacts(pair, speed, 1e-3);
    const std::size_t found = reachable.contacts.size();
    const double search = best_microseconds(20, [&](int times) {
      for (int k = 0; k < times; ++k) contacts.reachable_contacts(pair, speed, 1e-3);
    });
    const double rows = microseconds_per_contact(pair, reachable);
    std::printf("%-30s %7zu %9zu %7d %9zu %11.1f %12.2f\n", argv[n], archetype->tets.tets.size(),
                archetype->surface.vertices.size(), body.r, found, search, rows);
  }
  return kExitDone;
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) { return archetide::bench_main(argc, argv, archetide::main_of); }
