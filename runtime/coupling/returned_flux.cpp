#include "runtime/coupling/returned_flux.h"

namespace archetide {
namespace {

// Of the flux; with all of it what is left of one step would swing on for ever.
constexpr double kReturned = 0.9;

// Net flux of the bodies into each closed region, m^3/s.
VecX flux_before(const ClosedComponents& closed, const std::vector<CoupledBody>& bodies) {
  VecX net = VecX::Zero(static_cast<Eigen::Index>(closed.count()));
  for (const CoupledBody& body : bodies) {
    if (body.y_before.size() == 0) continue;
    const VecX motion = body.motion(body.y_before);
    for (std::size_t m = 0; m < body.flux.cell.size(); ++m) {
      const int region =
          body.flux.cell[m] < 0 ? -1 : closed.region(static_cast<std::size_t>(body.flux.cell[m]));
      if (region >= 0) net[region] += body.pushed(m, motion);
    }
  }
  return net;
}

}  // namespace

void return_flux(const CoupledOperator& op, double dx, const std::vector<CoupledBody>& bodies,
                 double* rhs) {
  const ClosedComponents& closed = op.closed();
  if (closed.empty()) return;
  const VecX net = flux_before(closed, bodies);
  const double* openings = op.water().matrix().diag.data();  // no air beside these cells
  for (std::size_t c = 0; c < closed.count(); ++c) {
    const double flux = net[static_cast<Eigen::Index>(c)];
    if (flux == 0.0) continue;
    const double share = kReturned * flux / (dx * dx * sum(closed.cells(c), openings));
    axpy(closed.cells(c), share, openings, rhs);
  }
}

}  // namespace archetide
