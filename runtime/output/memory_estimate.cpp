#include <set>

#include "common/base/number_text.h"
#include "runtime/output/run_writer.h"
#include "runtime/solid/nodal_space.h"

namespace archetide {
namespace {

// Bytes per cell of the arrays that live through a step (velocities and their copies, phi,
// fractions, CG vectors, multigrid levels), from peak memory at 64^3 to 192^3: measured 410 of still
// water, 455 to 475 of splashes up to the lid.
constexpr double kBytesPerCell = 460.0;
// The process without fields, from the same runs.
constexpr double kBytesOfProcess = 27e6;
// A marker particle with its sorted and reseeded copies, from peak memory at 48^3 with 1 and 16 per
// cell: measured 151.
constexpr double kBytesPerParticle = 150.0;
// Particles live within three cells on both sides of the surface, which is about one layer of the
// tank.
constexpr double kParticleBand = 6.0;

// Factors that a nonlinear body of nodes has at once, those of its stages, with what it takes to
// make one: from peak memory of three blocks of 4k quadratic tets, 310 MB each of factors of 88 MB.
constexpr double kOwnFactors = 3.5;
// In contact bodies of nodes have dense matrices of the rows of all points that may touch, and
// answers of all nodes to those that press: from peak memory of three rings of 5k linear tets that
// hit each other, up to 1650 rows each: measured 114 MB a ring.
constexpr double kContactRows = 1500.0, kMatricesOfRows = 5.0;
constexpr double kHeldRows = 300.0, kCopiesOfAnswers = 3.0;

double bytes_of(const MatX& m) { return 8.0 * static_cast<double>(m.size()); }

}  // namespace

double archetype_bytes(const Archetype& a) {
  const double per_vertex = sizeof(Vec3) * 2.0 + sizeof(double) + sizeof(int);
  return per_vertex * static_cast<double>(a.surface.vertices.size()) +
         sizeof(Vec3i) * static_cast<double>(a.surface.triangles.size()) +
         sizeof(float) * static_cast<double>(a.sdf.values.size()) + bytes_of(a.surface_modes) +
         bytes_of(a.node_modes) + sizeof(Vec3) * static_cast<double>(a.tets.nodes.size()) +
         4.0 * sizeof(int) * static_cast<double>(a.tets.tets.size()) +
         6.0 * sizeof(int) * static_cast<double>(a.tets.mids.size()) + bytes_of(a.M_r) +
         bytes_of(a.K_r) + bytes_of(a.elastic.gradients) +
         sizeof(Mat3) * static_cast<double>(a.integrals.A.size() + a.integrals.B.size());
}

MemoryEstimate estimate_memory(const SimulationOptions& options, const Grid& g,
                               const std::vector<ReducedBody>& bodies) {
  MemoryEstimate m;
  if (options.has_water) {
    const double surface_cells = static_cast<double>(g.nx) * g.ny;
    m.water = kBytesOfProcess + kBytesPerCell * static_cast<double>(g.cells()) +
              kBytesPerParticle * kParticleBand * surface_cells * options.particles_per_cell;
  }
  std::set<const Archetype*> seen;
  std::set<const NodalSpace*> spaces;
  for (const ReducedBody& body : bodies) {
    m.bodies += static_cast<double>(instance_bytes(body));
    if (body.nodes && body.is_nonlinear())
      m.bodies += kOwnFactors * static_cast<double>(body.nodes->factor_bytes());
    if (body.nodes && options.body_contact && bodies.size() > 1)
      m.bodies += sizeof(double) * (kMatricesOfRows * kContactRows * kContactRows +
                                    kCopiesOfAnswers * kHeldRows * body.dofs());
    if (seen.insert(body.archetype.get()).second) m.archetypes += archetype_bytes(*body.archetype);
    if (body.nodes && spaces.insert(body.nodes.get()).second)
      m.archetypes += static_cast<double>(body.nodes->bytes());
  }
  return m;
}

std::string memory_at_the_lid(const SimulationOptions& options, const Grid& fields,
                              const std::vector<ReducedBody>& bodies) {
  if (!options.has_water || options.grid.nz <= fields.nz) return "";
  return ", " + bytes_text(estimate_memory(options, options.grid, bodies).total()) +
         " once a splash reaches the lid";
}

}  // namespace archetide
