#pragma once

#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Cholesky>

#include "common/archetype/archetype.h"
#include "runtime/solid/contact_material.h"
#include "runtime/solid/prescribed_motion.h"
#include "runtime/solid/shape_correction.h"

namespace archetide {

class NodalMass;
class NodalSpace;
struct NodalStiffness;

/// How the modes are advanced: the trapezoidal rule (default) [D32] or backward Euler (Eq. 31).
enum class ModalStep { kTrapezoid, kBackwardEuler };
/// M_q = B^T M B at the current q (default) [D2], or the paper's constant M_r.
enum class ModalMass { kExact, kPaper };
struct ModalOptions {
  ModalStep step = ModalStep::kTrapezoid;
  ModalMass mass = ModalMass::kExact;
};

/// One instance of an archetype: pose, momenta, modal state [SLYF15]. r = 0 is a rigid body through
/// the same code, and so is a body of nodes: every degree of freedom of its tets is a mode, S = 1
/// (S20). World frame unless the name ends in _body.
struct ReducedBody {
  std::shared_ptr<const Archetype> archetype;
  double mass_scale = 1.0;  // density / archetype density; scales every mass, leaves K alone
  int r = 0;                // modes in use, at most archetype->r()

  Vec3 position = Vec3::Zero();      // centre of mass t, m
  Quat rotation = Quat::Identity();  // R, rest frame to world
  Vec3 P = Vec3::Zero();             // linear momentum, kg m/s
  Vec3 L = Vec3::Zero();             // angular momentum about the centre of mass, kg m^2/s
  VecX q;                            // r, modal displacement, 1 (S has unit m)
  VecX q_dot;                        // r, 1/s
  VecX last_way;  // 6 + r, y of the last step's way, v^{n-1/2}; empty: no step with two solves yet
  // Of a nonlinear body, r: modal force that water, contacts and joints gave it in the position stage
  // of the last step, N m; empty as last_way.
  VecX last_push;

  std::shared_ptr<const NodalSpace> nodes = nullptr;  // S = 1, r = 3 n; null: stored modes
  // Of its archetype, the surface that water and contacts meet; null: the body's own.
  const SurfaceRung* rung = nullptr;
  std::optional<ContactMaterial> contact = std::nullopt;  // absent: that of the scene
  // It goes as it is told, whatever pushes it: a rigid body that answers nothing (S8e), whose P and L
  // only say how fast it is; null: by its momenta.
  std::shared_ptr<const PrescribedMotion> prescribed = nullptr;
  KeptShapes kept_shapes = {};

  int dofs() const { return 6 + r; }
  /// Deforms by the archetype's elastic energy: not a rigid one.
  bool is_nonlinear() const { return r > 0 && archetype->nonlinear(); }
};

/// The body at rest with every node of its tets free; its archetype must keep their matrices.
/// `nodes`: of the archetype, shared by its instances.
void free_nodes(std::shared_ptr<const NodalSpace> nodes, ReducedBody& body);

/// A place to evaluate configuration-dependent quantities at.
struct Configuration {
  Quat rotation = Quat::Identity();
  VecX q;      // r
  VecX q_dot;  // r
  Vec3 delta_L =
      Vec3::Zero();      // angular momentum there minus body.L (the midpoint's gain), kg m^2/s
  MatX locked = MatX();  // r x k, directions n in which the modes are held, n . q_dot = 0; or empty
  // Of an impact that lasts no time, s: modes meet the mass of a step of this length, so that what is
  // stiff for it does not ring, and no force acts. 0: none.
  double impact_step = 0.0;
  // Of a nonlinear body: the rates, r, that the elastic force is linear about (docs/method.md, S13a,
  // S14), or empty: in the position stage those that last_push would give, in the velocities stage
  // q_dot.
  VecX linear_about = VecX();

  const VecX& rates_of_force() const { return linear_about.size() > 0 ? linear_about : q_dot; }
};

/// Mass of one instance, kg.
inline double body_mass(const ReducedBody& body) {
  return body.mass_scale * body.archetype->integrals.mass;
}

/// What tables, and the water that a body carries, see of its velocity y (6 + r): y itself; of a
/// body of nodes (v, w, rates of the archetype's stored modes), NodalSpace::reduced_velocity. And the
/// transpose, for generalised forces.
int reduced_dofs(const ReducedBody& body);
VecX reduced_velocity(const ReducedBody& body, const VecX& y);
VecX from_reduced_force(const ReducedBody& body, const VecX& f);
/// q; of a body of nodes the amplitudes of the stored modes.
VecX reduced_amplitudes(const ReducedBody& body);

/// Where the body is now.
Configuration current_configuration(const ReducedBody& body);

/// Second moments of the deformed shape y = x + S q in the body frame, O(r^2); mass_scale included.
struct Moments {
  Mat3 Syy;             // sum m y y^T, kg m^2
  std::vector<Mat3> C;  // r: sum m y phi_i^T, kg m; a body of nodes has ..
  VecX nodal = VecX();  // .. M y instead, 3 n, kg m
};
Moments deformed_moments(const ReducedBody& body, const VecX& q);

/// Angular momentum of the modes about the centre of mass in the body frame, sum m y x (S q_dot),
/// kg m^2/s, at the shape of `moments`.
Vec3 angular_momentum_of_modes(const ReducedBody& body, const Moments& moments, const VecX& q_dot);

/// Everything of one configuration that follows from the archetype's integrals, O(r^2).
struct ConfigurationTerms {
  Moments moments;    // body frame
  double mass = 0.0;  // kg
  Mat3 inertia;       // I(q), world, about the centre of mass, kg m^2
  Mat3 inertia_inverse;
  MatX D;              // 3 x r, world: angular momentum of the modes, L_modes = D q_dot
  MatX spin_of_modes;  // 3 x r: I^-1 D, the spin filtered out of each mode: B_i = R phi_i - (I^-1
                       // D_i) x r
  MatX M_q;            // r x r: M_r - D^T I^-1 D (kExact) or M_r (kPaper), kg; empty with nodes
  ShapeCorrection shape;
  bool exact_mass = true;  // kExact
};
ConfigurationTerms configuration_terms(const ReducedBody& body, const Configuration& c,
                                       ModalMass mass);

/// M_q q_dot, r, kg/s.
VecX modal_momentum(const ReducedBody& body, const ConfigurationTerms& terms, const VecX& q_dot);

/// dV/dq, r, N m: K_r q of linear bodies.
VecX elastic_force(const ReducedBody& body, const VecX& q);

/// H = diag(m 1, I, Mhat): the generalised mass that the coupled solve sees. The generalised
/// velocity is y = (v, w, q_dot) with v = P/m and w = I^-1 L (the spin that carries all of L), 6 +
/// r entries; a particle at moment arm x moves with v + w x x + B q_dot. M_hat (Eq. 31) is
///   M_q + dt/2 C + dt^2/4 K  (trapezoid, both stages),
///   M_q + h C + h^2 K        (backward Euler; h is dt/2 in the position stage, else dt).
/// Of a body that goes as it is told H^-1 = 0 (S8e).
struct GeneralisedMass {
  double mass = 0.0;
  bool answers = true;  // false: H^-1 = 0
  Mat3 inertia, inertia_inverse;
  MatX M_hat;                              // r x r; a body of nodes has ..
  Eigen::LDLT<MatX> M_hat_factor{MatX()};  // begins defined: it is copied without modes, too
  std::shared_ptr<const NodalMass> nodal = nullptr;  // .. this instead

  int size() const;
  VecX modal_product(const VecX& q_dot) const;  // Mhat q_dot, r
  VecX modal_solve(const VecX& f) const;        // Mhat^-1 f, r
  VecX apply(const VecX& y) const;              // H y, generalised momentum
  VecX solve(const VecX& f) const;              // H^-1 f
  MatX dense() const;                           // H; only with modes
  MatX inverse() const;                         // H^-1; only with modes
};

/// y of the body's present momenta, (P/m, I^-1 L, q_dot), 6 + r.
VecX generalised_velocity(const ReducedBody& body, const ConfigurationTerms& terms);

/// Which of the two solves of Section 6 a step belongs to: the first advances velocities by dt/2
/// only to obtain the velocity that moves the positions, the second advances velocities by dt.
enum class Stage { kPositionHalf, kVelocityFull };

/// H of a stage; dt = 0 gives the mass that an instantaneous impulse meets, M_hat = M_q.
GeneralisedMass generalised_mass(const ReducedBody& body, const ConfigurationTerms& terms,
                                 double dt, Stage stage, ModalStep step);

/// How a load on a body follows its shape, -d f / dq, N m per unit q: r x r, or of a body of nodes.
struct LoadStiffness {
  LoadStiffness() = default;
  LoadStiffness(MatX of_modes) : modes(std::move(of_modes)) {}  // NOLINT: a matrix is one
  MatX modes{};
  std::shared_ptr<const NodalStiffness> nodes = nullptr;
  bool empty() const { return modes.size() == 0 && !nodes; }
  VecX operator*(const VecX& q) const;
};

/// Uncoupled motion of a body over one stage: y* after explicit forces, and the mass that further
/// impulses meet: y = y* + H^-1 f.
struct FreeMotion {
  ConfigurationTerms terms;
  GeneralisedMass H;
  VecX y_star;  // 6 + r
  // Of a nonlinear body: as free_motion got it; and what the elastic force of the position stage is
  // linear about, r (docs/method.md, S13a).
  LoadStiffness load_stiffness{};
  VecX linear_about{};
  MatX slope{};  // r x r, kg; a body of nodes has it in its mass

  bool is_nonlinear() const { return slope.size() > 0 || (H.nodal && slope_of_nodes()); }
  /// S q_dot, with S how the impulse of the elastic force in half a step changes with the rates, r, kg
  /// per s (S13a, S14).
  VecX slope_product(const VecX& q_dot) const;

 private:
  bool slope_of_nodes() const;
};

/// `at` is the configuration where inertia, filter and fictitious forces are evaluated: x^n for the
/// first stage, the midpoint (half-step rotation, (q^n + q^{n+1})/2, half-step q_dot; what
/// advance_pose returns) for the second, which makes the whole second order. The elastic force
/// starts from q^n = 2 at.q - body.q, right for both stages, whether the pose has advanced or not.
/// Modes that are held (at.locked) meet a mass that is large enough to keep them. In an impact
/// (at.impact_step) y* is the velocity that the body has.
/// `force` (6 + r): generalised force (sum f, sum r x f, B^T f) in N, N m, held constant over the
/// stage. dt is the length of the whole step, s. `load_stiffness`: of a nonlinear body, r x r,
/// symmetric, N m per unit q, -d force / dq of the modal force, which then is that of the middle of
/// the step (S14a); empty: 0.
FreeMotion free_motion(const ReducedBody& body, const Configuration& at, const VecX& force,
                       double dt, Stage stage, const ModalOptions& options,
                       const LoadStiffness& load_stiffness = {});

/// Fictitious force on the modes, r: B^T( -m (w x (w x y) + 2 w x S q_dot) ) with w the frame's
/// spin I^-1 (L - D q_dot) (Eqs. 5 and 7; docs/method.md, S6). B removes the Euler term exactly.
VecX fictitious_force(const ReducedBody& body, const Configuration& at,
                      const ConfigurationTerms& terms);

/// Spin of the rigid frame, w = I^-1 (L - D q_dot), rad/s.
Vec3 frame_spin(const ConfigurationTerms& terms, const Vec3& L, const VecX& q_dot);

/// Moves the pose with y of the position stage: t += dt v, R <- exp(dt w_frame) R with w_frame = w
/// - I^-1 D q_dot evaluated at the midpoint (fixed point iteration on the half-step rotation), q +=
/// dt q_dot. Returns the midpoint configuration for the velocity stage.
Configuration advance_pose(ReducedBody& body, const FreeMotion& stage, const VecX& y, double dt);
/// Modal coordinates at the end of a step by the trapezoid, q^{n+1} = q^n + dt/2 (q_dot^n +
/// q_dot^{n+1}), once q_dot^{n+1} (r) is known; body.q is still what advance_pose made of it and
/// body.q_dot that of n. `middle`: what advance_pose returned. docs/method.md, S15.
VecX corrected_modes(const ReducedBody& body, const Configuration& middle, const VecX& q_dot,
                     double dt);

/// P = m v and L = I w, m/s and rad/s, at the body's pose; modes stay as they are.
void set_velocity(const Vec3& v, const Vec3& w, ReducedBody& body);
/// Takes y of the velocity stage into P, L, q_dot. P and L change by exactly dt force + impulse,
/// not through H; of a body that goes as it is told they become those of its velocity.
void accept_velocity(ReducedBody& body, const VecX& y, const Vec3& delta_P, const Vec3& delta_L);

/// The modal part of a stage of a nonlinear body (docs/method.md, S13 and S14), in which the mean
/// elastic force F(v) = int_0^1 f(q_n + s dt v) ds of the way takes the place of K (q_n + dt/2 v).
/// Position stage: v = q_dot by Newton's method with line search from the free motion alone.
/// Velocity stage: linear about v = at.rates_of_force(). In both, impulses then meet M_hat = M_q + dt/2 C +
/// dt^2/2 dF/dq + dt^2/4 K_h. `load`: g + f, r, N m per unit q; `load_stiffness`: K_h, how f falls as
/// q goes on from where it is read (S14a), or empty; `terms`: M_q as the stage has it.
struct ModalMotion {
  VecX q_dot;                              // r, 1/s
  MatX M_hat;                              // r x r, kg, positive definite; a body of nodes has ..
  Eigen::LDLT<MatX> M_hat_factor{MatX()};  // begins defined: it is copied without modes, too
  MatX slope;  // of that what the elastic force gives, FreeMotion::slope
  std::shared_ptr<const NodalMass> nodal = nullptr;  // .. this instead

  VecX solve(const VecX& f) const;          // M_hat^-1 f
  VecX slope_product(const VecX& v) const;  // what the elastic force gives of M_hat v
};
/// `guess`: what a like load and M_q have given, or empty. Its M_hat is the last that Newton's
/// method needed; linearise() makes that of the answer.
ModalMotion nonlinear_half_step(const ReducedBody& body, const ConfigurationTerms& terms,
                                const VecX& load, double dt,
                                const LoadStiffness& load_stiffness = {}, ModalMotion guess = {});
void linearise(const ReducedBody& body, const ConfigurationTerms& terms, double dt,
               const LoadStiffness& load_stiffness, ModalMotion& motion);
/// The same stage with the elastic force linear about the rates `about` (r), as an earlier solve has
/// found them (S13a).
ModalMotion nonlinear_half_step_about(const ReducedBody& body, const VecX& about,
                                      const ConfigurationTerms& terms, const VecX& load, double dt,
                                      const LoadStiffness& load_stiffness);
ModalMotion nonlinear_full_step(const ReducedBody& body, const Configuration& at,
                                const ConfigurationTerms& terms, const VecX& load, double dt,
                                const LoadStiffness& load_stiffness = {});
/// dt/2 C + dt^2/4 K(q) + M_q: the mass that impulses meet where a nonlinear body stands now; M_q
/// where dt = 0. Without the negative part of K, so that impulses that take energy in this mass take
/// it in M_q as well [D70]. With modes only: a body of nodes has its K at rest there.
MatX nonlinear_modal_mass(const ReducedBody& body, const MatX& M_q, double dt);

/// Kinetic energy of particles at y (6 + r) in the configuration of `terms`, J.
double kinetic_energy(const ReducedBody& body, const ConfigurationTerms& terms, const VecX& y);
/// The same of what the body has (all modes exact, whatever `ModalMass`), and elastic energy, J.
double kinetic_energy(const ReducedBody& body);
double elastic_energy(const ReducedBody& body);
double elastic_energy(const ReducedBody& body, const VecX& q);  // of another shape

/// Places of material points: origin + R (s (x + S q) + d), world, m, of the rest places x (n) with
/// the modes S (3 n x at least r, row 3 k + axis).
void deformed_places(const ReducedBody& body, const std::vector<Vec3>& rest, const MatX& modes,
                     const Vec3& origin, std::vector<Vec3>& places);
/// Moment arm R (s (x + phi q) + d) of one such point, world, m.
Vec3 deformed_arm(const ReducedBody& body, const Vec3& rest, const MatX& phi);

/// The modes at surface vertex v, body frame, 3 x r.
MatX modes_at_vertex(const ReducedBody& body, int v);
/// S q of the vertices of the surface, 3 ns, body frame, m (or of q_dot, m/s).
VecX surface_displacements(const ReducedBody& body, const VecX& q);
/// deformed_places of the vertices of the surface.
void surface_places(const ReducedBody& body, const Vec3& origin, std::vector<Vec3>& places);

/// World position / velocity of surface vertex v, and all of them at once.
Vec3 surface_point(const ReducedBody& body, int v);
void surface_points(const ReducedBody& body, std::vector<Vec3>& points);

/// The surface that the water meets: its triangles, the modes of its vertices (bodies of modes),
/// and where they are, world, m.
const std::vector<Vec3i>& wet_triangles(const ReducedBody& body);
const MatX& wet_modes(const ReducedBody& body);
void wet_points(const ReducedBody& body, std::vector<Vec3>& points);
Vec3 surface_velocity(const ReducedBody& body, const ConfigurationTerms& terms, int v);
/// 3 x (6+r): velocity per unit y of the point at moment arm x that carries the modes phi (3 x r,
/// body frame): [1, -[x]x, B] with B_i = R (s phi_i + shift_rate_i) + slope_i x - (I^-1 D_i) x x
/// (ShapeCorrection).
MatX arm_jacobian(const ReducedBody& body, const ConfigurationTerms& terms, const Vec3& arm,
                  const MatX& phi);
/// The same of surface vertex v.
MatX point_jacobian(const ReducedBody& body, const ConfigurationTerms& terms, int v);

/// Bytes that one instance owns (not the shared archetype).
std::size_t instance_bytes(const ReducedBody& body);

}  // namespace archetide
