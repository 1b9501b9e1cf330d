#include "runtime/solid/nodal_space.h"
#include "runtime/solid/reduced_body.h"
#include "runtime/solid/rotation.h"

namespace archetide {
namespace {

/// Moment arm of vertex v, world.
Vec3 moment_arm(const ReducedBody& body, int v) {
  return deformed_arm(body, body.archetype->surface.vertices[v], modes_at_vertex(body, v));
}

/// origin + R (s (x + u) + d).
void moved_places(const ReducedBody& body, const std::vector<Vec3>& rest, const VecX& u,
                  const Vec3& origin, std::vector<Vec3>& places) {
  const auto shape = shape_correction(body, body.q);
  const Mat3 R = body.rotation.toRotationMatrix(), sR = shape->s * R;
  const Vec3 middle = origin + R * shape->shift;
  places.resize(rest.size());
  for (std::size_t k = 0; k < places.size(); ++k)
    places[k] = middle + sR * (rest[k] + u.segment<3>(3 * static_cast<long>(k)));
}

}  // namespace

MatX modes_at_vertex(const ReducedBody& body, int v) {
  if (!body.nodes) return body.archetype->surface_modes.block(3 * v, 0, 3, body.r);
  MatX phi = MatX::Zero(3, body.r);
  phi.middleCols<3>(body.nodes->first_dof(v)).setIdentity();
  return phi;
}

VecX surface_displacements(const ReducedBody& body, const VecX& q) {
  const Archetype& a = *body.archetype;
  if (body.nodes) return body.nodes->at_surface(q);
  if (body.r == 0) return VecX::Zero(3 * static_cast<long>(a.surface.vertices.size()));
  return a.surface_modes.leftCols(body.r) * q;
}

// Eq. 1, with the shape correction: x = t + R (s (x0 + S q) + d) (S2).
void deformed_places(const ReducedBody& body, const std::vector<Vec3>& rest, const MatX& modes,
                     const Vec3& origin, std::vector<Vec3>& places) {
  const VecX u = body.r > 0 ? VecX(modes.leftCols(body.r) * body.q)
                            : VecX(VecX::Zero(3 * static_cast<long>(rest.size())));
  moved_places(body, rest, u, origin, places);
}

Vec3 deformed_arm(const ReducedBody& body, const Vec3& rest, const MatX& phi) {
  const auto shape = shape_correction(body, body.q);
  return body.rotation * (shape->s * (rest + phi * body.q) + shape->shift);
}

void surface_places(const ReducedBody& body, const Vec3& origin, std::vector<Vec3>& places) {
  const Archetype& a = *body.archetype;
  if (body.nodes)
    moved_places(body, a.surface.vertices, body.nodes->at_surface(body.q), origin, places);
  else
    deformed_places(body, a.surface.vertices, a.surface_modes, origin, places);
}

Vec3 surface_point(const ReducedBody& body, int v) { return body.position + moment_arm(body, v); }

void surface_points(const ReducedBody& body, std::vector<Vec3>& points) {
  surface_places(body, body.position, points);
}

const std::vector<Vec3i>& wet_triangles(const ReducedBody& body) {
  return body.rung ? body.rung->surface.triangles : body.archetype->surface.triangles;
}

const MatX& wet_modes(const ReducedBody& body) {
  return body.rung ? body.rung->modes : body.archetype->surface_modes;
}

void wet_points(const ReducedBody& body, std::vector<Vec3>& points) {
  if (body.rung)
    deformed_places(body, body.rung->surface.vertices, body.rung->modes, body.position, points);
  else
    surface_points(body, points);
}

// Eq. S3.
MatX arm_jacobian(const ReducedBody& body, const ConfigurationTerms& terms, const Vec3& arm,
                  const MatX& phi) {
  const Mat3 arm_cross = skew(arm);
  MatX J(3, body.dofs());
  J.leftCols<3>().setIdentity();
  J.middleCols<3>(3) = -arm_cross;
  // Eq. 4, [1, −[a]×], and the modes of Eq. 21 with their rigid motion taken out (Eq. 16):
  // B_i = R (s φ_i + d_rate_i) + (d ln s/dq_i) x − (I⁻¹ D_i) × x
  J.rightCols(body.r) =
      body.rotation.toRotationMatrix() * (terms.shape.s * phi + terms.shape.shift_rate) +
      arm * terms.shape.slope.transpose() + arm_cross * terms.spin_of_modes;
  return J;
}

MatX point_jacobian(const ReducedBody& body, const ConfigurationTerms& terms, int v) {
  return arm_jacobian(body, terms, moment_arm(body, v), modes_at_vertex(body, v));
}

// Eq. 3: v + ω × a + B q̇.
Vec3 surface_velocity(const ReducedBody& body, const ConfigurationTerms& terms, int v) {
  return point_jacobian(body, terms, v) * generalised_velocity(body, terms);
}

}  // namespace archetide
