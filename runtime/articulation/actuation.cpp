#include "runtime/articulation/actuation.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/check.h"
#include "runtime/solid/nodal_space.h"
#include "runtime/solid/rotation.h"

namespace archetide {
namespace {

Vec3 middle_of(const TriMesh& surface, const std::vector<int>& vertices) {
  Vec3 sum = Vec3::Zero();
  for (const int v : vertices) sum += surface.vertices[v];
  return sum / static_cast<double>(vertices.size());
}

Vec3 direction_at(const Archetype& a, int v, const Vec3& middle, const ActuationDirection& d) {
  using Kind = ActuationDirection::Kind;
  switch (d.kind) {
    case Kind::kNormal:
      return a.surface_normals[v];
    case Kind::kRadial:
      return (a.surface.vertices[v] - middle).stableNormalized();
    case Kind::kInward:
      return (middle - a.surface.vertices[v]).stableNormalized();
    case Kind::kVector:
      break;
  }
  return d.vector.stableNormalized();
}

// f <- f - J J^+ f with J the rigid motions of the points, 3 k x 6. Points on a line have five, one
// point three: the pseudo-inverse takes what there is.
void balance(const TriMesh& surface, const std::vector<int>& vertices, const Vec3& middle,
             std::vector<Vec3>& force) {
  constexpr double kRank = 1e-9;  // singular values below, relative to the largest, are round-off
  const auto k = static_cast<Eigen::Index>(vertices.size());
  double size = 0.0;
  for (const int v : vertices) size = std::max(size, (surface.vertices[v] - middle).norm());
  if (size == 0.0) size = 1.0;
  MatX J(3 * k, 6);
  VecX f(3 * k);
  for (Eigen::Index p = 0; p < k; ++p) {
    const Vec3 x = (surface.vertices[vertices[p]] - middle) / size;
    J.block<3, 3>(3 * p, 0) = Mat3::Identity();
    J.block<3, 3>(3 * p, 3) = -skew(x);
    f.segment<3>(3 * p) = force[p];
  }
  Eigen::JacobiSVD<MatX> svd(J, Eigen::ComputeThinU);
  svd.setThreshold(kRank);
  const MatX rigid = svd.matrixU().leftCols(svd.rank());
  for (int pass = 0; pass < 2; ++pass) f -= rigid * (rigid.transpose() * f);
  for (Eigen::Index p = 0; p < k; ++p) force[p] = f.segment<3>(3 * p);
}

double norm_of(const std::vector<Vec3>& force) {
  double sum = 0.0;
  for (const Vec3& f : force) sum += f.squaredNorm();
  return std::sqrt(sum);
}

// What the force on a vertex does to the modes, and what their motion does to its torque.
void add_to_modes(const Archetype& a, int vertex, const Vec3& force, ActuationPattern& out) {
  const auto phi = a.surface_modes.middleRows<3>(3 * vertex);
  out.modal += phi.transpose() * force;
  out.torque_of_modes -= skew(force) * phi;
}

// The same where the nodes move for themselves.
void add_to_nodes(const NodalSpace& nodes, int vertex, const Vec3& force, ActuationPattern& out) {
  const int dof = nodes.first_dof(vertex);
  out.modal.segment<3>(dof) += force;
  out.torque_of_modes.middleCols<3>(dof) -= skew(force);
}

}  // namespace

ActuationPattern actuation_pattern(const Archetype& a, const std::vector<int>& vertices,
                                   const ActuationDirection& direction, bool balanced,
                                   const NodalSpace* nodes) {
  ARCHETIDE_CHECK(!vertices.empty());
  ActuationPattern out;
  out.vertices = vertices;
  const Vec3 middle = middle_of(a.surface, vertices);
  for (const int v : vertices)
    out.force.push_back(direction_at(a, v, middle, direction) /
                        static_cast<double>(vertices.size()));
  if (balanced) {
    const double before = norm_of(out.force);
    balance(a.surface, vertices, middle, out.force);
    out.kept = before > 0.0 ? norm_of(out.force) / before : 0.0;
  }
  const int r = nodes ? nodes->size() : a.r();
  out.modal = VecX::Zero(r);
  out.torque_of_modes = MatX::Zero(3, r);
  for (std::size_t p = 0; p < vertices.size(); ++p) {
    if (nodes)
      add_to_nodes(*nodes, vertices[p], out.force[p], out);
    else
      add_to_modes(a, vertices[p], out.force[p], out);
    if (!balanced) out.torque += a.surface.vertices[vertices[p]].cross(out.force[p]);
  }
  return out;
}

double Actuator::force_at(double t) const {
  if (t < start || t > end) return 0.0;
  return amplitude * std::sin(2.0 * std::numbers::pi * (t - start) / period + phase);
}

// Eq. S8.
VecX modal_force(const Actuator& actuator, double t, const ReducedBody& body,
                 const Configuration& at, const ConfigurationTerms& terms) {
  const ActuationPattern& p = *actuator.pattern;
  // Σ y × f of the deformed shape y = x + S q, turned to the world
  const Vec3 torque = at.rotation * Vec3(p.torque + p.torque_of_modes.leftCols(body.r) * at.q);
  // Bᵀ f = Σ φ_i·f − (I⁻¹ D_i)·Σ y × f
  return actuator.force_at(t) * (p.modal.head(body.r) - terms.spin_of_modes.transpose() * torque);
}

std::vector<VecX> modal_forces(const std::vector<Actuator>& actuators, double t,
                               const std::vector<ReducedBody>& bodies,
                               const std::vector<Configuration>& at, ModalMass mass) {
  std::vector<VecX> force(bodies.size());
  for (const Actuator& actuator : actuators) {
    const auto b = static_cast<std::size_t>(actuator.body);
    if (b >= bodies.size()) continue;  // has not appeared yet
    const ConfigurationTerms terms = configuration_terms(bodies[b], at[b], mass);
    const VecX f = modal_force(actuator, t, bodies[b], at[b], terms);
    force[b] = force[b].size() > 0 ? VecX(force[b] + f) : f;
  }
  return force;
}

}  // namespace archetide
