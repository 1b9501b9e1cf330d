#pragma once

#include <optional>
#include <vector>

#include "runtime/contact/contact_rows.h"
#include "runtime/contact/contact_search.h"
#include "runtime/solid/constrained_inverse.h"

namespace archetide {

/// A body as contact impulses see it.
struct ContactBody {
  const ReducedBody* body = nullptr;
  const ContactShape* shape = nullptr;
  const ConfigurationTerms* terms = nullptr;  // at the configuration of the contacts
  const GeneralisedMass* H = nullptr;
  const MatX* inverse_mass = nullptr;  // with water carried along; null: H alone
  /// Of a body of nodes, with the rows of all contacts (add_rows) and their answers: its velocity y
  /// in all of what follows, and its inverse mass, are those of these rows, z = J y.
  NodalRows* nodes = nullptr;
};

/// Adds the points of contacts 0, 1, ... to the rows of the bodies of nodes.
void add_rows(const std::vector<BodyContact>& contacts, const std::vector<ContactBody>& bodies);
/// The same of contact k, a surface vertex of body a at a wall.
void add_rows(int k, int a, const ContactPoint& point, const std::vector<ContactBody>& bodies);

/// Relative velocity and unit impulses of one contact and what they do: frame (normal, two
/// tangents).
struct ContactRows {
  int a = -1, b = -1;  // b < 0: does not move
  // Three rows, each in one piece; three columns likewise.
  using Rows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3>;
  Eigen::Matrix<double, 3, 3> frame;  // rows n, t1, t2, world
  Rows J_a, J_b;                      // 3 x (6 + r), or K: relative velocity v_a - v_b per unit y
  int unit_a = -1, unit_b = -1;       // J of a body of nodes: the unit rows from here on
  Columns W_a, W_b;                   // (6 + r) x 3: H^-1 J^T
  Mat3 D;                             // J H^-1 J^T, 1/kg
  double rho = 0.0;                   // largest eigenvalue of its tangential part, 1/kg
  std::optional<double> friction;     // absent: that of ContactSolveOptions
};

struct ContactSolveOptions {
  double friction = 0.0;
  int max_sweeps = 1000;
  long max_updates = 200'000;  // contacts times sweeps: a large pile settles over several steps
  double tolerance = 1e-9;  // change of speed in a sweep, of the largest speed at the contacts ...
  double still = 0.0;       // ... or this, m/s
};

struct ContactSolveReport {
  int sweeps = 0;
  double change = 0.0;  // of speed in the last sweep, m/s
};

/// Contacts of many bodies: impulses that only push, at most friction times that along the
/// tangents, equal and opposite at one common point. Block Gauss-Seidel [Jea99] on generalised
/// velocities: O(r) a contact and sweep.
class ContactSystem {
 public:
  ContactSystem(const std::vector<BodyContact>& contacts, const std::vector<ContactBody>& bodies);
  /// `tied`: joints that the impulses meet as well (they must outlive the system); null: none.
  void tie(const ConstrainedInverse* tied) { tied_ = tied; }
  /// A surface vertex of body a at a wall, with this coefficient of friction.
  void add(int a, const ContactPoint& point, double friction,
           const std::vector<ContactBody>& bodies);

  std::size_t size() const { return rows_.size(); }
  const std::vector<ContactRows>& rows() const { return rows_; }

  /// Relative velocity of contact k in its frame, m/s.
  Vec3 velocity(std::size_t k, const std::vector<VecX>& y) const;
  /// y += H^-1 J^T impulse.
  void apply(std::size_t k, const Vec3& impulse, std::vector<VecX>& y) const;

  /// J^T impulse of contact k on its bodies.
  void add_impulse(std::size_t k, const Vec3& impulse, std::vector<VecX>& f) const;

  /// Impulses lambda (frame, N s; in: the first guess, not yet in y) so that every contact
  /// separates at least at its target (m/s); y takes them. `only`: these contacts, in this order.
  ContactSolveReport solve(const VecX& target, const ContactSolveOptions& options,
                           std::vector<Vec3>& lambda, std::vector<VecX>& y) const;
  ContactSolveReport solve(const VecX& target, const ContactSolveOptions& options,
                           const std::vector<std::size_t>& only, std::vector<Vec3>& lambda,
                           std::vector<VecX>& y) const;

  /// Adds the change of linear and angular momentum of every body, N s and N m s.
  void add_momenta(const std::vector<Vec3>& lambda, const std::vector<BodyContact>& contacts,
                   const std::vector<ContactBody>& bodies, std::vector<Vec3>& delta_P,
                   std::vector<Vec3>& delta_L) const;

 private:
  double sweep_contact(std::size_t k, double target, double friction, Vec3& lambda,
                       std::vector<VecX>& y) const;
  std::vector<ContactRows> rows_;
  const ConstrainedInverse* tied_ = nullptr;
};

}  // namespace archetide
