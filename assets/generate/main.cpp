// archetide-assets: writes the surfaces of assets/bodies, or checks that they are what it would
// write.

#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>

#include "assets/generate/shapes.h"
#include "assets/generate/surface_mesher.h"
#include "assets/generate/verify.h"

namespace archetide {
namespace {

constexpr const char* kUsage =
    "archetide-assets DIR           write sphere.obj, torus.obj, starfish.obj, jellyfish.obj, "
    "round_rock.obj and flat_rock.obj to DIR\n"
    "archetide-assets --check DIR   compare the files of DIR with what would be written, byte by "
    "byte\n";

/// Rounded to 1e-7 m, without negative zero, so that the text does not depend on the last bits.
double rounded(double x) { return std::round(x * 1e7) / 1e7 + 0.0; }

std::string obj_text(const TriMesh& mesh, const std::string& comment) {
  std::string text = "# " + comment + "; written by archetide-assets\n";
  char line[128];
  for (const Vec3& x : mesh.vertices) {
    std::snprintf(line, sizeof line, "v %.7g %.7g %.7g\n", rounded(x.x()), rounded(x.y()),
                  rounded(x.z()));
    text += line;
  }
  for (const Vec3i& t : mesh.triangles) {
    std::snprintf(line, sizeof line, "f %d %d %d\n", t[0] + 1, t[1] + 1, t[2] + 1);
    text += line;
  }
  return text;
}

bool write(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) std::cerr << "archetide-assets: cannot write " << path << '\n';
  return bool(file);
}

bool same(const std::string& path, const std::string& text) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream stored;
  stored << file.rdbuf();
  const bool equal = file && stored.str() == text;
  if (!equal)
    std::cerr << "archetide-assets: " << path
              << " differs from what is generated; run archetide-assets on its folder\n";
  return equal;
}

bool make(const Shape& shape, const std::string& folder, bool check) {
  const TriMesh mesh = mesh_surface(shape);
  if (const std::string fault = surface_fault(mesh); !fault.empty()) {
    std::cerr << "archetide-assets: " << shape.name << ": " << fault << '\n';
    return false;
  }
  std::printf("%-10s %6zu vertices %6zu triangles, volume %.7g m^3, smallest angle %.1f degrees\n",
              shape.name.c_str(), mesh.vertices.size(), mesh.triangles.size(),
              enclosed_volume(mesh), smallest_angle(mesh));
  const std::string path = folder + "/" + shape.name + ".obj";
  const std::string text = obj_text(mesh, shape.comment);
  return check ? same(path, text) : write(path, text);
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  const bool check = argc == 3 && std::string(argv[1]) == "--check";
  if (argc != (check ? 3 : 2) || argv[argc - 1][0] == '-') {
    std::cerr << archetide::kUsage;
    return 2;
  }
  bool good = true;
  for (const archetide::Shape& shape : archetide::all_shapes())
    good = archetide::make(shape, argv[argc - 1], check) && good;
  return good ? 0 : 1;
}
