#include "runtime/body_state.h"

#include <cmath>

namespace archetide {
namespace {

// One value of each body: gathered, written or read, scattered. `fits`: whether one that was read
// is of this body.
template <class T, class Get, class Fits>
void each(StateArchive& a, const std::string& name, std::vector<ReducedBody>& bodies,
          const Get& get, const Fits& fits) {
  std::vector<T> list;
  for (ReducedBody& body : bodies) list.push_back(T(get(body)));
  a.field(name, list);
  if (list.size() != bodies.size()) a.fail("field " + name + " is of another number of bodies");
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    if (!fits(bodies[b], list[b])) a.fail("field " + name + " is of another number of modes");
    get(bodies[b]) = list[b];
  }
}

// The same of values that keep their size.
template <class T, class Get>
void each(StateArchive& a, const std::string& name, std::vector<ReducedBody>& bodies,
          const Get& get) {
  each<T>(a, name, bodies, get,
          [&](ReducedBody& body, const T& x) { return get(body).size() == x.size(); });
}

template <class T, class Get>
void each_item(StateArchive& a, const std::string& name, ContactForces& forces, const Get& get) {
  std::vector<T> list;
  for (ContactForce& f : forces) list.push_back(get(f));
  a.field(name, list);
  // The first list gives their number.
  if (a.reading() && !forces.empty() && list.size() != forces.size())
    a.fail("field " + name + " is of another number of contacts");
  forces.resize(list.size());
  for (std::size_t n = 0; n < list.size(); ++n) get(forces[n]) = list[n];
}

}  // namespace

void body_fields(StateArchive& a, const std::string& name, std::vector<ReducedBody>& bodies) {
  using Body = ReducedBody;
  each<Vec3>(a, name + "/position", bodies, [](Body& b) -> Vec3& { return b.position; });
  each<VecX>(
      a, name + "/rotation", bodies, [](Body & b) -> auto& { return b.rotation.coeffs(); });
  each<Vec3>(a, name + "/P", bodies, [](Body& b) -> Vec3& { return b.P; });
  each<Vec3>(a, name + "/L", bodies, [](Body& b) -> Vec3& { return b.L; });
  each<VecX>(a, name + "/q", bodies, [](Body& b) -> VecX& { return b.q; });
  each<VecX>(a, name + "/q_dot", bodies, [](Body& b) -> VecX& { return b.q_dot; });
  each<VecX>(
      a, name + "/last_way", bodies, [](Body& b) -> VecX& { return b.last_way; },
      [](const Body& b, const VecX& y) { return y.size() == 0 || y.size() == b.dofs(); });
  each<VecX>(
      a, name + "/last_push", bodies, [](Body& b) -> VecX& { return b.last_push; },
      [](const Body& b, const VecX& f) {
        return f.size() == 0 || (f.size() == b.r && b.archetype->nonlinear());
      });
  constexpr double kRoundOff = 1e-6;
  for (const Body& b : bodies)
    if (std::abs(b.rotation.norm() - 1.0) > kRoundOff)
      a.fail("field " + name + "/rotation holds something that is no rotation");
}

void contact_fields(StateArchive& a, const std::string& name, ContactForces& forces) {
  using Force = ContactForce;
  if (a.reading()) forces.clear();
  each_item<int>(a, name + "/a", forces, [](Force& f) -> int& { return f.a; });
  each_item<int>(a, name + "/b", forces, [](Force& f) -> int& { return f.b; });
  each_item<int>(a, name + "/sample", forces, [](Force& f) -> int& { return f.sample; });
  each_item<Vec3>(a, name + "/force", forces, [](Force& f) -> Vec3& { return f.force; });
}

}  // namespace archetide
