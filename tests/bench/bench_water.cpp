// Water alone against known answers: error beside CPU seconds.
//   bench_water [vortex] [carried] [slosh] [waves] [drop] [spheroid]      (all of them when none is
//   named)
#include <cmath>
#include <cstdio>
#include <string>

#include "tests/support/cpu_seconds.h"
#include "tests/support/water_cases.h"

namespace archetide {
namespace {

double percent(double value, double exact) { return 100.0 * (value / exact - 1.0); }

void vortex() {
  std::printf(
      "Taylor-Green cells, one turnover\n"
      "scheme   cells  CFL  steps  energy change %%  L2 velocity error    CPU s\n");
  for (const Scheme scheme : {Scheme::kNewmark, Scheme::kSingle})
    for (const double cfl : {1.0, 4.0})
      for (const int n : {32, 64, 128}) {
        const double t0 = cpu_seconds();
        const VortexResult r = taylor_green(n, cfl, scheme);
        std::printf("%-7s %4d^2 %4.0f %6d %16.3f %18.2e %8.2f\n",
                    scheme == Scheme::kNewmark ? "newmark" : "single", n, cfl, r.steps,
                    100.0 * r.energy_change, r.velocity_error, cpu_seconds() - t0);
      }
}

void carried() {
  std::printf(
      "vortex carried by a stream through open sides\n"
      "scheme   cells  CFL  steps  L2 velocity error  order  energy change %%    CPU s\n");
  for (const Scheme scheme : {Scheme::kNewmark, Scheme::kSingle})
    for (const double cfl : {1.0, 2.0, 4.0}) {
      double before = NAN;
      for (const int n : {40, 80, 160}) {
        const double t0 = cpu_seconds();
        const CarriedVortexResult r = carried_vortex(n, cfl, scheme);
        std::printf("%-7s %4d^2 %4.0f %6d %18.2e %6.2f %16.3f %8.2f\n",
                    scheme == Scheme::kNewmark ? "newmark" : "single", n, cfl, r.steps,
                    r.velocity_error, std::log2(before / r.velocity_error), 100.0 * r.energy_change,
                    cpu_seconds() - t0);
        before = r.velocity_error;
      }
    }
}

void slosh() {
  std::printf(
      "sloshing, L = 1 m, depth 0.5 m, amplitude 0.01 m; exact period 1.181816 s\n"
      "cells  max dt  particles  steps  period error %%  decay a period %%    CPU s\n");
  for (const int n : {32, 64})
    for (const double dt : {0.04, 0.01})
      for (const int particles : {0, 16}) {
        const double t0 = cpu_seconds();
        const SloshResult r = sloshing(n, dt, particles);
        std::printf("%5d %7.3f %10d %6d %15.3f %17.2f %8.2f\n", n, dt, particles, r.steps,
                    percent(r.period, 1.181815523), 100.0 * r.decay, cpu_seconds() - t0);
      }
}

void waves() {
  std::printf(
      "steep waves in a tank of 1 m, 2 s, volume control off\n"
      "cells  amplitude  ball  steps  volume %%    CPU s\n");
  for (const int n : {16, 32})
    for (const double amplitude : {0.05, 0.1})
      for (const bool ball : {false, true}) {
        const double t0 = cpu_seconds();
        const SteepWavesResult r = steep_waves(n, amplitude, ball);
        std::printf("%5d %10.2f %5s %6d %+9.3f %8.2f\n", n, amplitude, ball ? "yes" : "no", r.steps,
                    100.0 * r.volume_change, cpu_seconds() - t0);
      }
}

void print_drop(const char* name, int n, double cfl, int particles, const DropResult& r,
                const double a[2], const double b[2], double seconds) {
  std::printf("%-9s %5d %4.1f %9d %6d   %+7.3f %+7.3f   %+7.3f %+7.3f %9.3f %8.2f\n", name, n, cfl,
              particles, r.steps, percent(r.long_axis[0], a[0]), percent(r.short_axis[0], b[0]),
              percent(r.long_axis[1], a[1]), percent(r.short_axis[1], b[1]),
              100.0 * r.volume_change, seconds);
}

void drop() {
  std::printf(
      "drops without gravity: errors of the semi-axes in %% (exact nonlinear solutions)\n"
      "drop     cells/R  CFL particles  steps   early a       b    late a       b  volume %%"
      "    CPU s\n");
  const double a[2] = {2.27551598, 3.678985324}, b[2] = {0.439460768, 0.271814077};
  for (const int particles : {0, 16})
    for (const int n : {8, 16, 32}) {
      const double t0 = cpu_seconds();
      const DropResult r = elliptic_drop(n, 1.0, particles);
      print_drop("ellipse", n, 1.0, particles, r, a, b, cpu_seconds() - t0);
    }
}

void spheroid() {
  const double c_long[2] = {1.544536246, 2.132540181}, c_equator[2] = {0.8046387577, 0.684780506};
  const double o_axis[2] = {0.5810842281, 0.3423792233}, o_equator[2] = {1.311838752, 1.70901667};
  for (const double sign : {1.0, -1.0})
    for (const int n : {8, 16}) {
      const double t0 = cpu_seconds();
      const DropResult r = spheroid_drop(n, 1.0, 0, sign);
      print_drop(sign > 0 ? "prolate" : "oblate", n, 1.0, 0, r, sign > 0 ? c_long : o_axis,
                 sign > 0 ? c_equator : o_equator, cpu_seconds() - t0);
    }
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  const auto wanted = [&](const std::string& name) {
    for (int n = 1; n < argc; ++n)
      if (name == argv[n]) return true;
    return argc == 1;
  };
  if (wanted("vortex")) archetide::vortex();
  if (wanted("carried")) archetide::carried();
  if (wanted("slosh")) archetide::slosh();
  if (wanted("waves")) archetide::waves();
  if (wanted("drop")) archetide::drop();
  if (wanted("spheroid")) archetide::spheroid();
}
