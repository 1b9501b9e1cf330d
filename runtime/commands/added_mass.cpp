// Computes what the water around a body adds to its mass.

#include "runtime/added_mass.h"

#include <CLI/CLI.hpp>
#include <iostream>

#include "runtime/commands/command.h"
#include "runtime/output/added_mass_json.h"
#include "runtime/scene/archetype_library.h"
#include "runtime/scene/scene_builder.h"

namespace archetide {
namespace {

Vec3 vector_of(const std::vector<double>& v) {
  return v.empty() ? Vec3::Zero() : Vec3(v[0], v[1], v[2]);
}

// A rotation vector in degrees.
Quat turn_of(const std::vector<double>& degrees) {
  const Vec3 v = vector_of(degrees) * (M_PI / 180.0);
  const double angle = v.norm();
  return angle > 0.0 ? Quat(Eigen::AngleAxisd(angle, v / angle)) : Quat::Identity();
}

int added_mass(const Arguments& a) {
  ArchetypeLibrary library = ArchetypeLibrary::looking_in({"out/archetypes"}, a.archetypes);
  BodySpec spec;
  spec.where.file = library.path(a.body);
  spec.archetype = a.body;
  spec.modes = a.modes;
  spec.rotation = turn_of(a.rotation);
  ReducedBody body =
      instantiate(spec, library.load(a.body, a.modes == 0 ? Part::kRuntime : Part::kAll));
  std::vector<Vec3> points;
  surface_points(body, points);
  Eigen::AlignedBox3d box;
  for (const Vec3& x : points) box.extend(x);
  constexpr double kAround = 1.5;  // widths of the body, water on every side
  const Vec3 size = a.tank.empty()
                        ? Vec3(box.sizes().array() + 2.0 * kAround * box.sizes().maxCoeff())
                        : vector_of(a.tank);
  body.position = a.position.empty() ? Vec3(-box.center()) : vector_of(a.position);
  AddedMassTank tank;
  tank.grid = added_mass_grid(a.cell, size);
  tank.walls = a.walls;
  tank.level = a.level.value_or(INFINITY);
  tank.density = a.density;
  std::cout << added_mass_json(body, tank, added_mass(body, tank));
  return kExitDone;
}

}  // namespace

SimCommand added_mass_command() {
  return {
      "added-mass",
      "the added mass of a body in still water, a (6 + modes)^2 matrix as JSON",
      {"added-mass torus --cell 0.1",
       "added-mass out/archetypes/torus.h5 --cell 0.1 --modes 0 "
       "--tank 6 6 4 --position 0 0 -1 --level 0.5"},
      added_mass,
      [](CLI::App& app, Arguments& a) {
        app.add_option("body", a.body, "archetype: NAME, or its file NAME.h5")
            ->required()
            ->type_name("BODY");
        archetypes_option(app, a);
        app.add_option("--cell", a.cell, "edge of a cell, m")
            ->required()
            ->check(positive_number())
            ->type_name("H");
        app.add_option("--modes", a.modes, "the first N modes; 0: rigid (default: all)")
            ->type_name("N")
            ->check(CLI::NonNegativeNumber);
        app.add_option("--tank", a.tank,
                       "size of the tank, m; its middle is the origin (default: 1.5 widths of the "
                       "body around it)")
            ->expected(3)
            ->check(positive_number())
            ->type_name("X Y Z");
        app.add_option("--position", a.position,
                       "of the centre of mass, m (default: the body in the middle)")
            ->expected(3)
            ->check(any_number())
            ->type_name("X Y Z");
        app.add_option("--rotation", a.rotation, "axis times angle, degrees")
            ->expected(3)
            ->check(any_number())
            ->type_name("X Y Z");
        app.add_flag("--walls", a.walls, "closed sides (default: open, without pressure)");
        app.add_option("--level", a.level, "height of the water's surface, m (default: full)")
            ->check(any_number())
            ->type_name("Z");
        app.add_option("--density", a.density, "of the water, kg/m^3")
            ->check(positive_number())
            ->type_name("RHO")
            ->capture_default_str();
      },
      "The velocities of the matrix are those of the centre of mass, the spin and the modes, in "
      "the "
      "world frame; units kg, m. Surfaces and open sides carry no pressure: the result is that of "
      "an impulse, or of fast oscillations.\n\n"};
}

}  // namespace archetide
