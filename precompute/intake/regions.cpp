#include "precompute/intake/regions.h"

#include <algorithm>

namespace archetide {

bool Region::contains(const Vec3& x) const {
  if (box)
    return (x.array() >= box->first.array()).all() && (x.array() <= box->second.array()).all();
  if (ball) return (x - ball->first).norm() <= ball->second;
  if (half_space) return (x - half_space->point).dot(half_space->normal) <= 0.0;
  if (!cylinder) return false;
  const Vec3 axis = cylinder->to - cylinder->from;
  const double along = (x - cylinder->from).dot(axis) / axis.squaredNorm();
  return along >= 0.0 && along <= 1.0 &&
         (x - cylinder->from - along * axis).norm() <= cylinder->radius;
}

bool keeps(const std::vector<Cut>& cuts, const Vec3& x) {
  return std::all_of(cuts.begin(), cuts.end(),
                     [&](const Cut& cut) { return cut.region.contains(x) == cut.inside; });
}

PointSet find_points(const NamedRegion& named, const TriMesh& surface, const Vec3& centre) {
  PointSet set{named.name, {}};
  const int n = int(surface.vertices.size());
  for (int v = 0; v < n; ++v)
    if (named.region.contains(surface.vertices[v] + centre)) set.vertices.push_back(v);
  for (const Vec3& wanted : named.region.list) {
    int nearest = 0;
    for (int v = 1; v < n; ++v)
      if ((surface.vertices[v] + centre - wanted).squaredNorm() <
          (surface.vertices[nearest] + centre - wanted).squaredNorm())
        nearest = v;
    set.vertices.push_back(nearest);
  }
  std::sort(set.vertices.begin(), set.vertices.end());
  set.vertices.erase(std::unique(set.vertices.begin(), set.vertices.end()), set.vertices.end());
  if (set.vertices.empty())
    throw InputError(
        {Diagnostic{named.where, "no vertex of the body's surface lies in \"" + named.name + "\"",
                    "coordinates are those of the mesh file times scale, in metres"}});
  return set;
}

namespace {

/// Tets of a region.
std::vector<int> tets_in(const MaterialRegion& part, const TetMesh& mesh, const Vec3& centre,
                         const TetGroups& groups) {
  std::vector<int> tets;
  if (!part.region.group.empty()) {
    const auto found = groups.find(part.region.group);
    if (found != groups.end()) return found->second;
    std::string known;
    for (const auto& [name, list] : groups) known += (known.empty() ? "" : ", ") + name;
    throw InputError({Diagnostic{
        part.where, "the mesh has no physical group \"" + part.region.group + "\" of tets",
        known.empty() ? "physical groups come with .msh files only" : "its groups are: " + known}});
  }
  for (int t = 0; t < int(mesh.tets.size()); ++t) {
    Vec3 middle = centre;
    for (const int node : mesh.tets[t]) middle += 0.25 * mesh.nodes[node];
    if (part.region.contains(middle)) tets.push_back(t);
  }
  return tets;
}

}  // namespace

MaterialField find_materials(const Material& base, const std::vector<MaterialRegion>& regions,
                             const TetMesh& mesh, const Vec3& centre, const TetGroups& groups) {
  MaterialField field(base);
  if (regions.empty()) return field;
  field.of_tet.assign(mesh.tets.size(), 0);
  for (const MaterialRegion& part : regions) {
    const int index = int(field.materials.size());
    field.materials.push_back(part.material);
    const std::vector<int> tets = tets_in(part, mesh, centre, groups);
    for (const int t : tets) field.of_tet[t] = index;
    if (tets.empty())
      throw InputError(
          {Diagnostic{part.where, "no tet lies in this material region",
                      "coordinates are those of the mesh file times scale, in metres"}});
  }
  return field;
}

}  // namespace archetide
