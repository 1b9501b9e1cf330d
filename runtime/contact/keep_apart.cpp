#include "runtime/contact/keep_apart.h"

#include <algorithm>

namespace archetide {
namespace {

// How far the change of each body of a contact brings the two closer, m; 0 of one that does not
// change.
struct Closer {
  double a = 0.0, b = 0.0;
};
Closer closer(const std::vector<ReducedBody>& bodies, const GroupContacts& met,
              const std::vector<VecX>& q, const BodyContact& c) {
  // `displacement`: of the rest place x, of a shape
  const auto along = [&](int b, const Vec3& apart, const Vec3& x, const auto& displacement) {
    if (b < 0 || q[b].size() == 0) return 0.0;
    const ReducedBody& body = bodies[b];
    const auto place = [&](const VecX& shape_q) -> Vec3 {
      const auto shape = shape_correction(body, shape_q);
      return shape->s * (x + displacement(shape_q)) + shape->shift;
    };
    return -apart.dot(body.rotation * (place(q[b]) - place(body.q)));
  };
  const auto of_sample = [&](const VecX& shape_q) -> Vec3 {
    const ReducedBody& body = bodies[c.a];
    if (body.nodes)
      return displacement_of(body, shares_of_sample(*met.shapes[c.a], c.sample), shape_q);
    return modes_at_sample(*met.shapes[c.a], c.sample, body.r) * shape_q;
  };
  const auto of_rest_place = [&](const VecX& shape_q) -> Vec3 {
    const ReducedBody& body = bodies[c.b];
    if (body.nodes)
      return displacement_of(body, shares_at_rest_place(*met.shapes[c.b], c.rest_b), shape_q);
    return modes_at_rest_place(*met.shapes[c.b], c.rest_b, body.r) * shape_q;
  };
  const ContactShape& a = *met.shapes[c.a];
  return {along(c.a, c.normal, rest_place(a.surface(), a.samples[c.sample]), of_sample),
          along(c.b, -c.normal, c.rest_b, of_rest_place)};
}

// Per body, the share of its change that no point forbids.
std::vector<double> shares_apart(const std::vector<ReducedBody>& bodies, const GroupContacts& met,
                                 double slack, const std::vector<VecX>& q) {
  const auto changes = [&](int b) { return b >= 0 && q[b].size() > 0; };
  std::vector<double> share(bodies.size(), 1.0);
  const auto limit = [&](int b, double way, double most) {
    if (way > most) share[b] = std::min(share[b], most / way);
  };
  for (const BodyContact& c : met.near) {
    const bool both = changes(c.a) && changes(c.b);
    const double most = (both ? 0.5 : 1.0) * (std::max(c.gap, 0.0) + slack);
    const Closer way = closer(bodies, met, q, c);
    if (changes(c.a)) limit(c.a, way.a, most);
    if (changes(c.b)) limit(c.b, way.b, most);
  }
  return share;
}

// How far the changes drive bodies into each other, or deeper, m.
double deepest(const std::vector<ReducedBody>& bodies, const GroupContacts& met,
               const std::vector<VecX>& q) {
  double most = 0.0;
  for (const BodyContact& c : met.near) {
    const Closer way = closer(bodies, met, q, c);
    most = std::max(most, way.a + way.b - std::max(c.gap, 0.0));
  }
  return most;
}

ReducedBody part_of_way(const ReducedBody& body, double share, const VecX& q) {
  ReducedBody there = body;
  there.q += share * (q - body.q);
  return there;
}

// Elastic energy that the bodies have more, if they go these shares instead of all the way, J.
double gained(const std::vector<ReducedBody>& bodies, const std::vector<double>& share,
              const std::vector<VecX>& q) {
  double gain = 0.0;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (share[b] < 1.0)
      gain += elastic_energy(part_of_way(bodies[b], share[b], q[b])) -
              elastic_energy(part_of_way(bodies[b], 1.0, q[b]));
  return gain;
}

}  // namespace

double keep_apart(const std::vector<ReducedBody>& bodies, const GroupContacts& met, double slack,
                  double available, std::vector<VecX>& q) {
  constexpr int kParts = 8;
  const std::vector<double> apart = shares_apart(bodies, met, slack, q);
  std::vector<double> share = apart;
  for (int part = 1; part <= kParts && gained(bodies, share, q) > available; ++part)
    for (std::size_t b = 0; b < share.size(); ++b)
      share[b] = apart[b] + (1.0 - apart[b]) * part / kParts;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (share[b] < 1.0) q[b] = part_of_way(bodies[b], share[b], q[b]).q;
  return share == apart ? 0.0 : deepest(bodies, met, q);
}

}  // namespace archetide
