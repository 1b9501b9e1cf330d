#include "runtime/scene/add_skins.h"

#include <fmt/core.h>

#include <map>

#include "common/archetype/surface_rung.h"

namespace archetide {
namespace {

std::string list_of(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "\"" : ", \"") + name + "\"";
  return text;
}

// The bodies' archetypes must be the skin's parts, in its order.
void demand_parts(const SkinSpec& spec, const Skin& skin, const BuiltScene& built) {
  std::string what;
  if (spec.bodies.size() != skin.parts.size())
    what = fmt::format("skin {} has {} parts, not {}", skin.name, skin.parts.size(),
                       spec.bodies.size());
  for (std::size_t p = 0; what.empty() && p < skin.parts.size(); ++p) {
    const std::string& found = built.bodies[spec.bodies[p]].archetype->name;
    if (found == skin.parts[p]) continue;
    what = fmt::format("part {} of skin {} is \"{}\", not \"{}\"", p + 1, skin.name, skin.parts[p],
                       found);
  }
  if (!what.empty())
    throw InputError({{spec.bodies_where, what, "its parts are " + list_of(skin.parts)}});
}

}  // namespace

double cell_of_rungs(const SceneSpec& scene, const SimulationOptions& o) {
  return scene.full_surface || !o.has_water || o.geometry != Geometry::kCutCell ? 0.0 : o.grid.dx;
}

void add_skins(const SceneSpec& scene, ArchetypeLibrary& library, BuiltScene& built) {
  // Instances of one skin over the same archetypes share what binds them.
  struct Shapes {
    std::shared_ptr<const BoundSkin> whole, rung;
  };
  std::map<std::vector<const void*>, Shapes> bound;
  for (const SkinSpec& spec : scene.skins) {
    if (scene.geometry == Geometry::kVoxel)
      throw InputError({{spec.where, "skins are not possible with coupling.geometry = \"voxel\"",
                         "use \"cut-cell\""}});
    const std::shared_ptr<const Skin> skin = library.load_skin(spec.archetype);
    demand_parts(spec, *skin, built);
    std::vector<std::shared_ptr<const Archetype>> parts;
    std::vector<const void*> key = {skin.get()};
    for (const int b : spec.bodies) {
      parts.push_back(built.bodies[b].archetype);
      key.push_back(parts.back().get());
      if (!spec.parts.empty())
        place_in_skin(spec.position, spec.rotation, spec.velocity, spec.angular_velocity,
                      built.bodies[b]);
    }
    Shapes& shapes = bound[key];
    if (!shapes.whole) {
      shapes.whole = bind_skin(skin, parts);
      const SkinRung* rung = coarsest_rung(skin->ladder, cell_of_rungs(scene, built.options));
      if (rung) shapes.rung = bind_skin(std::make_shared<Skin>(on_rung(*skin, *rung)), parts);
    }
    built.skins.push_back({shapes.whole, spec.bodies, shapes.rung});
    const std::vector<Joint> joints = skin_joints(built.skins.back(), built.bodies);
    if (!joints.empty() && scene.scheme == Scheme::kSingle)
      throw InputError({{spec.where, "joints are not possible with step.scheme = \"single\"",
                         "use \"newmark\", two solves a step"}});
    for (std::size_t n = 0; n < joints.size(); ++n) {
      built.joints.push_back(joints[n]);
      built.joint_names.push_back(fmt::format("[[skin.joint]] {} of {}", n + 1, skin->name));
    }
  }
}

}  // namespace archetide
