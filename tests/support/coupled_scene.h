#pragma once

#include <memory>
#include <vector>

#include "runtime/coupling/coupled_solve.h"
#include "runtime/coupling/coupling.h"

namespace archetide {

/// A tank one metre high with wavy water and equal synthetic bodies in it, half of them afloat.
struct CoupledSceneOptions {
  Vec3i cells = Vec3i(64, 64, 64);
  double fill = 0.4;  // mean height of the water / height of the tank
  int bodies = 0;
  int modes = 0;               // 0: rigid spheres, else soft blobs
  double density_ratio = 0.5;  // body / water
  double first_omega = 10.0;   // rad/s, of the softest mode
  Geometry geometry = Geometry::kCutCell;
  double dt = 0.01;  // s
};

/// One coupled system ready to be solved: fractions, F, H^-1, y* (weight and hydrostatic force from
/// rest) and u* of that scene, all of them by the functions that the simulation uses.
struct CoupledScene {
  explicit CoupledScene(const CoupledSceneOptions& options);

  Grid grid;
  double dt = 0.0;         // s
  double radius = 0.0;     // of a body, m
  Array3<double> phi;      // the surface, m
  FaceField<double> open;  // w
  PressureSystem system;
  std::vector<CoupledBody> bodies;
  MacField u_star;
  FaceField<unsigned char> valid;
  std::vector<ReducedBody> reduced;

  /// Solves from rest and from zero pressure; the scene itself stays as it is.
  struct Result {
    SolveReport report;
    std::vector<CoupledBody> bodies;
    MacField u;
    Array3<double> pressure;
  };
  Result solve(CoupledSolver& solver, const CoupledSolveOptions& options,
               const ConstrainedInverse* rows = nullptr) const;

 private:
  void place_bodies(const CoupledSceneOptions& options);
};

}  // namespace archetide
