#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/files/surface_io.h"
#include "precompute/intake/repair.h"

namespace archetide {

/// What intake found and changed; lengths in m, after scaling.
struct IntakeReport {
  int vertices = 0, faces = 0;      // of the accepted surface
  int welded = 0;                   // vertices that repeated an earlier one exactly
  int unused = 0;                   // vertices without a face, dropped
  int collapsed = 0;                // triangles with a repeated corner, dropped
  int reoriented = 0;               // triangles turned round to agree with their neighbours
  bool turned_inside_out = false;   // the whole surface faced inward
  int cavities = 0;                 // inner shells, facing into their cavity
  double cavity_volume = 0.0;       // m^3, of all of them
  double volume = 0.0, area = 0.0;  // m^3, m^2; without the cavities
  Vec3 centroid = Vec3::Zero();     // of the solid, m
  Mat3 inertia = Mat3::Zero();      // of the solid about its centroid at density 1, m^5
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // bounding box
  RepairReport repair;
  /// One line for each change, for the log.
  std::vector<std::string> notes() const;
};

/// Turns a surface file into the closed, manifold boundary of one solid, without
/// self-intersections, facing out of the solid, multiplied by `scale`: an outer shell and the
/// shells of its cavities. Only changes that keep the shape are made (and reported); anything else
/// is a SurfaceDefects error that names the defect, how many there are, and the faces and places
/// (file coordinates) of the first ones.
TriMesh accept_surface(const SurfaceFile& file, double scale, IntakeReport& report);

/// The same after the requested repair, in time. Filling and union leave a surface alone
/// that is acceptable as it is; a wrap always wraps. `cpu_seconds`: what it may use, see in_time();
/// a surface that takes longer is refused.
TriMesh accept_surface(const SurfaceFile& file, double scale, const RepairOptions& repair,
                       double& cpu_seconds, IntakeReport& report);

/// The surface that `work` makes and what it reports, from a process of its own that may use
/// `cpu_seconds` (what it uses is taken off; whole seconds are given, at least one). Throws what
/// `work` throws, and OutOfTime with the name of the step.
TriMesh in_time(const std::string& step, double& cpu_seconds, IntakeReport& report,
                const std::function<TriMesh(IntakeReport&)>& work);

/// What to do about a surface that takes too long.
inline constexpr char kOutOfTimeHint[] =
    "make the surface coarser (decimate, remesh) in the modelling program, or allow more with "
    "--time-limit";

constexpr unsigned kMostCrossings = 100'000;  // two crumpled surfaces can have millions

/// How many other triangles have bounding boxes that overlap with a triangle's, for each; `pairs`
/// is their sum. Stops when there are more than `most` pairs: the exact check would take minutes.
struct Crowd {
  std::vector<int> neighbours;  // nf
  long pairs = 0;
  bool too_many = false;
};
Crowd crowd(const TriMesh& mesh, long most);

/// Candidate pairs that are checked, for a mesh of so many faces: tidy meshes have 10 to 20 a face.
constexpr long most_candidates(std::size_t faces) { return 20'000'000 + 50 * long(faces); }

/// Pairs of triangles that intersect other than in a shared edge or vertex, the first
/// kMostCrossings of them. The mesh must be manifold.
std::vector<std::pair<int, int>> self_intersections(const TriMesh& mesh);

}  // namespace archetide
