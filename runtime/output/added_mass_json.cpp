#include "runtime/output/added_mass_json.h"

#include <nlohmann/json.hpp>

#include "common/files/json_text.h"

namespace archetide {
namespace {

using Values = nlohmann::ordered_json;

Values list(const VecX& values) { return std::vector<double>(values.begin(), values.end()); }

}  // namespace

std::string added_mass_json(const ReducedBody& body, const AddedMassTank& tank,
                            const AddedMass& found) {
  const Grid& g = tank.grid;
  Values out;
  out["archetype_hash"] = body.archetype->content_hash;
  out["modes"] = body.r;
  out["density"] = tank.density;
  out["displaced_mass"] = tank.density * body.archetype->volume;
  out["cell"] = g.dx;
  out["cells"] = {g.nx, g.ny, g.nz};
  out["tank"] = list(g.high() - g.low());
  out["position"] = list(body.position);
  out["rotation"] = {body.rotation.w(), body.rotation.x(), body.rotation.y(), body.rotation.z()};
  out["sides"] = tank.walls ? "walls" : "open";
  out["level"] = std::isfinite(tank.level) ? Values(tank.level) : Values();
  Values rows = Values::array();
  for (Eigen::Index i = 0; i < found.matrix.rows(); ++i) rows.push_back(list(found.matrix.row(i)));
  out["matrix"] = rows;
  out["asymmetry"] = found.asymmetry;
  out["iterations"] = found.iterations;
  out["tolerance"] = tank.tolerance;
  return json_text(out);
}

}  // namespace archetide
