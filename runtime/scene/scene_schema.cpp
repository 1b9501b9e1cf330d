#include "runtime/scene/scene_schema.h"

namespace archetide {
namespace {

using Keys = std::vector<Key>;
using enum KeyType;

Keys run_keys() {
  return {
      {.path = "schema", .type = kInteger, .fallback = "required",
       .meaning = "version of the file's keys, always 1 and always first"},
      {.path = "name", .type = kString, .fallback = "absent",
       .meaning = "of the run; absent = the file's name"},
      {.path = "gravity", .type = kVec3, .unit = "m/s^2", .range = between(-1e4, 1e4),
       .fallback = "[0, 0, -9.81]", .meaning = "z is up"},
      {.path = "time.end", .unit = "s", .range = above(0), .fallback = "required",
       .meaning = "length of the run"},
      {.path = "time.fps", .unit = "1/s", .range = {0, 1e6, true, false}, .fallback = "24",
       .meaning = "frames per second of scene time"},
      {.path = "step.cfl", .unit = "cells", .range = between(0.1, 10), .fallback = "1.0",
       .meaning = "how far the fastest water or body may go in a step"},
      {.path = "step.max", .unit = "s", .range = above(0), .fallback = "\"1/24\"",
       .meaning = "longest step"},
      {.path = "step.scheme", .type = kString, .fallback = "\"newmark\"",
       .choices = {"newmark", "single"},
       .meaning = "two coupled solves a step, or one (cheaper, first order)"}};
}

Keys fluid_keys() {
  Keys keys = {
      {.path = "fluid", .type = kTable, .fallback = "absent",
       .meaning = "absent = no tank and no water: bodies in vacuum"},
      {.path = "fluid.grid", .type = kIntVec3, .unit = "cells", .range = between(1, 8192),
       .fallback = "required", .meaning = "size of the tank"},
      {.path = "fluid.cell", .unit = "m", .range = above(0), .fallback = "required",
       .meaning = "edge of a cell"},
      {.path = "fluid.origin", .type = kVec3, .unit = "m", .fallback = "[0, 0, 0]",
       .meaning = "low corner of the tank"},
      {.path = "fluid.density", .unit = "kg/m^3", .range = above(0), .fallback = "1000",
       .meaning = "of the water"},
      {.path = "fluid.water", .type = kTable, .fallback = "absent",
       .meaning = "where the water is at the start, the union of what is given; absent = the tank is "
                  "full, no free surface"},
      {.path = "fluid.water.level", .unit = "m", .range = at_least(0), .fallback = "absent",
       .meaning = "height above the tank's floor; 0 = a dry tank"},
      {.path = "fluid.water.boxes[]", .type = kTables, .fallback = "absent", .meaning = "boxes of water"},
      {.path = "fluid.water.boxes[].low", .type = kVec3, .unit = "m", .fallback = "required",
       .meaning = "low corner"},
      {.path = "fluid.water.boxes[].high", .type = kVec3, .unit = "m", .fallback = "required",
       .meaning = "high corner"},
      {.path = "fluid.water.spheres[]", .type = kTables, .fallback = "absent",
       .meaning = "balls of water"},
      {.path = "fluid.water.spheres[].centre", .type = kVec3, .unit = "m", .fallback = "required",
       .meaning = "centre"},
      {.path = "fluid.water.spheres[].radius", .unit = "m", .range = above(0), .fallback = "required",
       .meaning = "radius"},
      {.path = "fluid.water.mesh", .type = kString, .fallback = "absent",
       .meaning = "closed OBJ surface full of water, relative to this file"}};
  for (const char* side : {"xmin", "xmax", "ymin", "ymax", "zmin", "zmax"}) {
    keys.push_back({.path = "fluid.walls." + std::string(side), .type = kString,
                    .fallback = "\"closed\"", .choices = {"closed", "open"},
                    .meaning = "closed = free-slip wall, open = air"});
  }
  keys.push_back({.path = "fluid.particles", .type = kTable, .fallback = "absent",
                  .meaning = "particle level set; absent = plain level set"});
  keys.push_back({.path = "fluid.particles.per_cell", .type = kInteger, .range = between(1, 512),
                  .fallback = "64", .meaning = "marker particles in a cell near the surface"});
  return keys;
}

Keys coupling_keys() {
  return {
      {.path = "coupling.geometry", .type = kString, .fallback = "\"cut-cell\"",
       .choices = {"cut-cell", "voxel"}, .meaning = "faces between water and bodies; voxel = the paper's"},
      {.path = "coupling.tolerance", .range = between(1e-14, 1e-2), .fallback = "1e-8",
       .meaning = "relative residual of the coupled solve"},
      {.path = "coupling.max_iterations", .type = kInteger, .range = between(1, 100000),
       .fallback = "200", .meaning = "of one coupled solve"},
      {.path = "coupling.modal_step", .type = kString, .fallback = "\"trapezoid\"",
       .choices = {"trapezoid", "backward-euler"},
       .meaning = "time integration of the modes; backward-euler = the paper's"},
      {.path = "coupling.modal_mass", .type = kString, .fallback = "\"exact\"",
       .choices = {"exact", "paper"}, .meaning = "mass of the modes at the current deformation, or constant"},
      {.path = "coupling.on_fail", .type = kString, .fallback = "\"halve-step\"",
       .choices = {"halve-step", "stop"}, .meaning = "when a solve does not converge"}};
}

// Keys that a body and the instances of a scatter share.
Keys instance_keys(const std::string& table) {
  return {
      {.path = table + ".archetype", .type = kString, .fallback = "required",
       .meaning = "name of an archetype, or path of one ending in .h5, relative to this file"},
      {.path = table + ".velocity", .type = kVec3, .unit = "m/s", .fallback = "[0, 0, 0]",
       .meaning = "of the centre of mass"},
      {.path = table + ".angular_velocity", .type = kVec3, .unit = "rad/s", .fallback = "[0, 0, 0]",
       .meaning = "world frame"},
      {.path = table + ".density", .unit = "kg/m^3", .range = above(0), .fallback = "absent",
       .meaning = "scales the mass, leaves the stiffness; absent = the archetype's"},
      {.path = table + ".modes", .type = kIntegerOrString, .range = between(0, 100000),
       .fallback = "absent", .choices = {"all"},
       .meaning = "0 = rigid; absent = all that are stored",
       .later = "every degree of freedom of the tet mesh", .later_values = {"full"}}};
}

Keys rotation_keys(const std::string& table) {
  return {
      {.path = table + ".rotation", .type = kTable, .fallback = "absent", .meaning = "absent = none"},
      {.path = table + ".rotation.axis", .type = kVec3, .fallback = "required",
       .meaning = "any length but 0"},
      {.path = table + ".rotation.degrees", .unit = "degrees", .fallback = "required",
       .meaning = "counter-clockwise seen from the axis' tip"}};
}

Keys body_keys() {
  return {
      {.path = "body[]", .type = kTables, .fallback = "absent", .meaning = "one body"},
      {.path = "body[].name", .type = kString, .fallback = "absent",
       .meaning = "absent = the archetype's name"},
      {.path = "body[].position", .type = kVec3, .unit = "m", .fallback = "required",
       .meaning = "of the centre of mass"}};
}

Keys scatter_keys() {
  return {
      {.path = "scatter[]", .type = kTables, .fallback = "absent",
       .meaning = "many instances of one archetype, bounding spheres apart"},
      {.path = "scatter[].count", .type = kInteger, .range = between(1, 1000000),
       .fallback = "required", .meaning = "how many"},
      {.path = "scatter[].box", .type = kPoints, .unit = "m", .fallback = "required",
       .meaning = "two corners of the box of the centres of mass"},
      {.path = "scatter[].rotation", .type = kString, .fallback = "\"random\"",
       .choices = {"random", "none"}, .meaning = "uniform over all rotations, or none"},
      {.path = "scatter[].seed", .type = kInteger, .range = at_least(0), .fallback = "1",
       .meaning = "of places and rotations"},
      {.path = "scatter[].gap", .unit = "m", .range = at_least(0), .fallback = "0.0",
       .meaning = "least distance between bounding spheres"},
      {.path = "scatter[].waves", .type = kTable, .fallback = "absent",
       .meaning = "bodies that appear during the run", .later = "bodies that appear during the run"}};
}

Keys surroundings_keys() {
  return {
      {.path = "static[]", .type = kTables, .fallback = "absent", .meaning = "an obstacle that stays"},
      {.path = "static[].mesh", .type = kString, .fallback = "required",
       .meaning = "closed OBJ surface, relative to this file"},
      {.path = "static[].scale", .range = above(0), .fallback = "1.0", .meaning = "applied first"},
      {.path = "static[].position", .type = kVec3, .unit = "m", .fallback = "[0, 0, 0]",
       .meaning = "of the mesh's origin"},
      {.path = "contact", .type = kTable, .fallback = "absent",
       .meaning = "absent = closed walls keep bodies in the tank without bounce or friction"},
      {.path = "contact.restitution", .range = between(0, 1), .fallback = "0.0",
       .meaning = "of bodies against closed walls"},
      {.path = "contact.friction", .range = between(0, 10), .fallback = "0.0",
       .meaning = "Coulomb coefficient of bodies against closed walls"},
      {.path = "contact.bodies", .type = kBool, .fallback = "false",
       .meaning = "bodies against bodies", .later = "contact between bodies", .later_values = {"true"}},
      {.path = "joint[]", .type = kTables, .fallback = "absent", .meaning = "point joints",
       .later = "joints"},
      {.path = "force[]", .type = kTables, .fallback = "absent", .meaning = "actuation",
       .later = "actuation forces"},
      {.path = "skin[]", .type = kTables, .fallback = "absent",
       .meaning = "articulated bodies as one surface", .later = "skins"}};
}

Keys result_keys() {
  return {
      {.path = "output.frames", .type = kStrings, .fallback = "[\"surface.ply\", \"bodies.vtp\"]",
       .choices = {"surface.ply", "bodies.vtp", "particles.vtp"}, .meaning = "files written every frame",
       .later = "this kind of frame", .later_values = {"surface.vdb", "phi.vti"}},
      {.path = "output.checkpoint", .type = kTable, .fallback = "absent",
       .meaning = "state to resume from", .later = "checkpoints and resume"},
      {.path = "limits.volume_drift", .range = above(0), .fallback = "absent",
       .meaning = "the run stops with exit 3 when |V / V0 - 1| of the water is above"},
      {.path = "expect.volume_drift", .range = at_least(0), .fallback = "absent",
       .meaning = "largest |V / V0 - 1| of the water over the run"},
      {.path = "expect.iterations", .type = kInteger, .range = at_least(0), .fallback = "absent",
       .meaning = "most iterations of one coupled solve"},
      {.path = "expect.deformation_min", .range = at_least(0), .fallback = "absent",
       .meaning = "some body deforms at least so much once, relative to its size"},
      {.path = "expect.deformation_max", .range = at_least(0), .fallback = "absent",
       .meaning = "no body ever deforms more, relative to its size"},
      {.path = "expect.body[]", .type = kTables, .fallback = "absent",
       .meaning = "what one body must show, in the mean over the end of the run"},
      {.path = "expect.body[].body", .type = kInteger, .range = at_least(0), .fallback = "required",
       .meaning = "0 = the first [[body]]; scattered ones follow"},
      {.path = "expect.body[].window", .range = {0, 1, true, false}, .fallback = "\"1/3\"",
       .meaning = "part of the run, at its end, that the means are over"},
      {.path = "expect.body[].z_min", .unit = "m", .fallback = "absent",
       .meaning = "mean height of the centre of mass, at least"},
      {.path = "expect.body[].z_max", .unit = "m", .fallback = "absent",
       .meaning = "mean height of the centre of mass, at most"},
      {.path = "expect.body[].speed_min", .unit = "m/s", .range = at_least(0), .fallback = "absent",
       .meaning = "mean speed of the centre of mass, at least"},
      {.path = "expect.body[].speed_max", .unit = "m/s", .range = at_least(0), .fallback = "absent",
       .meaning = "mean speed of the centre of mass, at most"}};
}

void append(Keys& all, const Keys& more) { all.insert(all.end(), more.begin(), more.end()); }

}  // namespace

const Schema& scene_schema() {
  static const Schema schema = [] {
    Keys keys;
    for (const Keys& part :
         {run_keys(), fluid_keys(), coupling_keys(), body_keys(), instance_keys("body[]"),
          rotation_keys("body[]"), scatter_keys(), instance_keys("scatter[]"), surroundings_keys(),
          rotation_keys("static[]"), result_keys()}) {
      append(keys, part);
    }
    return Schema("*.scene.toml", keys);
  }();
  return schema;
}

}  // namespace archetide
