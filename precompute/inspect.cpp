#include "precompute/inspect.h"

#include <cmath>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <vector>

namespace archetide {
namespace {

std::vector<double> frequencies(const Archetype& a) {
  std::vector<double> hz;
  for (const double w2 : a.omega2) hz.push_back(std::sqrt(w2) / (2 * std::numbers::pi));
  return hz;
}

/// About the centre of mass, kg m^2: I = tr(S) 1 - S.
Mat3 inertia(const Archetype& a) {
  return a.integrals.Sxx.trace() * Mat3::Identity() - a.integrals.Sxx;
}

std::vector<double> list(const Vec3& x) { return {x[0], x[1], x[2]}; }

void line(std::ostringstream& text, const std::string& name, const std::string& value) {
  text << std::left << std::setw(14) << name << ' ' << value << '\n';
}

template <class... Parts>
std::string join(const Parts&... parts) {
  std::ostringstream text;
  text << std::setprecision(6);
  (text << ... << parts);
  return text.str();
}

std::string row(const Vec3& x) { return join(x[0], "  ", x[1], "  ", x[2]); }

}  // namespace

std::string info_text(const Archetype& a, std::size_t file_bytes) {
  std::ostringstream text;
  line(text, "name", a.name);
  line(text, "made by",
       join(a.generator, " from ", a.mesh_file, ", mesher ", a.mesher, ", ", a.mass_kind, " mass, ",
            a.blas));
  line(text, "material",
       join(a.density, " kg/m^3, Young ", a.young, " Pa, Poisson ", a.poisson, ", damping ",
            a.alpha, " 1/s, ", a.beta, " s"));
  line(text, "tets",
       join(a.tets.tets.size(), a.tets.order() == 2 ? " quadratic, with " : " linear, with ",
            a.tets.nodes.size(), " nodes; surface of ", a.surface.vertices.size(), " vertices"));
  line(text, "quality",
       join("smallest dihedral ", a.min_dihedral, " degrees, radius ratio ", a.min_radius_ratio));
  line(text, "volume", join(a.volume, " m^3"));
  line(text, "mass", join(a.integrals.mass, " kg"));
  line(text, "center", row(a.centre) + " m in the mesh's coordinates");
  for (int i = 0; i < 3; ++i) {
    line(text, i == 0 ? "inertia" : "", row(inertia(a).row(i)) + (i == 0 ? " kg m^2" : ""));
  }
  line(text, "modes", std::to_string(a.r()));
  for (int k = 0; k < a.r(); ++k) {
    line(text, "", join(k + 1, ": ", frequencies(a)[k], " Hz, residual ", a.residuals[k]));
  }
  line(text, "distance grid",
       join(a.sdf.nodes[0], " x ", a.sdf.nodes[1], " x ", a.sdf.nodes[2], " nodes, spacing ",
            a.sdf.spacing, " m"));
  line(text, "hash", a.content_hash);
  line(text, "bytes", std::to_string(file_bytes));
  return text.str();
}

std::string info_json(const Archetype& a, std::size_t file_bytes) {
  nlohmann::ordered_json out;
  out["name"] = a.name;
  out["generator"] = a.generator;
  out["mesh"] = {{"file", a.mesh_file}, {"sha256", a.mesh_hash}};
  out["mesher"] = a.mesher;
  out["mass_kind"] = a.mass_kind;
  out["blas"] = a.blas;
  out["material"] = {{"density", a.density}, {"young", a.young}, {"poisson", a.poisson}};
  out["damping"] = {{"alpha", a.alpha}, {"beta", a.beta}};
  out["tets"] = a.tets.tets.size();
  out["order"] = a.tets.order();
  out["nodes"] = a.tets.nodes.size();
  out["surface_vertices"] = a.surface.vertices.size();
  out["volume"] = a.volume;
  out["mass"] = a.integrals.mass;
  out["center"] = list(a.centre);
  out["inertia"] = {list(inertia(a).row(0)), list(inertia(a).row(1)), list(inertia(a).row(2))};
  out["frequencies_hz"] = frequencies(a);
  out["is_static"] = a.is_static;
  out["frequency_error"] = std::vector<double>(a.frequency_error.begin(), a.frequency_error.end());
  out["residuals"] = std::vector<double>(a.residuals.begin(), a.residuals.end());
  out["quality"] = {{"min_dihedral_deg", a.min_dihedral}, {"min_radius_ratio", a.min_radius_ratio}};
  out["hash"] = a.content_hash;
  out["bytes"] = file_bytes;
  return out.dump(2) + "\n";
}

double longest_side(const Archetype& a) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : a.surface.vertices) box.extend(x);
  return box.sizes().maxCoeff();
}

std::string mesh_text(const Recipe& recipe, const BodyMesh& body) {
  std::ostringstream text;
  line(text, "body", recipe.name + " from " + recipe.mesh_path);
  if (body.mesher != "input") {
    const IntakeReport& in = body.intake;
    line(text, "surface",
         join(in.vertices, " vertices, ", in.faces, " faces: closed, manifold, outward"));
    for (const std::string& note : in.notes()) line(text, "", note);
    line(text, "", join("volume ", in.volume, " m^3, area ", in.area, " m^2"));
    line(text, "", join("from (", row(in.low), ") to (", row(in.high), ") m"));
  }
  const TetQuality& q = body.quality;
  line(text, "tets", join(q.tets, " with ", q.nodes, " nodes, by ", body.mesher));
  line(text, "", join("volume ", q.volume, " m^3, ", 100 * q.volume_error, " % off the surface's"));
  line(text, "",
       join("smallest dihedral ", q.min_dihedral, " degrees, radius ratio ", q.min_radius_ratio));
  line(text, "mass", join(recipe.material.density * q.volume, " kg"));
  return text.str();
}

}  // namespace archetide
