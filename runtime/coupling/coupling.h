#pragma once

#include <map>
#include <memory>
#include <vector>

#include "common/files/state_file.h"
#include "common/mesh/tri_mesh.h"
#include "runtime/articulation/joint.h"
#include "runtime/articulation/skinning.h"
#include "runtime/contact/body_contacts.h"
#include "runtime/contact/wall_contact.h"
#include "runtime/coupling/coupled_solve.h"
#include "runtime/coupling/hydrostatic_stiffness.h"
#include "runtime/coupling/impulses.h"
#include "runtime/coupling/water_motion.h"
#include "runtime/cut_cells/voxel_faces.h"
#include "runtime/cut_cells/wall_faces.h"

namespace archetide {

enum class Geometry {
  kCutCell,
  kVoxel
};  // area fractions of the deformed surface, or the paper's voxel faces

struct CouplingOptions {
  Grid grid;
  bool has_water = false;
  Sides open_side{};
  Hydrostatics hydrostatics;
  Geometry geometry = Geometry::kCutCell;
  ModalOptions modal;
  CoupledSolveOptions solve;
  WallContactOptions walls;  // dt is set by each stage
};

/// One body entering a coupled solve of one stage.
struct StageBody {
  const ReducedBody* body = nullptr;
  Configuration at;               // where inertia and fictitious forces are read
  std::vector<Vec3> read_points;  // surface where its pressure is read; empty: as it stands
  bool near_wall = false;         // position stage: look for walls that the step would reach
  StageContacts held;             // velocity stage: points that contact has found
  VecX reaction = VecX();  // velocity stage: impulse of the joints in the position stage, 6 + r
  VecX drive = VecX();     // of actuators, loads and springs, 6 + r, N, N m; empty: none
  const ReducedBody* met = nullptr;  // the body where the water meets it; null: where it is
  bool returns_flux = false;         // velocity stage: to closed water [D87]
};

/// What the solve did to a body. P and L of the body change by delta_P and delta_L.
struct StageResult {
  FreeMotion motion;
  VecX y;                                               // 6 + r, velocity after the stage
  Vec3 delta_P = Vec3::Zero(), delta_L = Vec3::Zero();  // N s, N m s
  VecX water_impulse;                                   // 6 + r, of that what the water gave
  StageContacts contacts;                               // points that walls held, and their speeds
  VecX reaction;        // 6 + r, impulse of joints and contacts, N s; empty: found with y alone
  VecX joint_reaction;  // 6 + r, of that what joints gave; empty: no joints
};

/// "couple" of the method: geometry of this configuration (fractions, F, H) -> right-hand side ->
/// PCG on A = G^T w b^-1 G + F H^-1 F^T -> velocities of water and bodies. What a scene lacks is an
/// empty set.
class Coupling {
 public:
  /// `skins`: the water sees them instead of their members' own surfaces (cut cells only).
  Coupling(const CouplingOptions& options, const std::vector<TriMesh>& obstacles,
           std::vector<Joint> joints = {}, std::vector<SkinnedBodies> skins = {});

  /// The tank becomes higher or lower; update_geometry() or couple() must follow. Layers that stay
  /// keep what the next solve starts from.
  void set_tank(const Grid& grid, const Sides& open_side);

  /// Solves one stage. dt is the whole step; the stage's length is dt/2 for kPositionHalf. u: u*
  /// in, u out. `together`: contacts between bodies, walls included; null: each body alone at its
  /// walls. `narrow`: what narrow faces carry beside u. `held`: water in each cell, dx^3, for
  /// motion_before() and motion_after(). Joints hold in every stage.
  SolveReport couple(Stage stage, double dt, const FreeSurface& surface,
                     const std::vector<StageBody>& bodies, MacField& u,
                     std::vector<StageResult>& results, GroupContacts* together = nullptr,
                     const NarrowFlow& narrow = {}, const Array3<double>* held = nullptr);

  /// The next couple() is of the stage, bodies and water of the last one, but for the modes that are
  /// locked: geometry, pressure system and loads stay.
  void keep_loads() { known_ = Known::kLoads; }

  /// The next couple() of this stage starts from no pressure: the last one's is of no use.
  void forget_guess(Stage stage) { pressure_[stage == Stage::kVelocityFull].fill(0.0); }

  /// The velocities stage just solved ends a step that is taken: the water carried beside the bodies
  /// goes on from them. Without it the next couple() begins where the last one did.
  void accept_velocities();

  /// Fractions of this configuration; `couple` does it itself.
  void update_geometry(const std::vector<StageBody>& bodies);
  /// The same for the next couple(), which must be of the same bodies, ahead of it.
  void prepare_geometry(const std::vector<StageBody>& bodies);

  /// Of the last solve: faces whose velocity was solved for, open fractions of faces, solid
  /// fraction of cells.
  FaceField<unsigned char>& valid() { return valid_; }
  const FaceField<unsigned char>& valid() const { return valid_; }
  const FaceField<double>& open() const { return open_; }
  const SolidFractions& solids() const { return solids_; }
  const PressureSystem& system() const { return system_; }
  const std::vector<WallFace>& obstacle_walls() const { return obstacle_walls_; }
  const std::vector<NarrowFace>& narrow_faces() const { return solver_.narrow_faces(); }
  /// Of the last solve: faces where water of s of the opening moves at v, with a body or an
  /// obstacle (DualFace).
  struct SlipFace {
    int axis;
    std::size_t face;
    double s, v;  // open fraction, m/s
  };
  const std::vector<SlipFace>& slip_faces() const { return slip_faces_; }
  /// phi = dt p' / (rho dx) less its surface mean, of the last solve of a stage, m/s.
  const Array3<double>& last_pressure(Stage stage) const {
    return pressure_[stage == Stage::kVelocityFull];
  }
  /// Largest divergence that the last velocity stage, or a stage that failed, has left, 1/s.
  double last_divergence() const { return divergence_; }
  const Vec3i& last_divergent_cell() const { return divergent_cell_; }  // where it is
  /// Of the water, before and after the last velocity stage, by what cells hold (water_motion());
  /// what moves with bodies (DualFace) is part of it.
  const Motion& motion_before() const { return before_.held; }
  const Motion& motion_after() const { return after_.held; }
  /// Of the last velocity stage: impulses on water and bodies together from the walls and obstacles
  /// by p', and from gravity by the hydrostatic part of the pressure (on the surface and on the
  /// bodies), without the weight of the bodies.
  const Impulse& solid_impulse() const { return solid_impulse_; }
  const Impulse& hydrostatic_impulse() const { return hydrostatic_impulse_; }
  /// Of the last velocity stage: what the water is measured to have gained beyond what the pressure
  /// gave it. Cells at the surface hold another mass than the solve counts; and a cell's pressure
  /// turns the water about the cell's centre, but a body about the piece of its surface.
  const Impulse& unmatched_impulse() const { return unmatched_impulse_; }
  /// Wall seconds that contacts between bodies took in the last couple().
  double contact_seconds() const { return contact_seconds_; }
  std::size_t bytes() const;

  /// What the next solve starts from; the rest follows from update_geometry().
  void visit_state(StateArchive& a, const std::vector<ReducedBody>& bodies);

 private:
  bool wet() const { return options_.has_water && options_.grid.cells() > 0; }
  static double stage_seconds(Stage stage, double dt) {
    return stage == Stage::kPositionHalf ? 0.5 * dt : dt;
  }

  // Geometry (coupling_geometry.cpp).
  void forget_bodies();
  void open_box(const CellBox& box);
  void cut_bare_bodies();
  void cut_skins();

  // Loads on the bodies, 6 + r each (coupling_loads.cpp).
  struct Loads {
    std::vector<VecX> hydrostatic;  // N, N m
    std::vector<VecX> displaced;    // owed to displaced water (C22), N s, N m s; empty: none
    std::vector<HydrostaticStiffness> stiffness;  // of nonlinear bodies, else empty
  };
  Loads stage_loads(Stage stage, double dt, const FreeSurface& surface,
                    const std::vector<StageBody>& bodies);
  std::vector<VecX> hydrostatic_loads(const std::vector<StageBody>& bodies) const;
  std::vector<HydrostaticStiffness> load_stiffnesses(const std::vector<StageBody>& bodies) const;
  void remember_places();
  std::vector<VecX> displaced_pushes(const FreeSurface& surface, double dt) const;

  // The system, and the bodies in it (coupling.cpp).
  void meet_water(Stage stage, double dt, const FreeSurface& surface,
                  const std::vector<StageBody>& bodies);
  void assemble(const FreeSurface& surface);
  void refer_to_bodies();
  const InnerFlow& inner_flow_of(const Archetype& archetype);
  void move_freely(Stage stage, double dt, std::size_t b, const StageBody& in, const Loads& loads,
                   StageResult& out) const;
  MatX water_beside(std::size_t b, const MatX& H, CoupledBody& coupled);
  void add_carried_water(std::size_t b, const MatX& H, const MacField& u, CoupledBody& coupled);
  void add_water_of_nodes(std::size_t b, const MacField& u, NodalInverse& inverse,
                          CoupledBody& coupled);
  void start_nodes(std::size_t b, const GeneralisedMass& H, const MacField& u,
                   CoupledBody& coupled);
  void start_body(Stage stage, double dt, std::size_t b, const StageBody& in, const Loads& loads,
                  const MacField& u, CoupledBody& coupled, StageResult& out);
  static void add_first_impulses(const std::vector<StageBody>& bodies, const Loads& loads,
                                 std::vector<CoupledBody>& coupled,
                                 std::vector<StageResult>& results);
  std::vector<CoupledBody> start_bodies(Stage stage, double dt,
                                        const std::vector<StageBody>& bodies, const Loads& loads,
                                        const MacField& u, std::vector<StageResult>& results);
  void end_body(std::size_t b, const StageBody& in, const CoupledBody& coupled, StageResult& out);

  // Measures of the velocity stage (coupling_measures.cpp).
  WaterMotion carried_motion(std::size_t b, const VecX& y) const;
  template <class Velocity>
  WaterMotion whole_motion(const MacField& u, const Array3<double>* held, const Velocity& y) const;
  void measure_before(Stage stage, const MacField& u, const Array3<double>* held);
  void measure_after(Stage stage, double dt, const Loads& loads,
                     const std::vector<CoupledBody>& coupled, const MacField& u,
                     const Array3<double>* held);
  void measure_impulses(double dt, const std::vector<CoupledBody>& coupled,
                        const std::vector<VecX>& hydrostatic);
  void collect_slip(const std::vector<CoupledBody>& coupled);

  SolveReport solve(Stage stage, double dt, const std::vector<StageBody>& bodies,
                    GroupContacts* together, MacField& u, std::vector<CoupledBody>& coupled,
                    std::vector<StageResult>& results);
  std::vector<MatX> wet_inverses(Stage stage, double h, const std::vector<CoupledBody>& coupled,
                                 std::vector<VecX>& y) const;
  SolveReport solve_together(Stage stage, double dt, const std::vector<StageBody>& bodies,
                             GroupContacts& contacts, MacField& u,
                             std::vector<CoupledBody>& coupled, std::vector<StageResult>& results);
  void set_constraint_faces(const std::vector<CoupledBody>& coupled, MacField& u);

  CouplingOptions options_;
  std::vector<TriMesh> obstacle_surfaces_;
  std::vector<Joint> joints_;
  std::vector<SkinnedBodies> skins_;
  std::vector<std::vector<Vec3>> skin_points_;  // of each skin, m
  SolidFractions obstacles_, solids_;
  std::vector<WallFace> obstacle_walls_;
  FaceField<double> open_;
  std::vector<CellBox> cut_;      // where solids_ is not obstacles_
  std::vector<CellBox> changed_;  // where open_ changed since the last assembly
  FaceField<unsigned char> valid_;
  std::vector<BodySurface> surfaces_;
  // Points of each surface and skin where the water met them in the last position stage, m.
  std::vector<std::vector<Vec3>> half_way_, skins_half_way_;
  std::vector<BodyFlux> fluxes_;           // cut cells
  std::vector<DualFaces> obstacle_faces_;  // cut cells, of every obstacle
  std::vector<DualFaces> faces_;           // cut cells, of each body
  std::vector<char> skinned_;              // of each body: the water sees a skin in its place
  std::map<const Archetype*, InnerFlow> inner_flows_;
  std::vector<MatX> carried_;      // cut cells: water that moves with each body (reduced), kg
  std::vector<VoxelBody> voxels_;  // voxel
  enum class Known { kNothing, kGeometry, kLoads };
  Known known_ = Known::kNothing;  // of the next couple()
  Loads loads_;                    // of the last couple()
  std::vector<SlipFace> slip_faces_;
  PressureSystem system_;
  CoupledSolver solver_;
  Array3<double> pressure_[2];  // first guess of each stage
  // Of that water: reduced_velocity of its body at the end of the last step, and after the last
  // velocities stage.
  std::vector<VecX> carried_velocity_, solved_velocity_;
  double divergence_ = 0.0;
  Vec3i divergent_cell_ = Vec3i::Zero();
  WaterMotion before_, after_;
  Impulse solid_impulse_, hydrostatic_impulse_, unmatched_impulse_;
  double contact_seconds_ = 0.0;
};

}  // namespace archetide
