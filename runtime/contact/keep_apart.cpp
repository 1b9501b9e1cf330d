#include "runtime/contact/keep_apart.h"

#include <algorithm>

namespace archetide {
namespace {

// Per body, the share of its change that no point forbids.
std::vector<double> shares_apart(const std::vector<ReducedBody>& bodies, const GroupContacts& met,
                                 double slack, const std::vector<VecX>& q) {
  const auto changes = [&](int b) { return b >= 0 && q[b].size() > 0; };
  std::vector<double> share(bodies.size(), 1.0);
  const auto limit = [&](int b, const Vec3& apart, const MatX& modes, double most) {
    const Vec3 way = bodies[b].rotation * Vec3(modes * (q[b] - bodies[b].q));
    const double closer = -apart.dot(way);
    if (closer > most) share[b] = std::min(share[b], most / closer);
  };
  for (const BodyContact& c : met.near) {
    const bool both = changes(c.a) && changes(c.b);
    const double most = (both ? 0.5 : 1.0) * (std::max(c.gap, 0.0) + slack);
    if (changes(c.a))
      limit(c.a, c.normal, modes_at_sample(*met.shapes[c.a], c.sample, bodies[c.a].r), most);
    if (changes(c.b))
      limit(c.b, -c.normal, modes_at_rest_place(*met.shapes[c.b], c.rest_b, bodies[c.b].r), most);
  }
  return share;
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

void keep_apart(const std::vector<ReducedBody>& bodies, const GroupContacts& met, double slack,
                double available, std::vector<VecX>& q) {
  constexpr int kParts = 8;
  const std::vector<double> apart = shares_apart(bodies, met, slack, q);
  std::vector<double> share = apart;
  for (int part = 1; part <= kParts && gained(bodies, share, q) > available; ++part)
    for (std::size_t b = 0; b < share.size(); ++b)
      share[b] = apart[b] + (1.0 - apart[b]) * part / kParts;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (share[b] < 1.0) q[b] = part_of_way(bodies[b], share[b], q[b]).q;
}

}  // namespace archetide
