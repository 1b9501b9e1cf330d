#include <fmt/core.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <sstream>

#include "common/base/input_error.h"
#include "common/files/atomic_file.h"
#include "precompute/inspect/inspect.h"

namespace archetide {
namespace {

/// Collects arrays for the appended section of a VTK XML file: each is its length in bytes
/// (UInt64), then the bytes.
class Appended {
 public:
  /// The DataArray element that refers to the array.
  template <class T>
  std::string add(const std::string& type, const std::string& name, int components, const T* data,
                  std::size_t count) {
    std::ostringstream tag;
    tag << "<DataArray type=\"" << type << "\" Name=\"" << name << "\" NumberOfComponents=\""
        << components << "\" format=\"appended\" offset=\"" << bytes_.size() << "\"/>\n";
    const std::uint64_t length = count * sizeof(T);
    bytes_.append(reinterpret_cast<const char*>(&length), sizeof length);
    bytes_.append(reinterpret_cast<const char*>(data), length);
    return tag.str();
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

std::string cells(const Archetype& a, Appended& data) {
  constexpr std::uint8_t kVtkTetra = 10, kVtkQuadraticTetra = 24;
  const std::size_t nt = a.tets.tets.size();
  std::vector<std::int64_t> corners, ends;
  for (std::size_t t = 0; t < nt; ++t) {
    corners.insert(corners.end(), a.tets.tets[t].begin(), a.tets.tets[t].end());
    if (a.tets.order() == 2)
      corners.insert(corners.end(), a.tets.mids[t].begin(), a.tets.mids[t].end());
    ends.push_back(static_cast<std::int64_t>(corners.size()));
  }
  const std::vector<std::uint8_t> types(nt, a.tets.order() == 2 ? kVtkQuadraticTetra : kVtkTetra);
  return "<Cells>\n" + data.add("Int64", "connectivity", 1, corners.data(), corners.size()) +
         data.add("Int64", "offsets", 1, ends.data(), nt) +
         data.add("UInt8", "types", 1, types.data(), nt) + "</Cells>\n";
}

std::string vectors(const std::string& name, const VecX& field, Appended& data) {
  return data.add("Float64", name, 3, field.data(), static_cast<std::size_t>(field.size()));
}

/// Displacement of all nodes (3n, m) by a mode, the farthest by `amplitude`.
VecX displacement(const Archetype& a, int mode, double amplitude) {
  const VecX phi = a.node_modes.col(mode - 1);
  const double farthest = phi.reshaped(3, phi.size() / 3).colwise().norm().maxCoeff();
  return amplitude / farthest * phi;
}

void demand_mode(const Archetype& a, int mode) {
  if (mode >= 0 && mode <= a.r()) return;
  throw InputError(
      fmt::format("--mode {}: this archetype has {} modes", mode, a.r()),
      "count modes from 1; leave --mode out for the rest shape with all modes as fields");
}

}  // namespace

void write_vtu(const std::string& path, const Archetype& a, int mode, double amplitude) {
  demand_mode(a, mode);
  const std::size_t n = a.tets.nodes.size();
  VecX x(3 * static_cast<Eigen::Index>(n));  // positions, 3n, m
  for (std::size_t i = 0; i < n; ++i)
    x.segment<3>(3 * static_cast<Eigen::Index>(i)) = a.tets.nodes[i];

  Appended data;
  std::string fields;
  if (mode == 0) {
    for (int k = 0; k < a.r(); ++k) {
      fields += vectors(fmt::format("mode_{}", k + 1), a.node_modes.col(k), data);
    }
  } else {
    const VecX u = displacement(a, mode, amplitude);
    fields = vectors("displacement", u, data);
    x += u;
  }
  std::ostringstream text;
  text << "<?xml version=\"1.0\"?>\n"
          "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" "
          "header_type=\"UInt64\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\""
       << n << "\" NumberOfCells=\"" << a.tets.tets.size() << "\">\n<PointData>\n"
       << fields << "</PointData>\n<Points>\n"
       << vectors("points", x, data) << "</Points>\n"
       << cells(a, data) << "</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_"
       << data.bytes() << "\n</AppendedData>\n</VTKFile>\n";
  write_file_atomically(path, text.str());
}

}  // namespace archetide
