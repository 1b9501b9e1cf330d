#include "runtime/contact/wall_contact.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/solid/extent.h"

namespace archetide {
namespace {

constexpr int kDirections = 8;
constexpr double kSlack =
    0.1;  // of the tolerance: less penetration is left alone, or rest would be jitter

Vec3 inward_normal(int side) { return (side % 2 == 0 ? 1.0 : -1.0) * Vec3::Unit(side / 2); }

double gap_to(const WallContactOptions& o, int side, const Vec3& x) {
  const int axis = side / 2;
  return side % 2 == 0 ? x[axis] - o.low[axis] : o.high[axis] - x[axis];
}

/// Directions between the axes, so that the corners of an aligned box are its only extremes.
std::array<Eigen::Vector2d, kDirections> directions() {
  std::array<Eigen::Vector2d, kDirections> out;
  constexpr double kPi = 3.14159265358979323846;
  for (int d = 0; d < kDirections; ++d) {
    const double angle = (2.0 * d + 1.0) * kPi / kDirections;
    out[d] = Eigen::Vector2d(std::cos(angle), std::sin(angle));
  }
  return out;
}

std::vector<int> touching_vertices(const std::vector<Vec3>& points, const WallContactOptions& o,
                                   int side) {
  std::vector<int> touching;
  for (int v = 0; v < static_cast<int>(points.size()); ++v)
    if (gap_to(o, side, points[v]) <= o.tolerance) touching.push_back(v);
  return touching;
}

/// The deepest vertex and the extreme ones, deepest first, without repetition.
std::vector<int> support_of(const std::vector<int>& touching, const std::vector<Vec3>& points,
                            const WallContactOptions& o, int side) {
  static const std::array<Eigen::Vector2d, kDirections> kAlong = directions();
  const int u = (side / 2 + 1) % 3, w = (side / 2 + 2) % 3;
  const auto gap = [&](int v) { return gap_to(o, side, points[v]); };
  std::vector<int> chosen;
  for (const Eigen::Vector2d& d : kAlong)
    chosen.push_back(*std::max_element(touching.begin(), touching.end(), [&](int a, int b) {
      return d.dot(Eigen::Vector2d(points[a][u], points[a][w])) <
             d.dot(Eigen::Vector2d(points[b][u], points[b][w]));
    }));
  const auto shallower = [&](int a, int b) { return gap(a) < gap(b); };
  const int deepest = *std::min_element(touching.begin(), touching.end(), shallower);
  const int deepest_chosen = *std::min_element(chosen.begin(), chosen.end(), shallower);
  // a flat side has no deepest point
  constexpr double kFlat = 0.01;  // of the tolerance
  if (gap(deepest) < gap(deepest_chosen) - kFlat * o.tolerance) chosen.push_back(deepest);

  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  std::stable_sort(chosen.begin(), chosen.end(), shallower);
  return chosen;
}

/// Separating speeds wanted: −e times the approach where it is faster than the resting speed.
VecX rebound(const VecX& separating, double restitution, const WallContactOptions& o) {
  return separating.unaryExpr(
      [&](double v) { return v < -o.resting_speed ? -restitution * v : 0.0; });
}

/// Translation out of the walls by the deepest penetration of each side; half-way between two
/// opposite ones.
Vec3 push_out(const std::vector<ContactPoint>& contacts, double slack) {
  Vec3 up = Vec3::Zero(), down = Vec3::Zero();
  for (const ContactPoint& c : contacts) {
    const Vec3 out = (c.gap < -slack ? -c.gap : 0.0) * c.normal;
    up = up.cwiseMax(out);
    down = down.cwiseMin(out);
  }
  Vec3 shift = up + down;
  for (int axis = 0; axis < 3; ++axis)
    if (up[axis] > 0.0 && down[axis] < 0.0) shift[axis] *= 0.5;
  return shift;
}

/// Side of a contact, from its normal.
int side_of(const ContactPoint& c) {
  int axis = 0;
  c.normal.cwiseAbs().maxCoeff(&axis);
  return 2 * axis + (c.normal[axis] < 0.0);
}

bool contains(const std::vector<ContactPoint>& list, const ContactPoint& c) {
  return std::any_of(list.begin(), list.end(), [&](const ContactPoint& other) {
    return other.vertex == c.vertex && side_of(other) == side_of(c);
  });
}

/// Adds those of `held` that are missing, with their present gaps.
void add_held(std::vector<ContactPoint>& contacts, const std::vector<ContactPoint>& held,
              const std::vector<Vec3>& points, const WallContactOptions& o) {
  for (ContactPoint c : held) {
    c.gap = gap_to(o, side_of(c), points[c.vertex]);
    if (!contains(contacts, c)) contacts.push_back(c);
  }
}

/// Impulses on v^n through the mass of x^{n+1}. Returns the separating speeds that they leave.
VecX apply_impulses(ReducedBody& body, const std::vector<ContactPoint>& contacts,
                    const WallContactOptions& o, Vec3& wall_impulse) {
  const ConfigurationTerms terms =
      configuration_terms(body, current_configuration(body), o.modal.mass);
  const GeneralisedMass H = generalised_mass(body, terms, o.dt, Stage::kVelocityFull, o.modal.step);
  const MatX normals = contact_rows(body, terms, contacts);
  const MatX tangents = tangent_rows(body, terms, contacts);
  VecX y = generalised_velocity(body, terms);
  const ContactImpulses impulses =
      push_apart(H, normals, tangents, rebound(normals * y, o.at(body).restitution, o),
                 o.at(body).friction, y);
  const VecX given = generalised_impulse(normals, tangents, impulses);
  accept_velocity(body, y, given.head<3>(), given.segment<3>(3));
  wall_impulse = -given.head<3>();
  return normals * y;
}

/// Every point that touches, and the others that are close: no point may approach faster than its
/// gap allows.
StageContacts velocity_contacts(const std::vector<ContactPoint>& contacts, double restitution,
                                const WallContactOptions& o) {
  StageContacts out;
  std::vector<double> target;
  const double fastest = restitution > 0.0 ? o.resting_speed : INFINITY;
  for (const ContactPoint& c : contacts) {
    const bool touches = c.gap <= o.tolerance;
    if (!touches && (o.dt <= 0.0 || c.gap / o.dt > fastest)) continue;
    out.points.push_back(c);
    target.push_back(touches ? 0.0 : -c.gap / o.dt);
  }
  out.target = Eigen::Map<const VecX>(target.data(), static_cast<long>(target.size()));
  return out;
}

VecX closing_targets(const std::vector<ContactPoint>& points, double dt) {
  VecX target(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) target[k] = -points[k].gap / dt;
  return target;
}

}  // namespace

StageContacts reachable_wall_contacts(const ReducedBody& body, const FreeMotion& half, double dt,
                                      const WallContactOptions& options) {
  constexpr int kTrials = 10;
  WallContactOptions beyond = options;
  beyond.tolerance = -kSlack * options.tolerance;
  StageContacts out;
  VecX y = half.y_star;
  std::vector<Vec3> points;
  for (int trial = 0; trial < kTrials; ++trial) {
    ReducedBody moved = body;
    advance_pose(moved, half, y, dt);
    surface_points(moved, points);
    const std::size_t known = out.points.size();
    for (ContactPoint c : find_wall_contacts(points, beyond)) {
      c.gap = gap_to(options, side_of(c), surface_point(body, c.vertex));
      if (!contains(out.points, c)) out.points.push_back(c);
    }
    if (out.points.size() == known) break;

    const MatX rows = contact_rows(body, half.terms, out.points);
    out.target = closing_targets(out.points, dt);
    y = half.y_star;
    push_apart(half.H, rows, MatX::Zero(2 * rows.rows(), rows.cols()), out.target, 0.0, y);
  }
  return out;
}

std::vector<ContactPoint> find_wall_contacts(const std::vector<Vec3>& points,
                                             const WallContactOptions& options) {
  std::vector<ContactPoint> contacts;
  for (int side = 0; side < 6; ++side) {
    if (!options.closed[side]) continue;
    const std::vector<int> touching = touching_vertices(points, options, side);
    if (touching.empty()) continue;
    for (int v : support_of(touching, points, options, side))
      contacts.push_back({v, inward_normal(side), gap_to(options, side, points[v])});
  }
  return contacts;
}

WallContactResult resolve_wall_contacts(ReducedBody& body, const WallContactOptions& options,
                                        const std::vector<ContactPoint>& held) {
  WallContactResult result;
  std::vector<Vec3> points;
  surface_points(body, points);
  std::vector<ContactPoint> contacts = find_wall_contacts(points, options);
  add_held(contacts, held, points, options);
  const auto first_apart =
      std::stable_partition(contacts.begin(), contacts.end(),
                            [&](const ContactPoint& c) { return c.gap <= options.tolerance; });
  const std::vector<ContactPoint> touching(contacts.begin(), first_apart);
  result.contacts = static_cast<int>(touching.size());
  VecX separating;
  if (!touching.empty()) separating = apply_impulses(body, touching, options, result.wall_impulse);

  if (options.push_out) result.push_out = push_out(touching, kSlack * options.tolerance);
  body.position += result.push_out;
  for (ContactPoint& c : contacts) c.gap += c.normal.dot(result.push_out);

  constexpr double kLeaving = 1e-8;  // m/s
  for (std::size_t k = 0; k < touching.size(); ++k)
    if (contacts[k].gap <= options.tolerance && separating[k] <= kLeaving)
      result.resting.push_back(contacts[k]);
  result.velocity_stage = velocity_contacts(contacts, options.at(body).restitution, options);
  return result;
}

BodyReach body_reach(const Archetype& archetype) {
  BodyReach reach{bounding_radius(archetype), VecX::Zero(archetype.r())};
  for (int i = 0; i < archetype.r(); ++i)
    reach.modes[i] = largest_displacement(archetype.surface_modes.col(i));
  return reach;
}

namespace {

/// A bound of |S q| over the surface, m.
double farthest_displacement(const ReducedBody& body, const BodyReach& reach) {
  if (!body.nodes) return reach.modes.head(body.r).dot(body.q.cwiseAbs());
  const VecX u = surface_displacements(body, body.q);
  return Eigen::Map<const Eigen::Matrix3Xd>(u.data(), 3, u.size() / 3).colwise().norm().maxCoeff();
}

}  // namespace

double farthest_point(const ReducedBody& body, const BodyReach& reach) {
  const auto shape = shape_correction(body, body.q);
  return shape->s * (reach.rest + farthest_displacement(body, reach)) + shape->shift.norm();
}

bool away_from_walls(const ReducedBody& body, const BodyReach& reach,
                     const WallContactOptions& options, double margin) {
  const double radius = farthest_point(body, reach) + options.tolerance + margin;
  for (int side = 0; side < 6; ++side)
    if (options.closed[side] && gap_to(options, side, body.position) <= radius) return false;
  return true;
}

}  // namespace archetide
