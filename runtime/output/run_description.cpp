#include "runtime/output/run_description.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdio>
#include <set>

#include "common/base/number_text.h"
#include "common/base/sha256.h"
#include "runtime/cut_cells/resolution.h"

namespace archetide {
namespace {

std::string grid_line(const SimulationOptions& o) {
  const Grid& g = o.grid;
  if (g.cells() == 0) return "tank       none";
  return fmt::format("tank       {} x {} x {} = {} cells of {} m{}", g.nx, g.ny, g.nz, g.cells(),
                     number_text(g.dx), o.has_water ? "" : ", no water");
}

std::string bodies_line(const Manifest& m) {
  if (m.bodies.empty()) return "bodies     none";
  double bytes = 0.0, largest = 0.0;
  for (const auto& b : m.bodies) bytes += b.bytes, largest = std::max(largest, b.bytes);
  return fmt::format("bodies     {} of {} archetypes; instances hold {} (at most {} each)",
                     m.bodies.size(), m.archetypes.size(), bytes_text(bytes), bytes_text(largest));
}

std::string switches_line(const SimulationOptions& o) {
  std::string on = o.scheme == Scheme::kNewmark ? "two solves a step" : "one solve a step";
  on += o.modal.step == ModalStep::kTrapezoid ? ", trapezoid" : ", backward Euler";
  on += o.modal.mass == ModalMass::kExact ? ", exact modal mass" : ", the paper's modal mass";
  if (o.has_water) {
    on += o.geometry == Geometry::kCutCell ? ", cut cells" : ", voxel faces";
    on += ", tolerance " + scientific_text(o.tolerance);
    if (o.particles_per_cell > 0) on += fmt::format(", {} particles a cell", o.particles_per_cell);
    if (o.spray) on += ", spray";
    if (o.damping.any()) on += ", " + damping_text(o.damping);
  }
  if (o.wall_contact) on += ", wall contact";
  return "on         " + on;
}

// One line for each archetype that is in the water and that its cells hardly see.
std::vector<std::string> unresolved_lines(const SimulationOptions& o,
                                          const std::vector<ReducedBody>& bodies) {
  std::vector<std::string> lines;
  std::set<const Archetype*> seen;
  for (const ReducedBody& body : bodies) {
    if (!o.has_water || !seen.insert(body.archetype.get()).second) continue;
    std::vector<Vec3> points;
    surface_points(body, points);
    const double thin = thin_part(o.grid, points, body.archetype->surface.triangles);
    if (thin > kTooThin)
      lines.push_back(
          fmt::format("note       unresolved: {} is thinner than a cell over {} % of its surface; "
                      "what the water does to it is a guess",
                      body.archetype->name, static_cast<int>(100.0 * thin)));
  }
  return lines;
}

std::string phase_line(const std::string& phase, double seconds, double wall_seconds) {
  const auto depth = std::count(phase.begin(), phase.end(), '/');
  char text[160];
  std::snprintf(text, sizeof text, "  %*s%-28s %9.2f s %5.1f %%", static_cast<int>(2 * depth), "",
                phase.c_str(), seconds, 100.0 * seconds / std::max(1e-9, wall_seconds));
  return text;
}

}  // namespace

Manifest describe_run(const RunSetup& setup, const Simulation& simulation) {
  Manifest m;
  m.version = ARCHETIDE_VERSION;
  m.build = build_description();
  m.scene = setup.scene_name;
  m.scene_hash = sha256_hex(setup.scene_text);
  m.command_line = setup.command_line;
  m.threads = setup.threads;
  m.grid = simulation.options().grid;
  m.has_water = simulation.options().has_water;
  m.fps = setup.fps, m.end_time = setup.end_time;
  m.started = utc_now();
  const auto bodies = simulation.all_bodies();
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const Archetype& a = *bodies[b].archetype;
    const bool known = std::any_of(m.archetypes.begin(), m.archetypes.end(), [&](const auto& e) {
      return e.name == a.name && e.hash == a.content_hash;
    });
    if (!known)
      m.archetypes.push_back({a.name, a.content_hash, static_cast<int>(a.surface.vertices.size()),
                              a.r(), archetype_bytes(a)});
    m.bodies.push_back({b < setup.body_names.size() ? setup.body_names[b] : a.name, a.name,
                        a.integrals.mass * bodies[b].mass_scale, a.density * bodies[b].mass_scale,
                        reduced_dofs(bodies[b]) - 6,
                        static_cast<double>(instance_bytes(bodies[b]))});
  }
  return m;
}

std::string damping_text(const Damping& damping) {
  if (!damping.any()) return "none";
  const std::string drag = damping.drag > 0.0 ? "drag " + number_text(damping.drag) + " 1/s" : "";
  if (!damping.beaches()) return drag;
  return (drag.empty() ? drag : drag + ", ") + "beaches";
}

std::vector<std::string> coarser_surfaces(const std::vector<ReducedBody>& bodies,
                                          const std::vector<SkinnedBodies>& skins) {
  std::vector<std::string> texts;
  std::set<const void*> seen;
  const auto add = [&](const void* key, const std::string& name, const TriMesh& coarse,
                       const TriMesh& whole) {
    if (seen.insert(key).second)
      texts.push_back(
          fmt::format("{} {} of {}", name, coarse.triangles.size(), whole.triangles.size()));
  };
  for (const ReducedBody& b : bodies)
    if (b.rung) add(b.rung, b.archetype->name, b.rung->surface, b.archetype->surface);
  for (const SkinnedBodies& s : skins)
    if (s.rung)
      add(s.rung.get(), s.shape->skin->name, s.rung->skin->surface, s.shape->skin->surface);
  return texts;
}

std::vector<std::string> header_lines(const RunSetup& setup, const Manifest& manifest,
                                      const Simulation& simulation) {
  const SimulationOptions& o = simulation.options();
  const MemoryEstimate memory = estimate_memory(o, simulation.grid(), simulation.all_bodies());
  std::vector<std::string> lines = {
      fmt::format("archetide {} ({}, {} threads)", manifest.version, manifest.build, setup.threads),
      "scene      " + setup.scene_name + ", " + number_text(setup.end_time) + " s at " +
          number_text(setup.fps) + " frames a second",
      grid_line(o),
      bodies_line(manifest),
      switches_line(o),
      "memory     about " + bytes_text(memory.total()) + " (water " + bytes_text(memory.water) +
          ", archetypes " + bytes_text(memory.archetypes) + ")" +
          memory_at_the_lid(o, simulation.grid(), simulation.all_bodies())};
  for (const std::string& text : coarser_surfaces(simulation.all_bodies(), simulation.skins()))
    lines.push_back("surface    the water meets of " + text + " triangles");
  for (const std::string& note : setup.notes) lines.push_back("note       " + note);
  for (std::string& line : unresolved_lines(o, simulation.all_bodies()))
    lines.push_back(std::move(line));
  return lines;
}

namespace {

// What a step was halved for, as the log and docs/files.md call it.
const char* reason_text(Refusal why) {
  switch (why) {
    case Refusal::kNotConverged:
      return "solve not converged";
    case Refusal::kNotLinear:
      return "nonlinear forces";
    case Refusal::kJointOpen:
      return "open joint";
    case Refusal::kJointWork:
      return "work of joints";
    case Refusal::kSank:
      return "overlap";
    case Refusal::kThrown:
      return "energy of bodies";
    case Refusal::kNotFinite:
      return "not finite";
    case Refusal::kNone:
      break;
  }
  return "unknown";
}

}  // namespace

std::vector<std::string> summary_lines(const Manifest& m, const Profile& profile,
                                       const std::map<Refusal, int>& refused) {
  std::vector<std::string> lines = {
      fmt::format("ended at t {} s after {} ({} CPU), {} steps, {} frames, peak memory {}",
                  number_text(m.time), duration_text(m.wall_seconds), duration_text(m.cpu_seconds),
                  m.steps, m.frames, bytes_text(m.peak_bytes))};
  for (const std::string& phase : profile.phases())
    lines.push_back(phase_line(phase, m.phase_seconds.at(phase), m.wall_seconds));
  lines.push_back(fmt::format("worst volume drift {}, step halvings {}, worst iteration count {}",
                              scientific_text(m.worst_volume_drift), m.halvings,
                              m.worst_iterations));
  std::string reasons;
  for (const auto& [why, times] : refused)
    reasons += fmt::format("{}{} {}", reasons.empty() ? "" : ", ", reason_text(why), times);
  if (!reasons.empty()) lines.push_back("halved for: " + reasons);
  return lines;
}

}  // namespace archetide
