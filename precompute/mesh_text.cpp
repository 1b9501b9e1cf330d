#include "precompute/mesh_text.h"

#include <sstream>

#include "precompute/base/joined.h"
#include "precompute/inspect/lines.h"

namespace archetide {

using namespace lines;

std::string mesh_text(const Recipe& recipe, const BodyMesh& body) {
  std::ostringstream text;
  line(text, "body", recipe.name + " from " + recipe.mesh_path);
  if (body.mesher != "input") {
    const IntakeReport& in = body.intake;
    line(text, "surface",
         joined(in.vertices, " vertices, ", in.faces, " faces: closed, manifold, outward"));
    for (const std::string& note : in.notes()) line(text, "", note);
    line(text, "", joined("volume ", in.volume, " m^3, area ", in.area, " m^2"));
    line(text, "", joined("from (", row(in.low), ") to (", row(in.high), ") m"));
  }
  const TetQuality& q = body.quality;
  line(text, "tets", joined(q.tets, " with ", q.nodes, " nodes, by ", body.mesher));
  line(text, "",
       joined("volume ", q.volume, " m^3, ", 100 * q.volume_error, " % off the surface's"));
  line(text, "",
       joined("smallest dihedral ", q.min_dihedral, " degrees, radius ratio ", q.min_radius_ratio));
  line(text, "mass", joined(recipe.material.density * q.volume, " kg"));
  return text.str();
}

}  // namespace archetide
