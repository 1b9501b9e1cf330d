#pragma once

#include <string>

#include "runtime/fluid/fluid_state.h"
#include "runtime/output/surface_mesh.h"

namespace archetide {

/// VTK XML PolyData with raw appended data (header_type UInt64): points, triangles, point normals,
/// `body` on points and cells and `rest` on points (when the mesh has them), TimeValue. Atomic;
/// throws MachineError.
void write_vtp(const std::string& path, const SurfaceMesh& mesh, double time);

/// Reads what write_vtp wrote. Throws FileError.
SurfaceMesh read_vtp(const std::string& path);

/// The marker particles as vertices with radius and sign.
void write_particles_vtp(const std::string& path, const Particles& particles, double time);

/// Passive markers as vertices with their velocity; they keep their order from frame to frame.
void write_markers_vtp(const std::string& path, const std::vector<Vec3>& position,
                       const std::vector<Vec3>& velocity, double time);

/// Drops as vertices with their velocity and radius.
void write_spray_vtp(const std::string& path, const Spray& spray, double time);

/// A ParaView collection file, one entry a frame, rewritten whole at each frame.
class PvdIndex {
 public:
  explicit PvdIndex(std::string path) : path_(std::move(path)) {}
  void add(double time, const std::string& file_name);
  /// Takes over the entries of the file that is there, of frames below `frames`.
  void resume(int frames);

 private:
  std::string path_, entries_;
};

}  // namespace archetide
