#pragma once

#include <string>
#include <vector>

#include "common/archetype/skin.h"
#include "common/params/schema.h"
#include "precompute/intake/regions.h"
#include "precompute/intake/repair.h"
#include "precompute/meshing/tetrahedralize.h"
#include "precompute/modal/elasticity.h"
#include "precompute/modal/modes.h"

namespace archetide {

/// The surface over bodies that were cut out of it, from a body file with a [skin].
struct SkinRecipe {
  double blend = 0.0;                   // m, along the surface
  std::vector<std::string> parts;       // names of the bodies
  std::vector<std::string> part_paths;  // of their body files
  SourceLocation parts_where;
  std::vector<SkinJoint> joints;            // points still in the mesh's coordinates, m
  std::vector<SourceLocation> joint_where;  // of each joint
};

/// A body file (NAME.body.toml), typed and checked. SI units.
struct Recipe {
  std::string path;       // of the body file
  std::string text;       // all of it, for the archetype's provenance
  std::string name;       // NAME
  std::string mesh;       // as written
  std::string mesh_path;  // relative to where the program runs
  SourceLocation mesh_where;
  double scale = 1.0;         // file coordinates to m
  RepairOptions repair;       // for surfaces
  std::vector<Cut> cuts;      // for surfaces, in the order of the file
  TetrahedralizeOptions tet;  // for surfaces
  Material material;
  std::vector<MaterialRegion> material_regions;  // in the order of the file
  std::vector<NamedRegion> points;               // named point sets
  std::vector<JointFrame> joint_frames;          // point still in the mesh's coordinates, m
  std::string clamped;                           // a point set, or empty
  std::vector<std::string> point_loads;          // point sets whose static responses are wanted
  double alpha = 0.0, beta = 0.0;                // Rayleigh damping, 1/s and s
  ModesOptions modes;
  bool keep_tets = false;          // store mass and stiffness of the tets too
  std::optional<SkinRecipe> skin;  // then nothing but mesh, scale and repair counts
};

/// Every key of a body file: type, unit, range, default, meaning.
const Schema& body_schema();

/// Throws FileError when the file cannot be read, InputError with all that is wrong in it.
Recipe read_recipe(const std::string& path);

/// The same from text; `path` names it in errors and anchors relative paths.
Recipe parse_recipe(const std::string& text, const std::string& path);

}  // namespace archetide
