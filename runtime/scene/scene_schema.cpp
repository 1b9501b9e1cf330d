#include "runtime/scene/scene_schema.h"

#include "common/base/matter.h"

namespace archetide {
namespace {

using Keys = std::vector<Key>;
using enum KeyType;

Keys run_keys() {
  return {{.path = "schema",
           .type = kInteger,
           .fallback = "required",
           .meaning = "version of the file's keys, always 1 and always first"},
          {.path = "name",
           .type = kString,
           .fallback = "absent",
           .meaning = "of the run; absent = the file's name"},
          {.path = "gravity",
           .type = kVec3,
           .unit = "m/s^2",
           .range = between(-1e4, 1e4),
           .fallback = "[0, 0, -9.81]",
           .meaning = "z is up"},
          {.path = "time.end",
           .unit = "s",
           .range = above(0),
           .fallback = "required",
           .meaning = "length of the run"},
          {.path = "time.fps",
           .unit = "1/s",
           .range = {0, 1e6, true, false},
           .fallback = "24",
           .meaning = "frames per second of scene time"},
          {.path = "step.cfl",
           .unit = "cells",
           .range = between(0.1, 10),
           .fallback = "1.0",
           .meaning = "how far the fastest water or body may go in a step (in free fall farther)"},
          {.path = "step.outrun",
           .range = between(0, 0.1),
           .fallback = "0",
           .meaning = "share of the water that does not shorten steps (1e-4): slowed down to 3 "
                      "times cfl and 10 cells a step"},
          {.path = "step.max",
           .unit = "s",
           .range = above(0),
           .fallback = "\"1/24\"",
           .meaning = "longest step"},
          {.path = "step.scheme",
           .type = kString,
           .fallback = "\"newmark\"",
           .choices = {"newmark", "single"},
           .meaning = "two coupled solves a step, or one (cheaper, first order)"}};
}

Keys fluid_keys() {
  Keys keys = {
      {.path = "fluid",
       .type = kTable,
       .fallback = "absent",
       .meaning = "absent = no tank and no water: bodies in vacuum"},
      {.path = "fluid.grid",
       .type = kIntVec3,
       .unit = "cells",
       .range = between(1, 8192),
       .fallback = "required",
       .meaning = "size of the tank"},
      {.path = "fluid.cell",
       .unit = "m",
       .range = above(0),
       .fallback = "required",
       .meaning = "edge of a cell"},
      {.path = "fluid.origin",
       .type = kVec3,
       .unit = "m",
       .fallback = "[0, 0, 0]",
       .meaning = "low corner of the tank"},
      {.path = "fluid.density",
       .unit = "kg/m^3",
       .range = between(kLeastDensity, kLargestDensity),
       .fallback = "1000",
       .meaning = "of the water"},
      {.path = "fluid.water",
       .type = kTable,
       .fallback = "absent",
       .meaning =
           "where the water is at the start, the union of what is given; absent = the tank is "
           "full, no free surface"},
      {.path = "fluid.water.level",
       .unit = "m",
       .range = at_least(0),
       .fallback = "absent",
       .meaning = "height above the tank's floor; 0 = a dry tank"},
      {.path = "fluid.water.boxes[]",
       .type = kTables,
       .fallback = "absent",
       .meaning = "boxes of water"},
      {.path = "fluid.water.boxes[].low",
       .type = kVec3,
       .unit = "m",
       .fallback = "required",
       .meaning = "low corner"},
      {.path = "fluid.water.boxes[].high",
       .type = kVec3,
       .unit = "m",
       .fallback = "required",
       .meaning = "high corner"},
      {.path = "fluid.water.spheres[]",
       .type = kTables,
       .fallback = "absent",
       .meaning = "balls of water"},
      {.path = "fluid.water.spheres[].centre",
       .type = kVec3,
       .unit = "m",
       .fallback = "required",
       .meaning = "centre"},
      {.path = "fluid.water.spheres[].radius",
       .unit = "m",
       .range = above(0),
       .fallback = "required",
       .meaning = "radius"},
      {.path = "fluid.water.mesh",
       .type = kString,
       .fallback = "absent",
       .meaning = "closed surface (OBJ, OFF, PLY, STL) full of water, relative to this file"}};
  for (const char* side : {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"}) {
    keys.push_back({.path = "fluid.walls." + std::string(side),
                    .type = kString,
                    .fallback = "\"closed\"",
                    .choices = {"closed", "open"},
                    .meaning = "closed = free-slip wall, open = air (water, if it covers the whole "
                               "side at the start)"});
  }
  keys.push_back({.path = "fluid.drag",
                  .unit = "1/s",
                  .range = at_least(0),
                  .fallback = "0",
                  .meaning = "slows the water everywhere: currents fade as exp(-drag t); water has "
                             "no viscosity here and would move on"});
  keys.push_back({.path = "fluid.beach",
                  .type = kTable,
                  .fallback = "absent",
                  .meaning = "ends of the tank that absorb waves: the water is slowed there, most "
                             "at the side; absent = none"});
  for (const char* side : {"xmin", "xmax", "ymin", "ymax"})
    keys.push_back({.path = "fluid.beach." + std::string(side),
                    .unit = "m",
                    .range = at_least(0),
                    .fallback = "0",
                    .meaning = "its width from that side"});
  keys.push_back({.path = "fluid.beach.rate",
                  .unit = "1/s",
                  .range = above(0),
                  .fallback = "required",
                  .meaning = "at the side; it falls with the square of the way into the tank"});
  keys.push_back({.path = "fluid.particles",
                  .type = kTable,
                  .fallback = "absent",
                  .meaning = "particle level set; absent = plain level set"});
  keys.push_back({.path = "fluid.particles.per_cell",
                  .type = kInteger,
                  .range = between(1, 512),
                  .fallback = "64",
                  .meaning = "marker particles in a cell near the surface"});
  keys.push_back({.path = "fluid.particles.spray",
                  .type = kBool,
                  .fallback = "false",
                  .meaning =
                      "water particles that come away from the surface fly on as drops, with "
                      "their share of the water, until they fall into it again; write them "
                      "with output.frames = [\"spray.vtp\"]"});
  return keys;
}

Keys marker_keys() {
  return {
      {.path = "markers[]",
       .type = kTables,
       .fallback = "absent",
       .meaning = "passive points that the water carries, in the water of a box or a ball; write "
                  "them with output.frames = [\"markers.vtp\"]"},
      {.path = "markers[].count",
       .type = kInteger,
       .range = between(1, 10000000),
       .fallback = "required",
       .meaning = "how many"},
      {.path = "markers[].box",
       .type = kPoints,
       .unit = "m",
       .fallback = "absent",
       .meaning = "two corners"},
      {.path = "markers[].centre",
       .type = kVec3,
       .unit = "m",
       .fallback = "absent",
       .meaning = "of a ball"},
      {.path = "markers[].radius",
       .unit = "m",
       .range = above(0),
       .fallback = "absent",
       .meaning = "of a ball"},
      {.path = "markers[].seed",
       .type = kInteger,
       .range = at_least(0),
       .fallback = "1",
       .meaning = "of their places"}};
}

Keys coupling_keys() {
  return {{.path = "coupling.geometry",
           .type = kString,
           .fallback = "\"cut-cell\"",
           .choices = {"cut-cell", "voxel"},
           .meaning = "faces between water and bodies; voxel = the paper's"},
          {.path = "coupling.surface",
           .type = kString,
           .fallback = "\"auto\"",
           .choices = {"auto", "full"},
           .meaning = "what the water meets of bodies and skins: a stored surface about as coarse "
                      "as its cells (cut-cell), or all triangles"},
          {.path = "coupling.tolerance",
           .range = between(1e-14, 1e-2),
           .fallback = "1e-8",
           .meaning = "relative residual of the coupled solve; one below round-off (some 1e-11) "
                      "is met as far as round-off lets it"},
          {.path = "coupling.max_iterations",
           .type = kInteger,
           .range = between(1, 100000),
           .fallback = "200",
           .meaning = "of one coupled solve"},
          {.path = "coupling.modal_step",
           .type = kString,
           .fallback = "\"trapezoid\"",
           .choices = {"trapezoid", "backward-euler"},
           .meaning = "time integration of the modes; backward-euler = the paper's"},
          {.path = "coupling.modal_mass",
           .type = kString,
           .fallback = "\"exact\"",
           .choices = {"exact", "paper"},
           .meaning = "mass of the modes at the current deformation, or constant"},
          {.path = "coupling.on_fail",
           .type = kString,
           .fallback = "\"halve-step\"",
           .choices = {"halve-step", "stop"},
           .meaning = "when a solve does not converge"}};
}

Keys contact_keys(const std::string& table) {
  return {{.path = table + ".contact",
           .type = kTable,
           .fallback = "absent",
           .meaning = "absent = that of [contact]; where two meet, the larger restitution and the "
                      "geometric mean of the friction"},
          {.path = table + ".contact.restitution",
           .range = between(0, 1),
           .fallback = "absent",
           .meaning = "absent = that of [contact]"},
          {.path = table + ".contact.friction",
           .range = between(0, 10),
           .fallback = "absent",
           .meaning = "absent = that of [contact]"}};
}

// Keys that a body and the instances of a scatter share.
Keys instance_keys(const std::string& table, const std::string& archetype = "required") {
  return {
      {.path = table + ".archetype",
       .type = kString,
       .fallback = archetype,
       .meaning = "name of an archetype, or path of one ending in .h5, relative to this file"},
      {.path = table + ".velocity",
       .type = kVec3,
       .unit = "m/s",
       .fallback = "[0, 0, 0]",
       .meaning = "of the centre of mass"},
      {.path = table + ".angular_velocity",
       .type = kVec3,
       .unit = "rad/s",
       .fallback = "[0, 0, 0]",
       .meaning = "world frame"},
      {.path = table + ".density",
       .unit = "kg/m^3",
       .range = between(kLeastDensity, kLargestDensity),
       .fallback = "absent",
       .meaning = "scales the mass, leaves the stiffness; absent = the archetype's"},
      {.path = table + ".modes",
       .type = kIntegerOrString,
       .range = between(0, 100000),
       .fallback = "absent",
       .choices = {"all", "full"},
       .meaning = "0 = rigid; absent = all that are stored; \"full\" = the same, but only "
                  "from an archetype with every degree of freedom of its tets (modes.count = "
                  "\"full\" in the body file)"},
      {.path = table + ".deformable",
       .type = kString,
       .fallback = "\"modes\"",
       .choices = {"modes", "full"},
       .meaning = "full = every node of the tets is free instead of a few modes, with the "
                  "elasticity of its modes; the archetype must keep its tets (keep = \"tets\" in "
                  "the body file). Not with modes, [[skin]]"}};
}

Keys rotation_keys(const std::string& table) {
  return {{.path = table + ".rotation",
           .type = kTable,
           .fallback = "absent",
           .meaning = "absent = none"},
          {.path = table + ".rotation.axis",
           .type = kVec3,
           .fallback = "required",
           .meaning = "any length but 0"},
          {.path = table + ".rotation.degrees",
           .unit = "degrees",
           .fallback = "required",
           .meaning = "counter-clockwise seen from the axis' tip"}};
}

Keys body_keys() {
  return {{.path = "body[]", .type = kTables, .fallback = "absent", .meaning = "one body"},
          {.path = "body[].name",
           .type = kString,
           .fallback = "absent",
           .meaning = "absent = the archetype's name"},
          {.path = "body[].position",
           .type = kVec3,
           .unit = "m",
           .fallback = "required",
           .meaning = "of the centre of mass"}};
}

Keys scatter_keys() {
  return {
      {.path = "scatter[]",
       .type = kTables,
       .fallback = "absent",
       .meaning = "many instances of one or more archetypes, bounding spheres apart"},
      {.path = "scatter[].archetypes",
       .type = kStrings,
       .fallback = "absent",
       .meaning = "instead of archetype: several, which the instances take in turn"},
      {.path = "scatter[].count",
       .type = kInteger,
       .range = between(1, 1000000),
       .fallback = "required",
       .meaning = "how many"},
      {.path = "scatter[].box",
       .type = kPoints,
       .unit = "m",
       .fallback = "absent",
       .meaning = "two corners of the box of the centres of mass"},
      {.path = "scatter[].mesh",
       .type = kString,
       .fallback = "absent",
       .meaning = "instead of box: a closed surface (OBJ, OFF, PLY, STL) that the centres of mass "
                  "lie in, relative to this file"},
      {.path = "scatter[].rotation",
       .type = kString,
       .fallback = "\"random\"",
       .choices = {"random", "none"},
       .meaning = "uniform over all rotations, or none"},
      {.path = "scatter[].seed",
       .type = kInteger,
       .range = at_least(0),
       .fallback = "1",
       .meaning = "of places and rotations"},
      {.path = "scatter[].gap",
       .unit = "m",
       .range = at_least(0),
       .fallback = "0.0",
       .meaning = "least distance between bounding spheres"},
      {.path = "scatter[].waves",
       .type = kTable,
       .fallback = "absent",
       .meaning = "bodies that appear during the run, in the box, in equal parts; absent = all at "
                  "the start"},
      {.path = "scatter[].waves.count",
       .type = kInteger,
       .range = between(1, 1000000),
       .fallback = "required",
       .meaning = "of waves; the first appears at the start"},
      {.path = "scatter[].waves.every",
       .unit = "s",
       .range = above(0),
       .fallback = "required",
       .meaning = "between one wave and the next; bodies whose place is not free by then wait"}};
}

Keys surroundings_keys() {
  return {
      {.path = "static[]",
       .type = kTables,
       .fallback = "absent",
       .meaning = "an obstacle that stays"},
      {.path = "static[].mesh",
       .type = kString,
       .fallback = "required",
       .meaning = "closed surface (OBJ, OFF, PLY, STL), relative to this file"},
      {.path = "static[].scale", .range = above(0), .fallback = "1.0", .meaning = "applied first"},
      {.path = "static[].position",
       .type = kVec3,
       .unit = "m",
       .fallback = "[0, 0, 0]",
       .meaning = "of the mesh's origin"},
      {.path = "contact",
       .type = kTable,
       .fallback = "absent",
       .meaning = "absent = closed walls keep bodies in the tank without bounce or friction, and "
                  "nothing else stops them"},
      {.path = "contact.restitution",
       .range = between(0, 1),
       .fallback = "0.0",
       .meaning = "of bodies against closed walls, obstacles and each other"},
      {.path = "contact.friction",
       .range = between(0, 10),
       .fallback = "0.0",
       .meaning = "Coulomb coefficient of bodies against closed walls, obstacles and each other"},
      {.path = "contact.bodies",
       .type = kBool,
       .fallback = "true",
       .meaning = "bodies against each other and against obstacles (only with [contact])"}};
}

Keys skin_keys() {
  return {
      {.path = "skin[]",
       .type = kTables,
       .fallback = "absent",
       .meaning = "bodies cut out of one surface, which the water and the camera see as that "
                  "surface; they touch others as they are, and not each other"},
      {.path = "skin[].name",
       .type = kString,
       .fallback = "absent",
       .meaning = "absent = the archetype's name; its parts are called NAME.PART"},
      {.path = "skin[].archetype",
       .type = kString,
       .fallback = "required",
       .meaning = "name of a skin, or path of one ending in .h5, relative to this file"},
      {.path = "skin[].parts",
       .type = kStrings,
       .fallback = "absent",
       .meaning = "archetypes of the skin's parts, in its order: places one body of each, held "
                  "together by the skin's joints"},
      {.path = "skin[].bodies",
       .type = kStrings,
       .fallback = "absent",
       .meaning = "instead of parts: names of [[body]]s that stand where they should, also held "
                  "together by the skin's joints"},
      {.path = "skin[].position",
       .type = kVec3,
       .unit = "m",
       .fallback = "absent",
       .meaning = "of the mesh's origin (with parts, then required)"},
      {.path = "skin[].velocity",
       .type = kVec3,
       .unit = "m/s",
       .fallback = "[0, 0, 0]",
       .meaning = "of the mesh's origin (with parts)"},
      {.path = "skin[].angular_velocity",
       .type = kVec3,
       .unit = "rad/s",
       .fallback = "[0, 0, 0]",
       .meaning = "world frame (with parts)"},
      {.path = "skin[].density",
       .unit = "kg/m^3",
       .range = between(kLeastDensity, kLargestDensity),
       .fallback = "absent",
       .meaning = "of every part; absent = the archetypes' (with parts)"},
      {.path = "skin[].modes",
       .type = kInteger,
       .range = between(0, 100000),
       .fallback = "absent",
       .meaning = "of every part: 0 = rigid; absent = all that are stored (with parts)"}};
}

Keys joint_keys() {
  return {
      {.path = "joint[]",
       .type = kTables,
       .fallback = "absent",
       .meaning = "points of two bodies, or of a body and the world, that stay together: the union "
                  "of what is given (one: ball joint, two: hinge, three: weld); jointed bodies "
                  "do not collide with each other"},
      {.path = "joint[].bodies",
       .type = kStrings,
       .fallback = "required",
       .meaning = "names of two bodies, or of one and \"world\""},
      {.path = "joint[].points",
       .type = kPoints,
       .unit = "m",
       .fallback = "absent",
       .meaning = "in the rest frame of the first body, whose origin is the centre of mass"},
      {.path = "joint[].frame",
       .type = kString,
       .fallback = "absent",
       .meaning = "joint frame of the first body's archetype"},
      {.path = "joint[].type",
       .type = kString,
       .fallback = "\"ball\"",
       .choices = {"ball", "hinge", "weld"},
       .meaning = "of the frame: its point; another one along its z axis, at a tenth of the body's "
                  "bounding radius; a third one along its x axis"},
      {.path = "joint[].point_set",
       .type = kString,
       .fallback = "absent",
       .meaning = "named points of the first body's archetype"}};
}

Keys force_keys() {
  return {
      {.path = "force[]",
       .type = kTables,
       .fallback = "absent",
       .meaning =
           "actuation: forces on points of a body, fixed in its rest frame and sine in time, "
           "that deform it and never push or turn it as a whole"},
      {.path = "force[].body",
       .type = kString,
       .fallback = "required",
       .meaning = "name of a [[body]], or of the archetype of a [[scatter]]: every body that is "
                  "called so"},
      {.path = "force[].points",
       .type = kString,
       .fallback = "required",
       .meaning = "named point set of the archetype"},
      {.path = "force[].direction",
       .type = kVec3OrString,
       .fallback = "\"normal\"",
       .choices = {"normal", "radial", "inward"},
       .meaning = "a vector in the body's rest frame, the surface's outward normals, away from the "
                  "middle of the points, or towards it"},
      {.path = "force[].amplitude",
       .unit = "N",
       .range = above(0),
       .fallback = "required",
       .meaning = "of all points together, before balancing; each has an equal share, so that a "
                  "finer mesh changes nothing"},
      {.path = "force[].period",
       .unit = "s",
       .range = above(0),
       .fallback = "required",
       .meaning = "force = amplitude sin(2 pi (t - start) / period + phase)"},
      {.path = "force[].phase",
       .unit = "degrees",
       .fallback = "0.0",
       .meaning = "of the sine at start"},
      {.path = "force[].phases",
       .type = kString,
       .fallback = "\"same\"",
       .choices = {"same", "random"},
       .meaning = "random = each of several bodies has its own phase, uniform over the circle"},
      {.path = "force[].seed",
       .type = kInteger,
       .range = at_least(0),
       .fallback = "1",
       .meaning = "of random phases"},
      {.path = "force[].balance",
       .type = kString,
       .fallback = "\"points\"",
       .choices = {"points", "body"},
       .meaning = "what makes resultant and torque zero: the least change of the forces at the "
                  "points, or the whole body's inertia (then one point is enough)"},
      {.path = "force[].start",
       .unit = "s",
       .range = at_least(0),
       .fallback = "0.0",
       .meaning = "no force before"},
      {.path = "force[].end",
       .unit = "s",
       .range = above(0),
       .fallback = "absent",
       .meaning = "no force after; absent = it goes on"}};
}

Keys result_keys() {
  return {{.path = "output.frames",
           .type = kStrings,
           .fallback = "[\"surface.ply\", \"bodies.vtp\"]",
           .choices = {"surface.ply", "bodies.vtp", "particles.vtp", "markers.vtp", "spray.vtp"},
           .meaning = "files written every frame",
           .later = "this kind of frame",
           .later_values = {"surface.vdb", "phi.vti"}},
          {.path = "output.checkpoint",
           .type = kTable,
           .fallback = "absent",
           .meaning = "state to resume from, DIR/checkpoint; a run that is stopped writes one "
                      "anyway"},
          {.path = "output.checkpoint.every_frames",
           .type = kInteger,
           .range = at_least(1),
           .fallback = "12",
           .meaning = "frames from one checkpoint to the next"},
          {.path = "output.checkpoint.keep",
           .type = kInteger,
           .range = at_least(1),
           .fallback = "2",
           .meaning = "checkpoints that stay; older ones are removed"},
          {.path = "limits.volume_drift",
           .range = above(0),
           .fallback = "absent",
           .meaning = "the run stops with exit 3 when |V / V0 - 1| of the water is above"},
          {.path = "limits.speed",
           .unit = "m/s",
           .range = above(0),
           .fallback = "absent",
           .meaning = "the same when water or a surface point of a body is faster"},
          {.path = "limits.deformation",
           .range = above(0),
           .fallback = "absent",
           .meaning = "the same when a body's largest modal displacement exceeds this part of its "
                      "size"},
          {.path = "limits.energy",
           .range = above(0),
           .fallback = "absent",
           .meaning = "the same when kinetic, elastic and potential energy together have gained, "
                      "beyond the actuators' work, this part of the largest kinetic and elastic "
                      "energy so far"},
          {.path = "limits.step",
           .unit = "s",
           .range = above(0),
           .fallback = "absent",
           .meaning = "the same when the stable step, or one that was halved, is shorter"},
          {.path = "limits.iterations",
           .type = kInteger,
           .range = at_least(1),
           .fallback = "absent",
           .meaning = "the same when a coupled solve takes more"},
          {.path = "expect.volume_drift",
           .range = at_least(0),
           .fallback = "absent",
           .meaning = "largest |V / V0 - 1| of the water over the run"},
          {.path = "expect.iterations",
           .type = kInteger,
           .range = at_least(0),
           .fallback = "absent",
           .meaning = "most iterations of one coupled solve"},
          {.path = "expect.deformation_min",
           .range = at_least(0),
           .fallback = "absent",
           .meaning = "some body deforms at least so much once, relative to its size"},
          {.path = "expect.deformation_max",
           .range = at_least(0),
           .fallback = "absent",
           .meaning = "no body ever deforms more, relative to its size"},
          {.path = "expect.body[]",
           .type = kTables,
           .fallback = "absent",
           .meaning = "what one body must show, in the mean over the end of the run"},
          {.path = "expect.body[].body",
           .type = kInteger,
           .range = at_least(0),
           .fallback = "required",
           .meaning = "0 = the first [[body]]; scattered ones follow"},
          {.path = "expect.body[].window",
           .range = {0, 1, true, false},
           .fallback = "\"1/3\"",
           .meaning = "part of the run, at its end, that the means are over"},
          {.path = "expect.body[].z_min",
           .unit = "m",
           .fallback = "absent",
           .meaning = "mean height of the centre of mass, at least"},
          {.path = "expect.body[].z_max",
           .unit = "m",
           .fallback = "absent",
           .meaning = "mean height of the centre of mass, at most"},
          {.path = "expect.body[].speed_min",
           .unit = "m/s",
           .range = at_least(0),
           .fallback = "absent",
           .meaning = "mean speed of the centre of mass, at least"},
          {.path = "expect.body[].speed_max",
           .unit = "m/s",
           .range = at_least(0),
           .fallback = "absent",
           .meaning = "mean speed of the centre of mass, at most"},
          {.path = "expect.body[].z",
           .unit = "m",
           .fallback = "absent",
           .meaning = "closed form of the mean height of the centre of mass: bench compares with "
                      "it"},
          {.path = "expect.body[].draft",
           .unit = "m",
           .fallback = "absent",
           .meaning = "closed form of the mean draft, from the body's lowest point up to the level "
                      "of the calm water: bench compares with it"},
          {.path = "expect.body[].margin",
           .unit = "m",
           .range = above(0),
           .fallback = "absent",
           .meaning = "largest distance from the closed forms; absent = only bench looks at them"}};
}

void append(Keys& all, const Keys& more) { all.insert(all.end(), more.begin(), more.end()); }

}  // namespace

const Schema& scene_schema() {
  static const Schema schema = [] {
    Keys keys;
    for (const Keys& part :
         {run_keys(), fluid_keys(), marker_keys(), coupling_keys(), body_keys(),
          instance_keys("body[]"), contact_keys("body[]"), rotation_keys("body[]"), scatter_keys(),
          instance_keys("scatter[]", "absent"), contact_keys("scatter[]"), surroundings_keys(),
          contact_keys("static[]"), rotation_keys("static[]"), joint_keys(), force_keys(),
          skin_keys(), rotation_keys("skin[]"), result_keys()}) {
      append(keys, part);
    }
    return Schema("*.scene.toml", keys);
  }();
  return schema;
}

}  // namespace archetide
