#include "runtime/contact/push_out.h"

namespace archetide {
namespace {

struct BoxedSolid {
  const TouchedSolid* solid;
  Vec3 low, high;  // with the clearance, m
};

bool holds(const BoxedSolid& s, const Vec3& x) {
  return (x.array() >= s.low.array()).all() && (x.array() <= s.high.array()).all();
}

// Out of one solid may be into another, and distances are rounded at edges: a few rounds.
void move_out_of(const std::vector<BoxedSolid>& solids, double clearance, Vec3& x) {
  constexpr int kRounds = 4;
  constexpr double kEnough = 0.999;  // of the clearance
  for (int round = 0; round < kRounds; ++round) {
    bool moved = false;
    for (const BoxedSolid& s : solids) {
      SolidPoint at;
      if (!holds(s, x) || !s.solid->locate(x, kEnough * clearance, at)) continue;
      x += (clearance - at.gap) * at.normal;
      moved = true;
    }
    if (!moved) return;
  }
}

}  // namespace

PushOut::PushOut(const std::vector<TriMesh>& obstacles, double spacing)
    : obstacles_(Vec3::Zero(), Vec3::Zero(), Sides{}, obstacles, spacing) {}

void PushOut::move_out(const std::vector<ReducedBody>& bodies, double clearance,
                       std::vector<Vec3>& points) {
  const Vec3 margin = Vec3::Constant(clearance);
  std::vector<DeformedBody> deformed;
  deformed.reserve(bodies.size());
  std::vector<BoxedSolid> solids;
  for (const ReducedBody& body : bodies) {
    deformed.emplace_back(body, shapes_.of(body));
    const DeformedBody& d = deformed.back();
    solids.push_back({&d, d.low() - margin, d.high() + margin});
  }
  for (const Surroundings::Item& item : obstacles_.items())
    solids.push_back({item.solid.get(), item.low - margin, item.high + margin});
  if (solids.empty()) return;
#pragma omp parallel for
  for (std::size_t t = 0; t < points.size(); ++t) move_out_of(solids, clearance, points[t]);
}

}  // namespace archetide
