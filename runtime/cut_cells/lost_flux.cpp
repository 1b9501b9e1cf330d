#include "runtime/cut_cells/lost_flux.h"

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include "runtime/cut_cells/flux_columns.h"

namespace archetide {
namespace {

Vec3i place(const PoissonMatrix& matrix, std::int64_t cell) {
  return matrix.cell(cell < 0 ? cell_beside(cell) : cell);
}

/// Those of `kept` that are nearest to column m.
std::vector<std::size_t> nearest(const PoissonMatrix& matrix, const BodyFlux& f,
                                 const std::vector<std::size_t>& kept, std::size_t m) {
  const Vec3i at = place(matrix, f.cell[m]);
  std::vector<std::size_t> found;
  int least = std::numeric_limits<int>::max();
  for (std::size_t n = 0; n < kept.size(); ++n) {
    const int square = (place(matrix, f.cell[kept[n]]) - at).squaredNorm();
    if (square > least) continue;
    if (square < least) found.clear();
    least = square;
    found.push_back(n);
  }
  return found;
}

/// The columns `from`, in this order.
BodyFlux columns(const BodyFlux& f, const std::vector<std::size_t>& from) {
  BodyFlux out;
  out.flux.resize(f.flux.rows(), static_cast<Eigen::Index>(from.size()));
  for (std::size_t n = 0; n < from.size(); ++n) {
    out.cell.push_back(f.cell[from[n]]);
    out.flux.col(static_cast<Eigen::Index>(n)) = f.flux.col(static_cast<Eigen::Index>(from[n]));
    if (f.surface.empty()) continue;
    for (std::size_t e = f.surface.begin(from[n]); e < f.surface.ends[from[n]]; ++e)
      out.surface.add(f.surface.vertex[e], f.surface.area[e]);
    out.surface.end_column();
  }
  return out;
}

/// A share of each column of `kept`, sum 1: of those nearest to what is lost, as much as they are
/// near to.
VecX shares(const PoissonMatrix& matrix, const BodyFlux& f, const std::vector<std::size_t>& kept,
            const std::vector<std::size_t>& lost) {
  VecX share = VecX::Zero(static_cast<Eigen::Index>(kept.size()));
  for (const std::size_t m : lost) {
    const double size = f.flux.col(static_cast<Eigen::Index>(m)).head<3>().norm();
    if (size == 0.0) continue;
    const std::vector<std::size_t> takers = nearest(matrix, f, kept, m);
    for (const std::size_t n : takers)
      share[static_cast<Eigen::Index>(n)] += size / static_cast<double>(takers.size());
  }
  return share / std::max(share.sum(), std::numeric_limits<double>::min());
}

/// Adds shares of what the columns `lost` of `f` sum up to, to each column of `to`.
void add_shares(const BodyFlux& f, const std::vector<std::size_t>& lost, const VecX& share,
                BodyFlux& to) {
  const BodyFlux from = columns(f, lost);
  to.flux += sum_columns(from.flux) * share.transpose();
  if (f.surface.empty()) return;
  std::map<int, Vec3> sum;  // of each vertex, m^2
  for (std::size_t e = 0; e < from.surface.vertex.size(); ++e)
    sum.try_emplace(from.surface.vertex[e], Vec3::Zero()).first->second += from.surface.area[e];
  const SurfaceFlux own = std::exchange(to.surface, {});
  for (std::size_t n = 0; n < to.cell.size(); ++n) {
    for (std::size_t e = own.begin(n); e < own.ends[n]; ++e)
      to.surface.add(own.vertex[e], own.area[e]);
    const double part = share[static_cast<Eigen::Index>(n)];
    if (part > 0.0)
      for (const auto& [vertex, area] : sum) to.surface.add(vertex, part * area);
    to.surface.end_column();
  }
}

}  // namespace

void settle_lost_flux(const PoissonMatrix& matrix, const ClosedComponents& closed, BodyFlux& flux) {
  std::vector<std::size_t> kept, lost, inside;
  for (std::size_t m = 0; m < flux.cell.size(); ++m) {
    (holds_unknown(matrix, flux.cell[m]) ? kept : lost).push_back(m);
    if (flux.cell[m] >= 0) inside.push_back(m);
  }
  if (lost.empty()) return;
  const bool shut_in =
      !kept.empty() && !closed.empty() && std::ranges::all_of(kept, [&](std::size_t m) {
        return closed.region(static_cast<std::size_t>(flux.cell[m])) >= 0;
      });
  if (!shut_in) {
    if (inside.size() < flux.cell.size()) flux = columns(flux, inside);
    return;
  }
  BodyFlux settled = columns(flux, kept);
  add_shares(flux, lost, shares(matrix, flux, kept, lost), settled);
  flux = std::move(settled);
}

}  // namespace archetide
