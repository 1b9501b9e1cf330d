#include "runtime/contact/contact_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "common/base/exception_carrier.h"

namespace archetide {
namespace {

/// Surfaces that face each other touch; that run along each other they are the two sides of one
/// overlap.
constexpr double kFacing = 0.3;

constexpr std::size_t kMaxPatches = 6;  // of an ordered pair
/// Fewer bodies or pairs than this are not worth waking threads for.
constexpr std::size_t kParallelFrom = 16;

struct Box {
  Vec3 low, high;
};

bool overlap(const Box& p, const Box& q) {
  return (p.low.array() <= q.high.array()).all() && (q.low.array() <= p.high.array()).all();
}

/// A ball around the body at any deformation, widened by its margin: O(r).
Box loose_box(const ReducedBody& body, const ContactShape& shape, double margin) {
  const double radius = farthest_point(body, shape.reach) + margin;
  return {body.position - Vec3::Constant(radius), body.position + Vec3::Constant(radius)};
}

/// Pairs (i < j) of boxes that overlap, sorted: sweep along x.
std::vector<std::pair<int, int>> overlapping_pairs(const std::vector<Box>& boxes) {
  std::vector<int> order(boxes.size());
  for (std::size_t n = 0; n < order.size(); ++n) order[n] = static_cast<int>(n);
  std::stable_sort(order.begin(), order.end(),
                   [&](int p, int q) { return boxes[p].low.x() < boxes[q].low.x(); });
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t n = 0; n < order.size(); ++n)
    for (std::size_t m = n + 1; m < order.size(); ++m) {
      if (boxes[order[m]].low.x() > boxes[order[n]].high.x()) break;
      if (overlap(boxes[order[n]], boxes[order[m]]))
        pairs.push_back(std::minmax(order[n], order[m]));
    }
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

/// Where the covers of wanted bodies are; all bodies under such a cover become wanted.
class CoverPoints {
 public:
  CoverPoints(const std::vector<ContactCover>& covers, const std::vector<ReducedBody>& bodies,
              std::vector<char>& wanted)
      : points_(covers.size()), of_(bodies.size(), nullptr) {
    for (std::size_t c = 0; c < covers.size(); ++c) {
      const std::vector<int>& under = covers[c].bodies;
      if (std::none_of(under.begin(), under.end(), [&](int b) { return wanted[b] != 0; })) continue;
      covers[c].points(bodies, points_[c]);
      for (const int b : under) of_[b] = &points_[c], wanted[b] = 1;
    }
  }
  CoverPoints(const CoverPoints&) = delete;
  CoverPoints& operator=(const CoverPoints&) = delete;
  const std::vector<Vec3>* of(std::size_t body) const { return of_[body]; }

 private:
  std::vector<std::vector<Vec3>> points_;
  std::vector<const std::vector<Vec3>*> of_;
};

/// Per body, its share of its cover, or null.
std::vector<std::unique_ptr<TouchedSolid>> covered_solids(
    const std::vector<ContactCover>& covers,
    const std::vector<std::unique_ptr<DeformedBody>>& deformed) {
  std::vector<std::unique_ptr<TouchedSolid>> solids(deformed.size());
  for (const ContactCover& cover : covers) {
    std::vector<const DeformedBody*> under;
    for (const int b : cover.bodies) under.push_back(deformed[b].get());
    if (under.empty() || !under.front()) continue;
    for (std::size_t p = 0; p < under.size(); ++p)
      solids[cover.bodies[p]] =
          std::make_unique<CoveredSolid>(*cover.shape, under, static_cast<int>(p));
  }
  return solids;
}

/// Samples of body a against one solid.
struct Task {
  int a, b;
  const TouchedSolid* solid;
  double margin;  // m
};

struct Candidate {
  int sample;
  bool carried;  // load in the last step
  SolidPoint at;
};

std::vector<Candidate> candidates(const DeformedBody& body, const Task& task,
                                  const ContactForces& before) {
  std::vector<Candidate> found;
  const std::vector<SampleCluster>& clusters = body.shape().clusters;
  // gaps are stretched by the solid's strain: look twice as far with the cheap bound
  const double reach = 2.0 * task.margin;
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    const DeformedBody::Ball& ball = body.balls()[c];
    if (task.solid->least_gap(ball.centre) > ball.radius + reach) continue;
    for (int s = clusters[c].begin; s < clusters[c].end; ++s) {
      const Vec3& x = body.samples()[s];
      if (task.solid->least_gap(x) > reach) continue;
      SolidPoint at;
      if (!task.solid->locate(x, task.margin, at)) continue;
      found.push_back({s, find_force(before, task.a, task.b, s) != nullptr, at});
    }
  }
  return found;
}

/// A rigid motion for the length of a step.
struct StepMotion {
  Vec3 centre = Vec3::Zero(), shift = Vec3::Zero();  // m
  Mat3 turn = Mat3::Identity();
  Vec3 spin = Vec3::Zero();  // angle that `turn` is, rad

  StepMotion() = default;
  StepMotion(const ReducedBody& body, double dt) : centre(body.position) {
    const ConfigurationTerms terms =
        configuration_terms(body, current_configuration(body), ModalMass::kExact);
    shift = dt / terms.mass * body.P;
    spin = dt * (terms.inertia_inverse * body.L);
    turn = Eigen::AngleAxisd(spin.norm(), spin.stableNormalized()).toRotationMatrix();
  }
  Vec3 moved_back(const Vec3& x) const { return centre + turn.transpose() * (x - centre - shift); }
  /// To first order.
  Vec3 way(const Vec3& x) const { return shift + spin.cross(x - centre); }
};

/// BodyContact::clearance of a sample at x, which goes straight on: a vertex that rolls off the
/// ground does not say that the next one comes down. (With its own turn counted, a ball that rolls
/// down a slope was 10 % slow instead of 1 %.)
double clearance(const Vec3& x, const SolidPoint& at, const TouchedSolid& solid,
                 const StepMotion& mine, const StepMotion& its) {
  constexpr double kSameSide = 0.7;  // cosine: not through it, nor over an edge
  SolidPoint then;
  if (!solid.locate(its.moved_back(x + mine.way(x)), 1e9, then)) return 0.0;
  if (then.normal.dot(at.normal) < kSameSide) return 0.0;
  return std::max(0.0, then.gap - at.gap - at.normal.dot(mine.way(x) - its.way(x)));
}

/// Candidates around one place that face one way.
struct Patch {
  Vec3 place, normal;  // of its deepest
  double gap;          // m, of its deepest
  std::vector<const Candidate*> members;
};

std::vector<Patch> patches(const std::vector<Candidate>& sorted, const DeformedBody& body) {
  constexpr double kRadius = 1.0, kOneWay = 0.8;  // of the reach; cosine
  std::vector<Patch> out;
  for (const Candidate& c : sorted) {
    const Vec3& x = body.samples()[c.sample];
    const auto home = std::find_if(out.begin(), out.end(), [&](const Patch& p) {
      return (p.place - x).norm() < kRadius * body.shape().reach.rest &&
             p.normal.dot(c.at.normal) > kOneWay;
    });
    if (home != out.end())
      home->members.push_back(&c);
    else if (out.size() < kMaxPatches)
      out.push_back({x, c.at.normal, c.at.gap, {&c}});
  }
  return out;
}

/// The deepest of a patch and the outermost that are nearly as deep: what holds a body best with
/// the fewest points, and the same points as long as nothing moves.
void add_support(const Patch& patch, const DeformedBody& body, double margin,
                 std::vector<const Candidate*>& kept) {
  constexpr int kDirections = 8;
  constexpr double kBand = 0.5;  // of the margin
  const auto keep = [&](const Candidate* c) {
    if (std::find(kept.begin(), kept.end(), c) == kept.end()) kept.push_back(c);
  };
  const Mat3 frame = contact_frame(patch.normal);
  for (int d = 0; d < kDirections; ++d) {
    const double angle = (2.0 * d + 1.0) * std::numbers::pi / kDirections;
    const Vec3 along = frame.transpose() * Vec3(0.0, std::cos(angle), std::sin(angle));
    const Candidate* outermost = nullptr;
    double farthest = -INFINITY;
    for (const Candidate* c : patch.members) {
      if (c->at.gap > patch.gap + kBand * margin) continue;
      const double distance = along.dot(body.samples()[c->sample] - patch.place);
      if (distance > farthest + 1e-9 * body.shape().reach.rest) farthest = distance, outermost = c;
    }
    keep(outermost);
  }
  // the deepest, unless one of these is as deep
  constexpr double kFlat = 0.01;  // of the margin
  for (const Candidate* c : kept)
    if (c->at.gap <= patch.gap + kFlat * margin) return;
  keep(patch.members.front());
}

/// Of a body whose surface gives way between the points that hold it: the deepest, and all that are
/// some way from those that are deeper [D77].
void add_spread(const std::vector<Candidate>& sorted, const DeformedBody& body, int most,
                std::vector<const Candidate*>& kept) {
  constexpr double kApart = 2.0;  // spacings of the samples
  const double apart = kApart * body.shape().spacing;
  for (const Candidate& c : sorted) {
    if (static_cast<int>(kept.size()) == most) return;
    const Vec3& x = body.samples()[c.sample];
    if (std::none_of(kept.begin(), kept.end(), [&](const Candidate* k) {
          return (body.samples()[k->sample] - x).norm() < apart;
        }))
      kept.push_back(&c);
  }
}

std::vector<Candidate> thinned(std::vector<Candidate> all, const DeformedBody& body,
                               double margin) {
  constexpr double kSame = 1e-3;  // of the margin: equally deep
  const auto depth_class = [&](const Candidate& c) {
    return std::floor(c.at.gap / (kSame * margin));
  };
  std::sort(all.begin(), all.end(), [&](const Candidate& p, const Candidate& q) {
    return std::pair(depth_class(p), body.shape().samples[p.sample].order) <
           std::pair(depth_class(q), body.shape().samples[q.sample].order);
  });
  std::vector<const Candidate*> kept;
  const int most = body.gives_way() ? kMaxSoftContacts : kMaxContacts;
  for (const Patch& patch : patches(all, body)) add_support(patch, body, margin, kept);
  if (body.gives_way()) add_spread(all, body, most, kept);
  // A point that carried load in the last step stays: on a soft body those between the outermost
  // take turns otherwise, and it never settles.
  for (const Candidate& c : all)
    if (c.carried && static_cast<int>(kept.size()) < most &&
        std::find(kept.begin(), kept.end(), &c) == kept.end())
      kept.push_back(&c);
  std::vector<Candidate> out;
  for (const Candidate* c : kept) out.push_back(*c);
  std::sort(out.begin(), out.end(),
            [](const Candidate& p, const Candidate& q) { return p.sample < q.sample; });
  return out;
}

/// Directions that differ for every index, evenly over the sphere.
Vec3 direction_of(int body) {
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  const double z = std::fmod(0.5 + body * 0.6180339887498949, 1.0) * 2.0 - 1.0;
  const double rho = std::sqrt(1.0 - z * z);
  return {rho * std::cos(golden * body), rho * std::sin(golden * body), z};
}

/// Whether sample s of p lies on q's surface and faces the way of it: thin bodies on one another
/// face each other.
bool on_same_surface(const DeformedBody& p, const DeformedBody& q, std::size_t s, double near) {
  SolidPoint at;
  const Vec3& x = p.samples()[s];
  return q.least_gap(x) < near && q.locate(x, near, at) && std::abs(at.gap) < near &&
         p.normal(static_cast<int>(s)).dot(at.normal) > kFacing;
}

/// Whether the body at rest holds its own centre: a ring does not.
bool holds_itself(const DeformedBody& body) { return body.shape().sdf().value(Vec3::Zero()) < 0.0; }

/// Two bodies so far in one another that their surfaces do not say which way is out: each holds the
/// other's centre, and its own, or their surfaces coincide. Rings that are linked hold each other's
/// centres.
bool merged(const DeformedBody& p, const DeformedBody& q) {
  constexpr double kClose = 0.5, kAlong = 0.05;  // of the smaller reach
  constexpr double kMost = 0.8;                  // of the samples
  const double reach = std::min(p.shape().reach.rest, q.shape().reach.rest);
  if ((p.centre() - q.centre()).norm() > reach) return false;
  SolidPoint in_p, in_q;
  if (holds_itself(p) && holds_itself(q) && p.locate(q.centre(), 0.0, in_p) &&
      q.locate(p.centre(), 0.0, in_q))
    return true;
  if ((p.centre() - q.centre()).norm() > kClose * reach) return false;
  const std::size_t samples = p.samples().size();
  std::size_t along = 0;
  for (std::size_t s = 0; s < samples; ++s) {
    along += on_same_surface(p, q, s, kAlong * reach);
    if (along + (samples - s - 1) <= kMost * static_cast<double>(samples)) return false;
  }
  return true;
}

/// They are taken apart along the line of their centres, or, where these coincide, along a
/// direction of their indices.
BodyContact centre_contact(const std::vector<ReducedBody>& bodies, int a, int b, double reach) {
  BodyContact c;
  c.a = a, c.b = b, c.sample = -1;
  const Vec3 line = bodies[a].position - bodies[b].position;
  constexpr double kCoincident = 1e-6;  // of the reach
  c.normal = line.norm() > kCoincident * reach ? line.normalized()
                                               : (direction_of(a) - direction_of(b)).normalized();
  c.point = 0.5 * (bodies[a].position + bodies[b].position);
  c.rest_b = bodies[b].rotation.conjugate() * (c.point - bodies[b].position);
  c.gap = std::min(line.norm() - reach, 0.0);
  return c;
}

// Which bodies may meet, by bounding balls, and the boxes of those that may meet anything.
struct NearBodies {
  std::vector<Box> boxes;  // of each body, with its margin
  std::vector<std::pair<int, int>> pairs;
  std::vector<char> wanted;  // of each body
};

NearBodies near_bodies(const std::vector<ReducedBody>& bodies,
                       const std::vector<const ContactShape*>& shapes,
                       const Surroundings& surroundings, const std::vector<double>& margin,
                       const SearchOptions& options) {
  NearBodies near{{}, {}, std::vector<char>(bodies.size(), 0)};
  for (std::size_t b = 0; b < bodies.size(); ++b)
    near.boxes.push_back(loose_box(bodies[b], *shapes[b], margin[b]));
  near.pairs = overlapping_pairs(near.boxes);
  std::erase_if(near.pairs, [&](const auto& pair) {
    const bool both_told = bodies[pair.first].prescribed && bodies[pair.second].prescribed;
    return !options.each_other || both_told || options.apart.count(pair) > 0;
  });
  for (const auto& [i, j] : near.pairs) near.wanted[i] = near.wanted[j] = 1;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    for (const Surroundings::Item& item : surroundings.items())
      if (!bodies[b].prescribed && overlap(near.boxes[b], {item.low, item.high}))
        near.wanted[b] = 1;
  return near;
}

using Deformed = std::vector<std::unique_ptr<DeformedBody>>;  // of each body; null: not wanted

// Surfaces of the bodies that are wanted; their boxes become those of these.
Deformed deform(const std::vector<ReducedBody>& bodies,
                const std::vector<const ContactShape*>& shapes, const CoverPoints& covers,
                const std::vector<double>& margin, NearBodies& near) {
  Deformed deformed(bodies.size());
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic) if (near.pairs.size() > kParallelFrom)
  for (std::size_t b = 0; b < bodies.size(); ++b)
    carrier.run([&] {
      if (!near.wanted[b]) return;
      deformed[b] = std::make_unique<DeformedBody>(bodies[b], *shapes[b], covers.of(b));
      near.boxes[b] = {deformed[b]->low() - Vec3::Constant(margin[b]),
                       deformed[b]->high() + Vec3::Constant(margin[b])};
    });
  carrier.rethrow();
  return deformed;
}

// Samples of one against the distance of the other, for what is near. Bodies that have merged get a
// contact of their centres instead, in `contacts`.
std::vector<Task> tasks_of(const NearBodies& near, const Deformed& deformed,
                           const std::vector<const TouchedSolid*>& solids,
                           const Surroundings& surroundings, const std::vector<double>& margin,
                           const std::vector<ReducedBody>& bodies,
                           const std::vector<const ContactShape*>& shapes,
                           std::vector<BodyContact>& contacts) {
  std::vector<Task> tasks;
  for (const auto& [i, j] : near.pairs) {
    if (!overlap(near.boxes[i], near.boxes[j])) continue;
    if (merged(*deformed[i], *deformed[j])) {
      contacts.push_back(
          centre_contact(bodies, i, j, std::min(shapes[i]->reach.rest, shapes[j]->reach.rest)));
      continue;
    }
    tasks.push_back({i, j, solids[j], margin[i] + margin[j]});
    tasks.push_back({j, i, solids[i], margin[i] + margin[j]});
  }
  for (int b = 0; b < static_cast<int>(bodies.size()); ++b)
    for (int s = 0; s < static_cast<int>(surroundings.items().size()); ++s) {
      const Surroundings::Item& item = surroundings.items()[s];
      if (near.wanted[b] && !bodies[b].prescribed && overlap(near.boxes[b], {item.low, item.high}))
        tasks.push_back({b, -1 - s, item.solid.get(), margin[b]});
    }
  return tasks;
}

// Contacts of one task: the deepest samples of each patch; in `near`, unless null, all candidates.
std::vector<BodyContact> contacts_of(const Task& task, const DeformedBody& body,
                                     const ContactForces& before,
                                     const std::vector<StepMotion>& motions,
                                     std::vector<BodyContact>* near) {
  const StepMotion still;
  const StepMotion& its = task.b >= 0 ? motions[task.b] : still;
  std::vector<Candidate> all = candidates(body, task, before);
  if (task.b >= 0)
    std::erase_if(
        all, [&](const Candidate& c) { return body.normal(c.sample).dot(c.at.normal) > kFacing; });
  const auto contact = [&](const Candidate& c, double clearance) {
    return BodyContact{task.a,      task.b,    c.sample, body.samples()[c.sample],
                       c.at.normal, c.at.rest, c.at.gap, clearance};
  };
  if (near)
    for (const Candidate& c : all) near->push_back(contact(c, 0.0));
  std::vector<BodyContact> found;
  for (const Candidate& c : thinned(std::move(all), body, task.margin)) {
    const Vec3& x = body.samples()[c.sample];
    found.push_back(contact(c, clearance(x, c.at, *task.solid, motions[task.a], its)));
  }
  return found;
}

}  // namespace

Mat3 contact_frame(const Vec3& n) {
  int largest = 0;
  n.cwiseAbs().maxCoeff(&largest);
  const Vec3 t = n.cross(Vec3::Unit((largest + 1) % 3)).normalized();
  Mat3 frame;
  frame << n.transpose(), t.transpose(), n.cross(t).transpose();
  return frame;
}

const ContactForce* find_force(const ContactForces& forces, int a, int b, int sample) {
  const auto at = std::lower_bound(forces.begin(), forces.end(), std::tuple(a, b, sample),
                                   [](const ContactForce& f, const std::tuple<int, int, int>& key) {
                                     return std::tuple(f.a, f.b, f.sample) < key;
                                   });
  const bool found = at != forces.end() && at->a == a && at->b == b && at->sample == sample;
  return found ? &*at : nullptr;
}

Surroundings::Surroundings(const Vec3& low, const Vec3& high, const Sides& closed,
                           const std::vector<TriMesh>& obstacles, double spacing) {
  constexpr double kFar = 1e300;
  for (int side = 0; side < 6; ++side) {
    if (!closed[side]) continue;
    const int axis = side / 2;
    const Vec3 inward = (side % 2 == 0 ? 1.0 : -1.0) * Vec3::Unit(axis);
    const double offset = side % 2 == 0 ? low[axis] : -high[axis];
    Item item{std::make_unique<WallSolid>(inward, offset), Vec3::Constant(-kFar),
              Vec3::Constant(kFar)};
    (side % 2 == 0 ? item.high : item.low)[axis] = side % 2 == 0 ? low[axis] : high[axis];
    items_.push_back(std::move(item));
  }
  for (const TriMesh& mesh : obstacles) {
    auto solid = std::make_unique<StaticSolid>(mesh, spacing);
    const Vec3 box_low = solid->low(), box_high = solid->high();
    items_.push_back({std::move(solid), box_low, box_high});
  }
}

const ContactShape& ShapeLibrary::of(const ReducedBody& body) {
  const bool nodes = body.nodes != nullptr;
  auto& shape = shapes_[{body.archetype.get(), body.rung, nodes}];
  if (!shape) shape = contact_shape(body.archetype, body.rung, nodes);
  return *shape;
}

std::size_t ShapeLibrary::bytes() const {
  std::size_t bytes = 0;
  for (const auto& [kind, shape] : shapes_)
    bytes += sizeof(SurfaceSample) * shape->samples.size() + 8 * shape->lattice.modes.size() +
             sizeof(VertexShare) * shape->lattice.shares.size() + 4 * shape->sampled.values.size();
  return bytes;
}

std::vector<BodyContact> find_contacts(const std::vector<ReducedBody>& bodies,
                                       const std::vector<const ContactShape*>& shapes,
                                       const Surroundings& surroundings,
                                       const std::vector<double>& margin,
                                       const ContactForces& before, const SearchOptions& options,
                                       double dt, std::vector<BodyContact>* points_near) {
  NearBodies near = near_bodies(bodies, shapes, surroundings, margin, options);
  const CoverPoints covers(options.covers, bodies, near.wanted);
  const Deformed deformed = deform(bodies, shapes, covers, margin, near);
  const std::vector<std::unique_ptr<TouchedSolid>> covered =
      covered_solids(options.covers, deformed);
  std::vector<const TouchedSolid*> solids;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    solids.push_back(covered[b] ? covered[b].get() : deformed[b].get());

  std::vector<BodyContact> contacts;
  const std::vector<Task> tasks =
      tasks_of(near, deformed, solids, surroundings, margin, bodies, shapes, contacts);
  std::vector<StepMotion> motions(bodies.size());
  for (std::size_t b = 0; b < bodies.size(); ++b)
    if (deformed[b]) motions[b] = StepMotion(bodies[b], dt);

  const auto bends_far = [&](int b) { return b >= 0 && bodies[b].is_nonlinear(); };
  std::vector<std::vector<BodyContact>> found(tasks.size()), all(tasks.size());
  ExceptionCarrier carrier;
#pragma omp parallel for schedule(dynamic) if (tasks.size() > kParallelFrom)
  for (std::size_t t = 0; t < tasks.size(); ++t)
    carrier.run([&] {
      const bool wanted = points_near && (bends_far(tasks[t].a) || bends_far(tasks[t].b));
      found[t] =
          contacts_of(tasks[t], *deformed[tasks[t].a], before, motions, wanted ? &all[t] : nullptr);
    });
  carrier.rethrow();
  for (const std::vector<BodyContact>& list : found)
    contacts.insert(contacts.end(), list.begin(), list.end());
  for (const std::vector<BodyContact>& list : all)
    if (points_near) points_near->insert(points_near->end(), list.begin(), list.end());
  return contacts;
}

}  // namespace archetide
