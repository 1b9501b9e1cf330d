#include "precompute/inspect/inspect.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "common/archetype/archetype_figures.h"
#include "common/archetype/archetype_json.h"
#include "common/files/json_text.h"
#include "precompute/base/joined.h"
#include "precompute/inspect/lines.h"

namespace archetide {
namespace {

using Json = nlohmann::ordered_json;
using namespace lines;

std::vector<double> list(const Vec3& x) { return {x[0], x[1], x[2]}; }

Json rows(const Mat3& m) { return {list(m.row(0)), list(m.row(1)), list(m.row(2))}; }

Json object(const std::vector<std::pair<std::string, double>>& pairs) {
  Json out = Json::object();
  for (const auto& [name, value] : pairs) out[name] = value;
  return out;
}

std::string percent(double x, double reference) { return joined(100 * (x / reference - 1), " %"); }

/// One basis vector: what it is, its frequency with the estimated error, its residual.
std::string basis_line(const Archetype& a, int k, double hz) {
  if (a.is_static[k]) return joined(k + 1, ": static response, ", hz, " Hz by its energy");
  const std::optional<double> error = frequency_error(a, k);
  return joined(k + 1, ": ", hz, " Hz",
                error ? joined(", estimated error ", 100 * *error, " %") : "", ", residual ",
                a.residuals[k]);
}

}  // namespace

std::string info_text(const Archetype& a, std::size_t file_bytes,
                      const std::optional<BuildRecord>& record) {
  std::ostringstream text;
  line(text, "name", a.name);
  line(text, "made by",
       joined(a.generator, " from ", a.mesh_file, ", mesher ", a.mesher, ", ", a.mass_kind,
              " mass, ", a.blas));
  line(text, "material",
       joined(a.density, " kg/m^3, Young ", a.young, " Pa, Poisson ", a.poisson, ", damping ",
              a.alpha, " 1/s, ", a.beta, " s"));
  line(text, "tets",
       joined(a.tets.tets.size(), a.tets.order() == 2 ? " quadratic, with " : " linear, with ",
              a.tets.nodes.size(), " nodes; surface of ", a.surface.vertices.size(), " vertices"));
  line(text, "quality",
       joined("smallest dihedral ", a.min_dihedral, " degrees, radius ratio ", a.min_radius_ratio));
  line(text, "volume", joined(a.volume, " m^3"));
  line(text, "mass", joined(a.integrals.mass, " kg"));
  line(text, "center", row(a.centre) + " m in the mesh's coordinates");
  for (int i = 0; i < 3; ++i) {
    line(text, i == 0 ? "inertia" : "", row(inertia(a).row(i)) + (i == 0 ? " kg m^2" : ""));
  }
  const SolidFigures solid = solid_of_surface(a);
  line(text, "surface's",
       joined("mass ", percent(solid.mass, a.integrals.mass), ", centre ", solid.centre.norm(),
              " m away, inertia ", (solid.inertia - inertia(a)).norm() / inertia(a).norm(),
              " (relative; divergence theorem)"));
  if (record && record->surface_volume > 0) {
    const Mat3 exact = a.density * record->surface_inertia;
    line(text, "input's",
         joined("mass ", percent(a.density * record->surface_volume, a.integrals.mass), ", centre ",
                (record->surface_centroid - a.centre).norm(), " m away, inertia ",
                (exact - inertia(a)).norm() / inertia(a).norm(), " (the surface that came in)"));
  }
  const auto statics = std::count(a.is_static.begin(), a.is_static.end(), 1);
  line(text, "modes", joined(a.r() - statics, " and ", statics, " static responses"));
  const std::vector<double> hz = frequencies_hz(a);
  for (int k = 0; k < a.r(); ++k) line(text, "", basis_line(a, k, hz[k]));
  const Orthogonality o = orthogonality(a);
  line(text, "orthogonality",
       joined("modes ", o.mass, " kg, translations ", o.translation, ", rotations ", o.rotation));
  line(text, "distance grid",
       joined(a.sdf.nodes[0], " x ", a.sdf.nodes[1], " x ", a.sdf.nodes[2], " nodes, spacing ",
              a.sdf.spacing, " m"));
  line(text, "hash", a.content_hash);
  line(text, "bytes", std::to_string(file_bytes));
  if (!record) return text.str();
  std::string seconds, peaks;
  for (const auto& [phase, value] : record->seconds) seconds += joined(phase, " ", value, "  ");
  for (const auto& [step, value] : record->memory) peaks += joined(step, " ", value / 1e6, "  ");
  line(text, "seconds", seconds);
  line(text, "peak MB", peaks);
  for (const std::string& note : record->notes) line(text, "intake", note);
  return text.str();
}

std::string info_json(const Archetype& a, std::size_t file_bytes,
                      const std::optional<BuildRecord>& record) {
  Json out = Json::parse(archetype_json(a, file_bytes));
  out["tets"] = a.tets.tets.size();
  out["order"] = a.tets.order();
  out["nodes"] = a.tets.nodes.size();
  const SolidFigures solid = solid_of_surface(a);
  out["surface"] = {{"volume", solid.mass / a.density},
                    {"mass", solid.mass},
                    {"center", list(a.centre + solid.centre)},
                    {"inertia", rows(solid.inertia)}};
  if (record && record->surface_volume > 0)
    out["input_surface"] = {{"volume", record->surface_volume},
                            {"mass", a.density * record->surface_volume},
                            {"center", list(record->surface_centroid)},
                            {"inertia", rows(a.density * record->surface_inertia)}};
  const Orthogonality o = orthogonality(a);
  out["orthogonality"] = {
      {"modes", o.mass}, {"translations", o.translation}, {"rotations", o.rotation}};
  if (record) {
    out["build"] = {{"seconds", object(record->seconds)},
                    {"peak_memory_bytes", object(record->memory)},
                    {"notes", record->notes}};
  }
  return json_text(out);
}

double longest_side(const Archetype& a) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : a.surface.vertices) box.extend(x);
  return box.sizes().maxCoeff();
}

}  // namespace archetide
