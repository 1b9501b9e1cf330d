#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/base/input_error.h"
#include "common/base/types.h"
#include "runtime/gauge.h"
#include "runtime/simulation.h"

namespace archetide {

struct BoxSpec {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // corners, m
};
struct SphereSpec {
  Vec3 centre = Vec3::Zero();  // m
  double radius = 0.0;         // m
};

/// One [[markers]]: points in the water of a box or a ball.
struct MarkersSpec {
  SourceLocation where;
  int count = 0;
  std::optional<BoxSpec> box;
  std::optional<SphereSpec> ball;  // if not a box
  unsigned seed = 1;
};

/// A box or a ball of water; absent velocity (m/s): that of all water.
struct WaterBox : BoxSpec {
  std::optional<Vec3> velocity = {};
};
struct WaterBall : SphereSpec {
  std::optional<Vec3> velocity = {};
};

/// Where the water is at the start: the union of everything given.
struct WaterSpec {
  bool full = true;             // no [fluid] water: the whole tank
  std::optional<double> level;  // height above the floor of the tank, m
  std::vector<WaterBox> boxes;
  std::vector<WaterBall> spheres;
  std::string mesh;  // path of a closed surface, or ""
};

struct FluidSpec {
  SourceLocation where;
  Vec3i cells = Vec3i::Zero();
  double cell = 0.0;           // m
  Vec3 origin = Vec3::Zero();  // low corner of the tank, m
  double density = 1000.0;     // kg/m^3
  WaterSpec water;
  Vec3 velocity = Vec3::Zero();  // of the water at the start, m/s
  Sides open{};                  // order of enum Side
  Damping damping;
  int particles_per_cell = 0;  // 0: plain level set
  bool spray = false;

  Vec3 high() const { return origin + cell * cells.cast<double>(); }
};

/// What a body or an obstacle has instead of the scene's [contact].
struct ContactSpec {
  std::optional<double> restitution, friction;
};

/// One [[body]], or what all instances of a [[scatter]] share.
struct BodySpec {
  SourceLocation where;                  // of the archetype key
  std::string name;                      // "" = the archetype's name
  std::string archetype;                 // name or path ending in .h5
  Vec3 position = Vec3::Zero();          // of the centre of mass, m
  Quat rotation = Quat::Identity();      // rest frame to world
  Vec3 velocity = Vec3::Zero();          // of the centre of mass, m/s
  Vec3 angular_velocity = Vec3::Zero();  // world frame, rad/s
  std::optional<double> density;         // kg/m^3; absent: the archetype's
  std::optional<int> modes;              // absent: all that are stored
  bool every_motion = false;             // modes = "full": they must span every motion of the tets
  bool every_node = false;               // deformable = "full": a body of nodes
  ContactSpec contact;
  SourceLocation modes_where, deformable_where;
};

struct ScatterSpec {
  std::vector<BodySpec> kinds;  // one or more, of its instances in turn: they differ in archetype
  bool mixed = false;           // given as `archetypes`
  int count = 0;
  BoxSpec box;       // of the centres of mass
  std::string mesh;  // closed surface that they keep inside of, or "": none
  bool random_rotation = true;
  unsigned seed = 1;
  double gap = 0.0;  // between bounding spheres, m
  int waves = 1;
  double wave_interval = 0.0;  // s
  SourceLocation waves_where;
};

struct StaticSpec {
  SourceLocation where;
  std::string mesh;  // path
  double scale = 1.0;
  Vec3 position = Vec3::Zero();  // of the mesh's origin, m
  Quat rotation = Quat::Identity();
  ContactSpec contact;
  MotionPath motion;       // no keys: it stays, or ..
  std::string motion_csv;  // .. a table tells them, path
  SourceLocation motion_where;
  bool moves() const { return !motion.keys.empty() || !motion_csv.empty(); }
};

/// One [[wavemaker]]: a block that goes to and fro at a side of the tank.
struct WavemakerSpec {
  SourceLocation where;
  int side = kXMin;                      // kXMin to kYMax
  bool flap = false;                     // hinged at the floor; else a piston
  std::optional<double> height, stroke;  // one of them: of the waves, of the front at the level, m
  double period = 1.0;                   // s
  std::optional<double> ramp, front;     // s; m from the side, at rest
};

/// One [[joint]], or the clamp of a body; its points are the union of what is given.
struct JointSpec {
  SourceLocation where;
  std::string name;          // "[[joint]] 2"
  int a = -1, b = -1;        // index of a [[body]]; b = -1: the world
  std::vector<Vec3> points;  // rest frame of a, m
  std::string frame;         // joint frame of a's archetype, or ""
  int frame_points = 1;      // 1: ball, 2: hinge, 3: weld
  std::string point_set;     // of a's archetype, or ""
  SourceLocation frame_where, point_set_where;
};

/// One [[force]].
struct ForceSpec {
  SourceLocation body_where, points_where, direction_where;
  std::string body;    // name of the bodies that it drives
  std::string points;  // point set of their archetypes
  ActuationDirection direction;
  double amplitude = 0.0;      // N
  double period = 1.0;         // s
  double phase = 0.0;          // rad
  bool random_phases = false;  // one for each body
  unsigned seed = 1;
  bool balanced = true;       // at the points; else by the whole body
  double start = 0.0;         // s
  std::optional<double> end;  // s
};

/// One [[spring]]: between points of two bodies, or of a body and the world.
struct SpringSpec {
  SourceLocation where;
  int a = -1, b = -1;            // index of a [[body]]; b = -1: the world
  std::vector<Vec3> points;      // rest frames of a and b, or place in the world, m
  double stiffness = 0.0;        // N/m
  double damping = 0.0;          // N s/m
  std::optional<double> length;  // m; absent: as the bodies begin
  bool slack = false;            // a rope
};

/// One [[external]]: a force and a torque on bodies, constant or from a table.
struct ExternalSpec {
  SourceLocation body_where, csv_where;
  std::string body;            // name of the bodies that it acts on
  Vec3 force = Vec3::Zero();   // world frame, N
  Vec3 torque = Vec3::Zero();  // about the centre of mass, world frame, N m
  std::string csv;             // path; empty: constant
  double start = 0.0;          // s
  std::optional<double> end;   // s
};

/// One [[skin]]: bodies that the water and the camera see as one surface.
struct SkinSpec {
  SourceLocation where, bodies_where;
  std::string archetype;           // of the skin
  std::vector<int> bodies;         // index of a body, in the order of the skin's parts
  std::vector<std::string> parts;  // their archetypes, where the skin places them; else empty
  Vec3 position = Vec3::Zero();    // of the mesh's origin, m
  Quat rotation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();          // of the mesh's origin, m/s
  Vec3 angular_velocity = Vec3::Zero();  // world frame, rad/s
};

/// What one body must show; means are over the last `window` of the run.
struct BodyExpectation {
  SourceLocation where;
  int body = 0;  // index, [[body]] first, then the scattered ones
  double window = 1.0 / 3.0;
  std::optional<double> z_min, z_max;          // mean height of the centre of mass, m
  std::optional<double> speed_min, speed_max;  // mean speed of the centre of mass, m/s
  // Closed forms that `bench` measures errors from; `run` judges them when there is a margin.
  std::optional<double> z, draft;  // mean height of the centre of mass; level - lowest point, m
  std::optional<double> margin;    // of both, m
};

struct ExpectSpec {
  std::optional<double> volume_drift;                      // largest |V / V0 - 1|
  std::optional<int> iterations;                           // most iterations of one solve
  std::optional<double> deformation_min, deformation_max;  // largest deformation reached, 1
  std::vector<BodyExpectation> bodies;
};

/// What a run must not exceed; absent: anything goes.
struct LimitSpec {
  std::optional<double> volume_drift = {};  // |V / V0 - 1| of the water
  std::optional<double> speed = {};         // of water and bodies, m/s
  std::optional<double> deformation = {};   // largest modal displacement / body size
  std::optional<double> energy = {};        // gain beyond actuation / largest kinetic and elastic
  std::optional<double> step = {};          // shortest step, s
  std::optional<int> iterations = {};       // of one coupled solve
};

/// A scene file as plain structs; paths are resolved against the scene's folder.
struct SceneSpec {
  std::string file;       // as given
  std::string directory;  // of the file
  std::string name;
  double end_time = 0.0;             // s
  double fps = 24.0;                 // frames per second of scene time
  Vec3 gravity = Vec3(0, 0, -9.81);  // m/s^2

  double cfl = 1.0;            // cells a step
  double outrun = 0.0;         // share of the water that may go farther
  double max_dt = 1.0 / 24.0;  // s
  Scheme scheme = Scheme::kNewmark;
  Geometry geometry = Geometry::kCutCell;
  bool full_surface = false;  // the water meets every triangle, not a rung
  double tolerance = 1e-5;    // [D88]
  int max_iterations = 200;
  ModalOptions modal;
  OnFail on_fail = OnFail::kHalveStep;

  std::optional<FluidSpec> fluid;
  std::vector<MarkersSpec> markers;
  std::vector<Gauge> gauges;
  std::vector<WaterSource> sources;
  std::vector<BodySpec> bodies;  // of [[body]], and the parts of skins behind them
  std::vector<SkinSpec> skins;
  std::vector<ScatterSpec> scatters;
  std::vector<StaticSpec> statics;
  std::vector<WavemakerSpec> wavemakers;
  std::vector<JointSpec> joints;
  std::vector<ForceSpec> forces;
  std::vector<ExternalSpec> externals;
  std::vector<SpringSpec> springs;
  std::vector<Motor> motors;                 // a, b: index of a [[body]]
  bool body_contact = false;                 // bodies against each other and against statics
  double restitution = 0.0, friction = 0.0;  // of walls, statics and bodies
  std::vector<std::string> frames;
  bool checkpoints = false;
  int checkpoint_every = 12;  // frames
  int checkpoint_keep = 2;
  LimitSpec limits;
  ExpectSpec expect;

  std::string text;  // TOML of exactly this scene, overrides included
};

}  // namespace archetide
