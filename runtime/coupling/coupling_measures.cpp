// Coupling: motion of the water and impulses of the velocity stage, for the budget, and the flow
// that moves with solids.

#include "runtime/coupling/coupling.h"
#include "runtime/numerics/parallel.h"

namespace archetide {

// Of the water that moves with a body whose reduced velocity is y.
WaterMotion Coupling::carried_motion(std::size_t b, const VecX& y) const {
  const VecX momentum = carried_[b] * y;
  const Vec3 P = momentum.head<3>();
  const Motion motion = {P, momentum.segment<3>(3) + surfaces_[b].centre.cross(P),
                         0.5 * momentum.dot(y)};
  return {motion, motion};
}

// Of all water at u, with what moves with the bodies at their y.
template <class Velocity>
WaterMotion Coupling::whole_motion(const MacField& u, const Array3<double>* held,
                                   const Velocity& y) const {
  WaterMotion motion = water_motion(options_.grid, system_, held, u);
  if (options_.geometry == Geometry::kCutCell)
    for (std::size_t b = 0; b < surfaces_.size(); ++b) motion += carried_motion(b, y(b));
  return motion;
}

void Coupling::measure_before(Stage stage, const MacField& u, const Array3<double>* held) {
  if (!wet() || stage != Stage::kVelocityFull) return;
  before_ = whole_motion(u, held, [&](std::size_t b) { return carried_velocity_[b]; });
}

void Coupling::measure_after(Stage stage, double dt, const Loads& loads,
                             const std::vector<CoupledBody>& coupled, const MacField& u,
                             const Array3<double>* held) {
  if (!wet() || stage != Stage::kVelocityFull) return;
  after_ = whole_motion(
      u, held, [&](std::size_t b) { return reduced_velocity(*surfaces_[b].body, coupled[b].y); });
  std::vector<VecX> still;  // without p'
  for (std::size_t b = 0; b < coupled.size(); ++b) {
    still.push_back(dt * loads.hydrostatic[b]);
    if (!loads.displaced.empty()) still[b] += loads.displaced[b];
  }
  measure_impulses(dt, coupled, still);
}

// Impulses of the velocity stage, for the budget; `hydrostatic`: on each body, 6 + r, N s.
void Coupling::measure_impulses(double dt, const std::vector<CoupledBody>& coupled,
                                const std::vector<VecX>& hydrostatic) {
  const PressureImpulses pushes =
      pressure_impulses(options_.grid, system_, dt, last_pressure(Stage::kVelocityFull), coupled);
  solid_impulse_ = pushes.solids;
  hydrostatic_impulse_ = pushes.surface;
  const WaterMotion gained = after_ - before_;
  const Motion beyond = gained.held - gained.solved;
  unmatched_impulse_ = {beyond.P, beyond.L};
  unmatched_impulse_ += pushes.bodies;
  for (std::size_t b = 0; b < coupled.size(); ++b) {
    const auto on_body = [&](const VecX& given) {
      return impulse_at(surfaces_[b].centre, given.head<3>(), given.segment<3>(3));
    };
    hydrostatic_impulse_ += on_body(hydrostatic[b]);
    unmatched_impulse_ += on_body(coupled[b].impulse);
  }
}

// Faces where water moves with a body or stands at an obstacle, with what it moves there.
void Coupling::collect_slip(const std::vector<CoupledBody>& coupled) {
  slip_faces_.clear();
  if (options_.geometry != Geometry::kCutCell) return;
  const Grid& g = options_.grid;
  const auto slipping = [&](const DualFaces& faces, const auto& speed) {
    std::vector<SlipFace> slip;
    for (const DualFace& f : faces)
      if (f.slip != 0.0)
        slip.push_back(
            {f.axis, open_[f.axis].index(f.face[0], f.face[1], f.face[2]), f.slip, speed(f)});
    return slip;
  };
  std::vector<std::vector<SlipFace>> of_body(coupled.size());
  for_each_large(coupled.size(), [&](std::size_t b) {
    if (skinned_[b]) return;
    const PlacedInnerFlow inner(inner_flow_of(*surfaces_[b].body->archetype), surfaces_[b]);
    const VecX y = reduced_velocity(*surfaces_[b].body, coupled[b].y);
    VecX whole, strain;
    of_body[b] = slipping(faces_[b], [&](const DualFace& f) {
      inner.at(g.face_centre(f.axis, f.face[0], f.face[1], f.face[2]), f.axis, whole, strain);
      return whole.dot(y);
    });
  });
  const auto add = [&](const std::vector<SlipFace>& slip) {
    slip_faces_.insert(slip_faces_.end(), slip.begin(), slip.end());
  };
  for (const DualFaces& faces : obstacle_faces_)
    add(slipping(faces, [](const DualFace&) { return 0.0; }));
  for (const std::vector<SlipFace>& slip : of_body) add(slip);
}

}  // namespace archetide
