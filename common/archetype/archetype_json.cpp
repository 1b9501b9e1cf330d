#include "common/archetype/archetype_json.h"

#include <nlohmann/json.hpp>

#include "common/archetype/archetype_figures.h"
#include "common/files/json_text.h"

namespace archetide {
namespace {

using Json = nlohmann::ordered_json;

std::vector<double> list(const VecX& x) { return {x.begin(), x.end()}; }

Json rows(const Mat3& m) {
  return {list(m.row(0).transpose()), list(m.row(1).transpose()), list(m.row(2).transpose())};
}

template <class Items>
Json names(const Items& items) {
  Json out = Json::array();
  for (const auto& item : items) out.push_back(item.name);
  return out;
}

}  // namespace

std::string archetype_json(const Archetype& a, std::size_t file_bytes) {
  Json out;
  out["name"] = a.name;
  out["generator"] = a.generator;
  out["mesh"] = {{"file", a.mesh_file}, {"sha256", a.mesh_hash}};
  out["mesher"] = a.mesher;
  out["mass_kind"] = a.mass_kind;
  out["blas"] = a.blas;
  out["material"] = {{"density", a.density}, {"young", a.young}, {"poisson", a.poisson}};
  out["damping"] = {{"alpha", a.alpha}, {"beta", a.beta}};
  out["surface_vertices"] = a.surface.vertices.size();
  out["volume"] = a.volume;
  out["mass"] = a.integrals.mass;
  out["center"] = list(a.centre);
  out["inertia"] = rows(inertia(a));
  out["nonlinear"] = a.nonlinear();
  out["frequencies_hz"] = frequencies_hz(a);
  out["is_static"] = a.is_static;
  out["frequency_error"] = list(a.frequency_error);
  out["residuals"] = list(a.residuals);
  out["quality"] = {{"min_dihedral_deg", a.min_dihedral}, {"min_radius_ratio", a.min_radius_ratio}};
  out["point_sets"] = names(a.point_sets);
  out["joint_frames"] = names(a.joint_frames);
  Json ladder = Json::array();
  for (const SurfaceRung& rung : a.ladder) ladder.push_back(rung.surface.vertices.size());
  out["ladder"] = ladder;  // vertices of the coarser surfaces
  out["hash"] = a.content_hash;
  out["bytes"] = file_bytes;
  return json_text(out);
}

}  // namespace archetide
