#include "runtime/coupling/narrow_faces.h"

#include <algorithm>
#include <cmath>

namespace archetide {
namespace {

// Most that a narrow face carries beyond the water around it, of the speed there. A ball that
// coasts has up to 0.3 (4 cells a radius) and 0.13 (8 cells), and advection is shown nearly all of
// it; what is beyond belongs to violent water (see NarrowFace).
constexpr double kLikely = 0.25, kMostExcess = 1.0;

double within(double x, double most) { return std::clamp(x, -most, most); }

// Speed around a face: of each component the largest at the faces beside it.
template <class Velocity>
double speed_around(const FaceField<double>& shape, int axis, std::size_t face,
                    const Velocity& velocity) {
  const Array3<double>& own = shape[axis];
  const int i = static_cast<int>(face % own.nx()), j = static_cast<int>(face / own.nx() % own.ny()),
            k = static_cast<int>(face / (static_cast<std::size_t>(own.nx()) * own.ny()));
  const double here = velocity(axis, face);
  double sum = here * here;
  for (int c = 0; c < 3; ++c) {
    if (c == axis) continue;
    const Array3<double>& across = shape[c];
    double most = 0.0;
    for (int side = 0; side < 4; ++side) {  // of the cells on both sides, both faces
      Vec3i at(i, j, k);
      at[axis] -= side & 1, at[c] += side >> 1;
      if (across.contains(at[0], at[1], at[2]))
        most = std::max(most, std::abs(velocity(c, across.index(at[0], at[1], at[2]))));
    }
    sum += most * most;
  }
  return std::sqrt(sum);
}

template <class Velocity>
std::vector<double> speeds_around(const FaceField<double>& shape,
                                  const std::vector<NarrowFace>& faces, const Velocity& velocity) {
  std::vector<double> speed(faces.size());
#pragma omp parallel for schedule(static)
  for (std::size_t n = 0; n < faces.size(); ++n)
    speed[n] = speed_around(shape, faces[n].axis, faces[n].face, velocity);
  return speed;
}

}  // namespace

void NarrowFlow::add(const NarrowFace& f, double beyond) {
  axis.push_back(static_cast<signed char>(f.axis));
  face.push_back(static_cast<std::int64_t>(f.face));
  open.push_back(f.open);
  excess.push_back(beyond);
}

NarrowFlow settle_after(const std::vector<NarrowFace>& faces, MacField& u) {
  const std::vector<double> speed =
      speeds_around(u, faces, [&](int axis, std::size_t f) { return u[axis][f]; });
  NarrowFlow flow;
  for (std::size_t n = 0; n < faces.size(); ++n) {
    const NarrowFace& f = faces[n];
    double& here = u[f.axis][f.face];
    here += within(f.after - here, kLikely * speed[n]);
    flow.add(f, within(f.after - here, kMostExcess * speed[n]));
  }
  return flow;
}

NarrowFlow settle_before(const std::vector<NarrowFace>& faces, MacField& u, MacField& push) {
  const std::vector<double> speed =
      speeds_around(u, faces, [&](int axis, std::size_t f) { return u[axis][f] + push[axis][f]; });
  NarrowFlow flow;
  for (std::size_t n = 0; n < faces.size(); ++n) {
    const NarrowFace& f = faces[n];
    double &here = u[f.axis][f.face], &pushed = push[f.axis][f.face];
    here += within(f.after - here, kLikely * speed[n]);
    pushed += within(f.before - f.after - pushed, kLikely * speed[n]);
    flow.add(f, within(f.before - (here + pushed), kMostExcess * speed[n]));
  }
  return flow;
}

void add_narrow_flow(const NarrowFlow& flow, const FaceField<double>& open, MacField& u) {
  for (std::size_t n = 0; n < flow.size(); ++n) {
    const Array3<double>& now = open[flow.axis[n]];
    const auto f = static_cast<std::size_t>(flow.face[n]);
    if (f >= now.size() || now[f] <= 0.0) continue;  // closed, or above the ceiling
    const double share = std::min(1.0, flow.open[n] / now[f]);
    u[flow.axis[n]][f] += share * flow.excess[n];
  }
}

}  // namespace archetide
