#include "runtime/solid/reduced_body.h"
#include "runtime/solid/rotation.h"

namespace archetide {
namespace {

/// φ_i at surface vertex v, body frame, 3 x r.
auto modes_at(const ReducedBody& body, int v) {
  return body.archetype->surface_modes.block(3 * v, 0, 3, body.r);
}

/// Moment arm of vertex v, world: R (x₀ + S q).
Vec3 moment_arm(const ReducedBody& body, int v) {
  return body.rotation * (body.archetype->surface.vertices[v] + modes_at(body, v) * body.q);
}

}  // namespace

Vec3 surface_point(const ReducedBody& body, int v) { return body.position + moment_arm(body, v); }

void surface_points(const ReducedBody& body, std::vector<Vec3>& points) {
  const Archetype& a = *body.archetype;
  const Mat3 R = body.rotation.toRotationMatrix();
  const VecX u = body.r > 0 ? VecX(a.surface_modes.leftCols(body.r) * body.q)
                            : VecX(VecX::Zero(3 * a.surface.vertices.size()));
  points.resize(a.surface.vertices.size());
  for (std::size_t v = 0; v < points.size(); ++v)
    points[v] = body.position + R * (a.surface.vertices[v] + u.segment<3>(3 * v));
}

MatX arm_jacobian(const ReducedBody& body, const ConfigurationTerms& terms, const Vec3& arm,
                  const MatX& phi) {
  const Mat3 arm_cross = skew(arm);
  MatX J(3, body.dofs());
  J.leftCols<3>().setIdentity();
  J.middleCols<3>(3) = -arm_cross;
  // B_i = R φ_i − (I⁻¹ D_i) × x
  J.rightCols(body.r) = body.rotation.toRotationMatrix() * phi + arm_cross * terms.spin_of_modes;
  return J;
}

MatX point_jacobian(const ReducedBody& body, const ConfigurationTerms& terms, int v) {
  return arm_jacobian(body, terms, moment_arm(body, v), modes_at(body, v));
}

Vec3 surface_velocity(const ReducedBody& body, const ConfigurationTerms& terms, int v) {
  return point_jacobian(body, terms, v) * generalised_velocity(body, terms);
}

}  // namespace archetide
