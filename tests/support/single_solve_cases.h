#pragma once

#include "tests/support/coupled_tank.h"

namespace archetide {

/// One coupled solve with a known answer.

struct AddedMassOfHeave {
  double coefficient = 0.0;  // added mass / mass of the displaced water
  int iterations = 0;
};

/// Of the body set moving along +z at `position` in the tank's still water, m v* = (m + m_a) v, at
/// this ratio of its density to the water's. `displaced`: its volume under water, m^3 (0: all).
AddedMassOfHeave added_mass(CoupledTank tank, std::shared_ptr<const Archetype> archetype,
                     const Vec3& position, double density_ratio = 1.0, double displaced = 0.0);

/// Sphere of radius 1 in the middle of a cube of half width 2.
AddedMassOfHeave added_mass_in_cube(int cells_per_radius, Geometry geometry, bool open_top);
/// Sphere of radius 1 whose centre is 1.5 over the floor of a tank of 16 x 16 x 12.
AddedMassOfHeave added_mass_near_wall(int cells_per_radius);
/// Sphere of radius 1 in a concentric shell of radius 2.
AddedMassOfHeave added_mass_in_shell(int cells_per_radius);
/// Circular cylinder of radius 1 across a square of half width 2, so many cells thick, whose ends
/// stand `beyond` cells behind the walls.
AddedMassOfHeave added_mass_of_cylinder(int cells_per_radius, bool open_top, int thickness = 4,
                                 double beyond = 0.5);

/// Low-discrepancy sub-cell offset number n (R3 sequence, [Rob18]), in [-1/2, 1/2).
Vec3 sub_cell_offset(int n);

struct OffsetErrors {
  double rms = 0.0, worst = 0.0, mean = 0.0;  // relative
  int iterations = 0;
};
/// Added mass of a sphere in the middle of a cube of half width 4 a at so many sub-cell positions.
OffsetErrors added_mass_over_offsets(int cells_per_radius, int positions, double density_ratio);

/// Largest over smallest added mass of an aligned cube of half side 4.15 cells over sub-cell
/// positions along the motion, less 1.
double cube_added_mass_spread();

/// Upward force of still water up to `level` on the held body at x, in units of the weight of water
/// that its whole volume displaces. The tank has 20^3 cells of 1 m around the origin.
double buoyancy(const std::shared_ptr<const Archetype>& archetype, const Vec3& x, double level);

enum class TestShape { kSphere, kCube };  // radius 4 cells; half side 4.15 cells, aligned
std::shared_ptr<const Archetype> test_shape(TestShape shape);
/// Submerged share of that shape's volume, its centre at height z over the surface.
double submerged_share(TestShape shape, double z);
OffsetErrors buoyancy_over_offsets(TestShape shape, double level, int positions);

/// Acceleration of a sphere of half the water's density in the middle of an open cube of half width
/// 2 a in the first instant, over g.
double release_acceleration(int cells_per_radius);

/// Water column a x 2 a in a corner in the instant after its gate is gone: what the walls bear.
struct DamBreakStart {
  double wall_force = 0.0;   // horizontal, / (rho g a^2)
  double floor_force = 0.0;  // vertical, / (rho g a^2)
  int iterations = 0;
};
DamBreakStart dam_break_start(int cells);  // cells across a

}  // namespace archetide
