#pragma once

#include "runtime/solid/nodal_space.h"
#include "runtime/solid/reduced_body.h"

namespace archetide {

// What configuration_terms() reads of a body of nodes (S20): sums over its nodes in O(n). u: the
// displacement of the nodes, 3 n, m; Y = M y: their moments, 3 n, kg m; body frame.

Moments nodal_moments(const ReducedBody& body, const VecX& u);

/// sum Y_p x u_dot_p, u_dot as the mass has it (NodalSpace::of_mass).
Vec3 nodal_angular_momentum(const NodalSpace& nodes, const VecX& Y, const VecX& u_dot);

/// D = R [Y_p] node by node, of the same u_dot, 3 x 3 n.
MatX nodal_levers(const NodalSpace& nodes, const Mat3& R, const VecX& Y);

VecX nodal_fictitious_force(const ReducedBody& body, const Configuration& at,
                            const ConfigurationTerms& terms);

/// Torque of the fictitious forces about the centre of mass, N m; C_u = sum m y u_dot^T.
Vec3 fictitious_torque(const Vec3& w, const Mat3& Syy, const Mat3& C_u);

}  // namespace archetide
