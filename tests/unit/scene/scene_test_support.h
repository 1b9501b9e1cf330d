#pragma once

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "common/archetype/archetype.h"
#include "common/base/input_error.h"

namespace archetide {

/// A folder of its own that goes away with the test.
class ScratchFolder {
 public:
  ScratchFolder() {
    static int count = 0;
    path_ = fmt::format("{}scene_{}_{}", testing::TempDir(), ::getpid(), count++);
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  const std::string& path() const { return path_; }
  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories(std::filesystem::path(*this / name).parent_path());
    std::ofstream(*this / name) << text;
  }

 private:
  std::string path_;
};

/// One tetrahedron of 400 kg/m^3 about its centre of mass with two modes that carry no momentum.
inline Archetype tetrahedron_archetype(const std::string& name) {
  Archetype a;
  a.name = name;
  a.density = 400, a.young = 5e4, a.poisson = 0.4;
  a.tets.nodes = {
      {-0.25, -0.25, -0.25}, {0.75, -0.25, -0.25}, {-0.25, 0.75, -0.25}, {-0.25, -0.25, 0.75}};
  a.tets.tets = {{0, 1, 2, 3}};
  a.surface = boundary_surface(a.tets, a.surface_to_node);
  vertex_normals_and_areas(a.surface, a.surface_normals, a.surface_areas);
  a.volume = tet_volume(a.tets, 0);
  a.sdf.spacing = 1.0;
  a.omega2 = Eigen::Vector2d(100, 200);
  a.is_static = {0, 0};
  a.residuals = VecX::Zero(2);
  a.surface_modes = MatX::Constant(12, 2, 0.01);
  a.node_modes = MatX::Constant(12, 2, 0.01);
  a.M_r = MatX::Identity(2, 2);
  a.K_r = a.omega2.asDiagonal();
  a.integrals.mass = a.density * a.volume;
  a.integrals.Sxx = a.density * enclosed_second_moment(a.surface);
  a.integrals.I3.assign(2, Vec3::Zero());
  a.integrals.A.assign(2, Mat3::Zero());
  a.integrals.B.assign(4, Mat3::Zero());
  a.integrals.B[0] = a.integrals.B[3] = Mat3::Identity() / 3.0;
  return a;
}

/// The message of the error that an action must throw, "" when it throws none of that kind.
template <class ErrorType, class Action>
std::string message_of(const Action& action) {
  try {
    action();
  } catch (const ErrorType& error) {
    return error.what();
  }
  return "";
}

inline void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' is not in:\n" << text;
}

}  // namespace archetide
