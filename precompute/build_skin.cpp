#include "precompute/build_skin.h"

#include <fmt/core.h>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/base/input_error.h"
#include "common/base/sha256.h"
#include "common/files/json_text.h"
#include "common/files/surface_io.h"
#include "common/mesh/closest_point.h"
#include "common/mesh/mesh_sdf.h"
#include "common/params/cli.h"
#include "precompute/intake/intake.h"
#include "precompute/skin_weights.h"
#include "precompute/surface_ladder.h"

namespace archetide {
namespace {

std::string place(const Vec3& x) {
  std::ostringstream text;
  text << '(' << x[0] << ", " << x[1] << ", " << x[2] << ')';
  return text.str();
}

/// The cuts of every part.
std::vector<std::vector<Cut>> cuts_of_parts(const Recipe& recipe) {
  std::vector<std::vector<Cut>> cuts;
  for (const std::string& path : recipe.skin->part_paths) {
    const Recipe part = read_recipe(path);
    const auto demand = [&](bool holds, const std::string& what, const std::string& hint) {
      if (!holds) throw InputError({Diagnostic{recipe.skin->parts_where, path + what, hint}});
    };
    demand(!part.skin, " is a skin itself", "name the body files of bodies");
    demand(part.mesh_path == recipe.mesh_path && part.scale == recipe.scale,
           " is not made of the same mesh at the same scale",
           "the skin's mesh is " + recipe.mesh_path);
    cuts.push_back(part.cuts);
  }
  return cuts;
}

/// The first part that holds each vertex (on a boundary there are two).
std::vector<int> owners(const Recipe& recipe, const TriMesh& surface) {
  const std::vector<std::vector<Cut>> cuts = cuts_of_parts(recipe);
  std::vector<int> owner, count(cuts.size(), 0);
  for (const Vec3& x : surface.vertices) {
    std::size_t p = 0;
    while (p < cuts.size() && !keeps(cuts[p], x)) ++p;
    if (p == cuts.size())
      throw InputError({Diagnostic{recipe.skin->parts_where,
                                   "the surface at " + place(x) + " belongs to no part",
                                   "the cuts of the parts must share out the whole surface"}});
    owner.push_back(int(p));
    ++count[p];
  }
  for (std::size_t p = 0; p < cuts.size(); ++p)
    if (count[p] == 0)
      throw InputError({Diagnostic{recipe.skin->parts_where,
                                   recipe.skin->parts[p] + " has nothing of the surface",
                                   "its cuts keep no vertex that an earlier part leaves"}});
  return owner;
}

/// Joints hold material: their points lie in the solid, or next to it.
void demand_points_inside(const SkinRecipe& recipe, const TriMesh& surface) {
  const ClosestPoint nearest(surface);
  for (std::size_t j = 0; j < recipe.joints.size(); ++j)
    for (const Vec3& x : recipe.joints[j].points)
      if (winding_number(surface, x) < 0.5 && nearest.find(x, recipe.blend).triangle < 0)
        throw InputError({Diagnostic{recipe.joint_where[j],
                                     "the joint's point " + place(x) + " lies outside the body",
                                     "coordinates are those of the mesh file times scale, in "
                                     "metres"}});
}

/// Vertices that a part moves, and those that it moves alone.
struct Share {
  int vertices = 0, alone = 0;
};
std::vector<Share> shares(const Skin& skin) {
  std::vector<Share> of(skin.parts.size());
  for (std::size_t v = 0; v < skin.part_of.size(); ++v)
    for (int k = 0; k < Skin::kMostParts; ++k) {
      const double w = skin.weights[Skin::kMostParts * v + std::size_t(k)];
      Share& share = of[std::size_t(skin.part_of[v][std::size_t(k)])];
      share.vertices += w > 0.0;
      share.alone += w == 1.0;
    }
  return of;
}

}  // namespace

Skin build_skin(const Recipe& recipe, Profile& profile) {
  Skin skin;
  skin.name = recipe.name;
  skin.generator = "archetide-precompute " ARCHETIDE_VERSION;
  skin.recipe = recipe.text;
  skin.mesh_file = recipe.mesh;
  skin.blend = recipe.skin->blend;
  skin.parts = recipe.skin->parts;
  skin.joints = recipe.skin->joints;
  if (!is_surface_file(recipe.mesh_path))
    throw InputError(
        {Diagnostic{recipe.mesh_where, "a skin is a surface", "use .obj, .off, .ply or .stl"}});
  IntakeReport intake;
  {
    const ScopedTimer timer(profile, "intake");
    double cpu_seconds = recipe.tet.cpu_seconds;
    skin.surface = accept_surface(read_surface(recipe.mesh_path), recipe.scale, recipe.repair,
                                  cpu_seconds, intake);
    skin.mesh_hash = sha256_of_file(recipe.mesh_path);
  }
  for (const std::string& note : intake.notes()) log_info(recipe.mesh_path + ": " + note);
  demand_points_inside(*recipe.skin, skin.surface);
  {
    const ScopedTimer timer(profile, "weights");
    find_skin_weights(owners(recipe, skin.surface), skin.blend, skin);
  }
  {
    const ScopedTimer timer(profile, "ladder");
    skin.ladder = surface_ladder(skin);
  }
  log_info(fmt::format("skin: {} vertices, {} parts, {} joints", skin.surface.vertices.size(),
                       skin.parts.size(), skin.joints.size()));
  return skin;
}

std::string skin_text(const Skin& skin, std::size_t file_bytes) {
  std::ostringstream text;
  text << "skin " << skin.name << ": " << skin.surface.vertices.size() << " vertices, "
       << skin.surface.triangles.size() << " triangles, volume " << enclosed_volume(skin.surface)
       << " m^3, blend " << skin.blend << " m\n";
  const std::vector<Share> of = shares(skin);
  for (std::size_t p = 0; p < of.size(); ++p)
    text << "part " << skin.parts[p] << ": moves " << of[p].vertices << " vertices, " << of[p].alone
         << " of them alone\n";
  for (const SkinJoint& joint : skin.joints)
    text << "joint " << skin.parts[std::size_t(joint.a)] << " - "
         << skin.parts[std::size_t(joint.b)] << ": " << joint.points.size() << " points\n";
  text << "mesh " << skin.mesh_file << ", SHA-256 " << skin.mesh_hash << "\n";
  if (file_bytes > 0) text << "hash " << skin.content_hash << ", " << file_bytes << " bytes\n";
  return text.str();
}

std::string skin_json(const Skin& skin, std::size_t file_bytes) {
  using nlohmann::ordered_json;
  ordered_json json;
  json["kind"] = "skin";
  json["name"] = skin.name;
  json["vertices"] = skin.surface.vertices.size();
  json["triangles"] = skin.surface.triangles.size();
  json["volume"] = enclosed_volume(skin.surface);
  json["blend"] = skin.blend;
  const std::vector<Share> of = shares(skin);
  for (std::size_t p = 0; p < of.size(); ++p)
    json["parts"].push_back(ordered_json{
        {"name", skin.parts[p]}, {"vertices", of[p].vertices}, {"alone", of[p].alone}});
  json["joints"] = ordered_json::array();
  for (const SkinJoint& joint : skin.joints)
    json["joints"].push_back(
        ordered_json{{"parts", {joint.a, joint.b}}, {"points", joint.points.size()}});
  json["mesh"] = {{"file", skin.mesh_file}, {"hash", skin.mesh_hash}};
  json["hash"] = skin.content_hash;
  json["bytes"] = file_bytes;
  return json_text(json);
}

}  // namespace archetide
