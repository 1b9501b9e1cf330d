#include "precompute/mesh_text.h"

#include <sstream>

#include "precompute/inspect/lines.h"

namespace archetide {

using namespace lines;

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
