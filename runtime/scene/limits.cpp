#include "runtime/scene/limits.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "runtime/statistics.h"

namespace archetide {
namespace {

template <class T>
std::string text_of(const T& x) {
  std::ostringstream out;
  out << x;
  return out.str();
}

[[noreturn]] void crossed(const std::string& key, const std::string& what, double value,
                          double limit, const std::string& unit, const std::string& hint,
                          double time, const Culprit& culprit) {
  throw SimulationFailure("limits." + key,
                          what + " " + text_of(value) + unit + ", limits." + key + " is " +
                              text_of(limit) + unit + (hint.empty() ? "" : " (" + hint + ")"),
                          time, culprit);
}

// Mass of water and bodies, kg.
double total_mass(const StepReport& report, const Simulation& simulation) {
  double mass = simulation.options().water_density * report.water_volume;
  for (const ReducedBody& b : simulation.bodies()) mass += body_mass(b);
  return mass;
}

// Of water, drops and bodies, J, with zero at the lowest place of the tank: what leaves through an
// open side then takes energy along, wherever the origin and "down" are.
double potential_in_tank(const StepReport& report, const Simulation& simulation) {
  const SimulationOptions& o = simulation.options();
  if (!o.has_water) return report.potential;
  const Vec3 low = o.grid.origin, high = low + o.grid.dx * Vec3(o.grid.nx, o.grid.ny, o.grid.nz);
  const double deepest = o.gravity.cwiseProduct(low).cwiseMax(o.gravity.cwiseProduct(high)).sum();
  // what sources brought came with its energy at the origin
  const double others = o.water_density * (report.spray_volume - report.source_volume);
  return report.potential + (total_mass(report, simulation) + others) * deepest;
}

// The body with the largest of(body) > 0, or -1; `largest` becomes that.
template <class Of>
int body_with_most(const Simulation& simulation, const Of& of, double& largest) {
  int found = -1;
  const auto& bodies = simulation.bodies();
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const double value = of(bodies[b]);
    if (value > largest) largest = value, found = static_cast<int>(b);
  }
  return found;
}

}  // namespace

Culprit fastest(const Simulation& simulation) {
  Culprit culprit;
  double largest = 0.0;
  culprit.body = body_with_most(simulation, largest_surface_speed, largest);
  const Grid& g = simulation.grid();
  for (int a = 0; a < 3 && simulation.options().has_water; ++a) {
    const Array3<double>& u = simulation.fluid().u[a];
    const auto& valid = simulation.coupling().valid()[a];
    for (int k = 0; k < u.nz(); ++k)
      for (int j = 0; j < u.ny(); ++j)
        for (int i = 0; i < u.nx(); ++i)
          if (valid(i, j, k) && std::abs(u(i, j, k)) > largest) {
            largest = std::abs(u(i, j, k));
            culprit = {-1, -1, Vec3i(i, j, k).cwiseMin(Vec3i(g.nx - 1, g.ny - 1, g.nz - 1))};
          }
  }
  return culprit;
}

Culprit most_deformed(const Simulation& simulation) {
  Culprit culprit;
  double largest = 0.0;
  culprit.body = body_with_most(simulation, deformation, largest);
  if (culprit.body < 0) return culprit;
  const ReducedBody& body = simulation.bodies()[culprit.body];
  largest = 0.0;
  const VecX q = reduced_amplitudes(body);
  for (int i = 0; i < static_cast<int>(q.size()); ++i) {
    const double d = std::abs(q[i]) * body.archetype->surface_modes.col(i).cwiseAbs().maxCoeff();
    if (d > largest) largest = d, culprit.mode = i;
  }
  return culprit;
}

// What kinetic, elastic and potential energy have gained beyond the work of what drives bodies, relative to
// the largest kinetic and elastic energy so far. Bodies that appear bring theirs.
double LimitWatch::energy_growth(const StepReport& r, const Simulation& simulation) {
  constexpr double kIdle = 0.01;  // m/s; motion below is nobody's concern
  const double moving = r.water_kinetic + r.body_kinetic + r.body_elastic;
  const double energy = moving + potential_in_tank(r, simulation) - r.actuation_work;
  const int bodies = static_cast<int>(simulation.bodies().size());
  if (std::isnan(energy_start_)) energy_start_ = energy_before_ = energy;
  if (bodies > bodies_before_ && bodies_before_ > 0) energy_start_ += energy - energy_before_;
  bodies_before_ = bodies;
  energy_before_ = energy;
  energy_scale_ =
      std::max({energy_scale_, moving, 0.5 * total_mass(r, simulation) * kIdle * kIdle, 1e-300});
  return (energy - energy_start_) / energy_scale_;
}

void LimitWatch::observe(const StepReport& r, const Simulation& simulation) {
  const double drift = drift_.observe(r);
  if (spec_.volume_drift && !(std::abs(drift) <= *spec_.volume_drift))
    crossed("volume_drift", "the water's volume drifted by", 100.0 * drift,
            100.0 * *spec_.volume_drift, " %",
            "use a finer grid, a smaller step.cfl or fluid.particles", r.t, {});
  if (spec_.speed && !(r.max_speed <= *spec_.speed))
    crossed("speed", "water or a body moves at", r.max_speed, *spec_.speed, " m/s",
            "use a smaller step.cfl or look at what it meets", r.t, fastest(simulation));
  if (spec_.deformation && !(r.max_deformation <= *spec_.deformation))
    crossed("deformation", "a body deforms by", r.max_deformation, *spec_.deformation,
            " of its size", "stiffer material, weaker forces, or more modes", r.t,
            most_deformed(simulation));
  if (spec_.energy) {
    const double growth = energy_growth(r, simulation);
    if (!(growth <= *spec_.energy))
      crossed("energy", "energy has grown from nothing by", growth, *spec_.energy,
              " of the largest kinetic and elastic energy", "use a smaller step.cfl or step.max",
              r.t, fastest(simulation));
  }
  if (spec_.step && r.halvings > 0 && !(r.dt >= *spec_.step))
    crossed("step", "the step had to be halved to", r.dt, *spec_.step, " s",
            "raise coupling.max_iterations or coupling.tolerance", r.t, fastest(simulation));
  const int iterations = std::max(r.position.iterations, r.velocity.iterations);
  if (spec_.iterations && iterations > *spec_.iterations)
    crossed("iterations", "a coupled solve took", iterations, *spec_.iterations, " iterations", "",
            r.t, {});
}

void LimitWatch::visit_state(StateArchive& a) {
  drift_.visit_state(a, "limits/drift");
  a.field("limits/energy_start", energy_start_);
  a.field("limits/energy_before", energy_before_);
  a.field("limits/energy_scale", energy_scale_);
  a.field("limits/bodies_before", bodies_before_);
}

}  // namespace archetide
