#include "runtime/contact/contact_impulses.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/nonnegative_least_squares.h"

namespace archetide {
namespace {

constexpr int kMaxTurns = 2000;
constexpr double kTurnTolerance = 1e-14;  // of the largest speed at the points

/// Velocities that unit impulses leave, H⁻¹ rowsᵀ, (6 + r) x rows.
MatX responses(const GeneralisedMass& H, const MatX& rows) {
  MatX X(H.size(), rows.rows());
  for (long k = 0; k < rows.rows(); ++k) X.col(k) = H.solve(rows.row(k).transpose());
  return X;
}

/// Largest eigenvalue of the 2 x 2 response in the tangent plane: the step that keeps sliding
/// friction opposite to the slip.
double tangent_compliance(const Eigen::Matrix2d& A) {
  return 0.5 * (A(0, 0) + A(1, 1) + std::hypot(A(0, 0) - A(1, 1), A(0, 1) + A(1, 0)));
}

Eigen::Vector2d cut_to_cone(const Eigen::Vector2d& impulse, double bound) {
  const double length = impulse.norm();
  return length <= bound ? impulse : Eigen::Vector2d(impulse * (bound / length));
}

/// The points' rows and the velocities that unit impulses along them leave.
struct Directions {
  const MatX& rows;  // k x (6 + r)
  MatX response;     // H⁻¹ rowsᵀ, (6 + r) x k
};

/// λ_n ← max(0, λ_n − (n·v − target) / A_nn). Returns the change of speed at the point.
double push(const Directions& n, long k, double target, double& impulse, VecX& y) {
  const double A_nn = n.rows.row(k).dot(n.response.col(k));
  const double next = std::max(0.0, impulse + (target - n.rows.row(k).dot(y)) / A_nn);
  const double change = next - impulse;
  y += change * n.response.col(k);
  impulse = next;
  return A_nn * std::abs(change);
}

/// λ_t ← λ_t − v_t / ρ, cut to |λ_t| ≤ bound. Returns the change of speed at the point.
double rub(const Directions& t, long k, double bound, Eigen::Ref<Eigen::Vector2d> impulse,
           VecX& y) {
  const auto T = t.rows.middleRows<2>(2 * k);
  const auto X = t.response.middleCols<2>(2 * k);
  const double rho = tangent_compliance(T * X);
  const Eigen::Vector2d next = cut_to_cone(impulse - T * y / rho, bound);
  const Eigen::Vector2d change = next - impulse;
  y += X * change;
  impulse = next;
  return rho * change.norm();
}

}  // namespace

ContactImpulses push_apart(const GeneralisedMass& H, const MatX& normals, const MatX& tangents,
                           const VecX& target, double friction, VecX& y) {
  const long m = normals.rows();
  ContactImpulses out{VecX::Zero(m), VecX::Zero(2 * m), 0};
  if (m == 0) return out;
  const double speed =
      std::max({(normals * y).cwiseAbs().maxCoeff(), (tangents * y).cwiseAbs().maxCoeff(),
                target.cwiseAbs().maxCoeff()});

  // without friction the problem is solved exactly
  const Directions n{normals, responses(H, normals)};
  out.normal = nonnegative_least_squares(normals * n.response, target - normals * y);
  y += n.response * out.normal;
  if (friction <= 0.0) return out;

  const Directions t{tangents, responses(H, tangents)};
  for (double change = INFINITY; change > kTurnTolerance * speed && out.iterations < kMaxTurns;
       ++out.iterations) {
    change = 0.0;
    for (long k = 0; k < m; ++k) {
      change = std::max(change, push(n, k, target[k], out.normal[k], y));
      change =
          std::max(change, rub(t, k, friction * out.normal[k], out.tangent.segment<2>(2 * k), y));
    }
  }
  return out;
}

VecX generalised_impulse(const MatX& normals, const MatX& tangents,
                         const ContactImpulses& impulses) {
  return normals.transpose() * impulses.normal + tangents.transpose() * impulses.tangent;
}

}  // namespace archetide
