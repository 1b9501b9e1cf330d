#include "runtime/output/vtp.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <numeric>
#include <sstream>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "common/base/number_text.h"
#include "common/files/atomic_file.h"

namespace archetide {
namespace {

// The XML head and the appended binary block grow side by side.
class VtpText {
 public:
  void open(const std::string& tag) { xml_ += '<' + tag + ">\n"; }
  void close(const std::string& tag) { xml_ += "</" + tag + ">\n"; }

  template <class T>
  void array(const std::string& name, const char* type, int components,
             const std::vector<T>& values) {
    xml_ += fmt::format(
        "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" "
        "format=\"appended\" offset=\"{}\"/>\n",
        type, name, components, data_.size());
    append_number(data_, static_cast<std::uint64_t>(values.size() * sizeof(T)));
    data_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  }

  std::string file(double time) const {
    return "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" "
           "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n<FieldData>\n"
           "<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">" +
           number_text(time) + "</DataArray>\n</FieldData>\n" + xml_ +
           "</PolyData>\n<AppendedData encoding=\"raw\">\n_" + data_ +
           "\n</AppendedData>\n</VTKFile>\n";
  }

 private:
  std::string xml_, data_;
};

std::vector<float> flat(const std::vector<Vec3>& points) {
  std::vector<float> out;
  out.reserve(3 * points.size());
  for (const Vec3& x : points)
    for (int a = 0; a < 3; ++a) out.push_back(static_cast<float>(x[a]));
  return out;
}

std::string piece(std::size_t points, std::size_t vertices, std::size_t polys) {
  return fmt::format(
      "Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
      "NumberOfPolys=\"{}\"",
      points, vertices, polys);
}

std::vector<int> offsets(std::size_t cells, int corners) {
  std::vector<int> out(cells);
  for (std::size_t c = 0; c < cells; ++c) out[c] = corners * static_cast<int>(c + 1);
  return out;
}

// Points, each a vertex, and the end of the piece.
void close_vertices(const std::vector<Vec3>& points, VtpText& text) {
  std::vector<int> index(points.size());
  std::iota(index.begin(), index.end(), 0);
  text.open("Points");
  text.array("Points", "Float32", 3, flat(points));
  text.close("Points");
  text.open("Verts");
  text.array("connectivity", "Int32", 1, index);
  text.array("offsets", "Int32", 1, offsets(points.size(), 1));
  text.close("Verts");
  text.close("Piece");
}

// The raw values of the first array called `name`.
template <class T>
std::vector<T> take_array(const std::string& path, const std::string& bytes,
                          const std::string& name) {
  const std::size_t block = bytes.find("<AppendedData encoding=\"raw\">\n_");
  const std::size_t tag = bytes.find("Name=\"" + name + "\" NumberOfComponents");
  if (block == std::string::npos || tag >= block) return {};
  const std::size_t offset_at = bytes.find("offset=\"", tag) + 8;
  std::size_t at = block + 31 + std::strtoull(bytes.c_str() + offset_at, nullptr, 10);
  if (at + 8 > bytes.size()) throw FileError(path + ": truncated");
  const std::size_t length = take_number<std::uint64_t>(bytes, at);
  if (length > bytes.size() - at) throw FileError(path + ": truncated");
  std::vector<T> values(length / sizeof(T));
  if (!values.empty()) std::memcpy(values.data(), bytes.data() + at, values.size() * sizeof(T));
  return values;
}

std::vector<Vec3> points_of(const std::vector<float>& flat_values) {
  std::vector<Vec3> points(flat_values.size() / 3);
  for (std::size_t p = 0; p < points.size(); ++p)
    for (int a = 0; a < 3; ++a) points[p][a] = flat_values[3 * p + a];
  return points;
}

}  // namespace

void write_vtp(const std::string& path, const SurfaceMesh& mesh, double time) {
  std::vector<int> corners, cell_body;
  for (const Vec3i& t : mesh.triangles) {
    corners.insert(corners.end(), {t[0], t[1], t[2]});
    if (!mesh.body.empty()) cell_body.push_back(mesh.body[t[0]]);
  }
  VtpText text;
  text.open(piece(mesh.vertices.size(), 0, mesh.triangles.size()));
  text.open("PointData Normals=\"Normals\"");
  text.array("Normals", "Float32", 3, flat(mesh.normals));
  if (!mesh.body.empty()) text.array("body", "Int32", 1, mesh.body);
  if (!mesh.rest.empty()) text.array("rest", "Float32", 3, flat(mesh.rest));
  text.close("PointData");
  text.open("CellData");
  if (!mesh.body.empty()) text.array("body", "Int32", 1, cell_body);
  text.close("CellData");
  text.open("Points");
  text.array("Points", "Float32", 3, flat(mesh.vertices));
  text.close("Points");
  text.open("Polys");
  text.array("connectivity", "Int32", 1, corners);
  text.array("offsets", "Int32", 1, offsets(mesh.triangles.size(), 3));
  text.close("Polys");
  text.close("Piece");
  write_file_atomically(path, text.file(time));
}

SurfaceMesh read_vtp(const std::string& path) {
  const std::string bytes = read_whole_file(path);
  if (bytes.find("<VTKFile type=\"PolyData\"") == std::string::npos ||
      bytes.find("<AppendedData encoding=\"raw\">") == std::string::npos)
    throw FileError(path + ": not a VTP file of this program");
  if (!bytes.ends_with("</VTKFile>\n")) throw FileError(path + ": truncated");
  SurfaceMesh mesh;
  mesh.vertices = points_of(take_array<float>(path, bytes, "Points"));
  mesh.normals = points_of(take_array<float>(path, bytes, "Normals"));
  mesh.body = take_array<int>(path, bytes, "body");
  mesh.rest = points_of(take_array<float>(path, bytes, "rest"));
  for (const std::size_t size : {mesh.normals.size(), mesh.body.size(), mesh.rest.size()})
    if (size != 0 && size != mesh.vertices.size())
      throw FileError(path + ": an array on points is of another length than the points");
  if (std::any_of(mesh.body.begin(), mesh.body.end(), [](int b) { return b < 0; }))
    throw FileError(path + ": a point is of a body with a negative number");
  const std::vector<int> corners = take_array<int>(path, bytes, "connectivity");
  const int n = static_cast<int>(mesh.vertices.size());
  for (std::size_t c = 0; c + 2 < corners.size(); c += 3) {
    const Vec3i t(corners[c], corners[c + 1], corners[c + 2]);
    if (t.minCoeff() < 0 || t.maxCoeff() >= n)
      throw FileError(path + ": a triangle names a point that is not there");
    mesh.triangles.push_back(t);
  }
  return mesh;
}

void write_particles_vtp(const std::string& path, const Particles& particles, double time) {
  VtpText text;
  text.open(piece(particles.size(), particles.size(), 0));
  text.open("PointData");
  text.array("radius", "Float32", 1, particles.radius);
  text.array("sign", "Int8", 1, particles.sign);
  text.close("PointData");
  close_vertices(particles.position, text);
  write_file_atomically(path, text.file(time));
}

void write_markers_vtp(const std::string& path, const std::vector<Vec3>& position,
                       const std::vector<Vec3>& velocity, double time) {
  VtpText text;
  text.open(piece(position.size(), position.size(), 0));
  text.open("PointData Vectors=\"velocity\"");
  text.array("velocity", "Float32", 3, flat(velocity));
  text.close("PointData");
  close_vertices(position, text);
  write_file_atomically(path, text.file(time));
}

void write_spray_vtp(const std::string& path, const Spray& spray, double time) {
  std::vector<float> radius;
  for (const double v : spray.volume)
    radius.push_back(static_cast<float>(std::cbrt(0.75 * v / std::numbers::pi)));
  VtpText text;
  text.open(piece(spray.size(), spray.size(), 0));
  text.open("PointData Scalars=\"radius\" Vectors=\"velocity\"");
  text.array("radius", "Float32", 1, radius);
  text.array("velocity", "Float32", 3, flat(spray.velocity));
  text.close("PointData");
  close_vertices(spray.position, text);
  write_file_atomically(path, text.file(time));
}

void PvdIndex::resume(int frames) {
  if (!std::filesystem::exists(path_)) return;
  std::istringstream lines(read_whole_file(path_));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("<DataSet")) continue;
    const std::size_t number = line.find('.', line.find("file=\"")) + 1;  // stem.NNNNNN.ext
    if (std::stoi(line.substr(number, 6)) < frames) entries_ += line + '\n';
  }
}

void PvdIndex::add(double time, const std::string& file_name) {
  entries_ +=
      "<DataSet timestep=\"" + number_text(time) + "\" part=\"0\" file=\"" + file_name + "\"/>\n";
  write_file_atomically(path_,
                        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" "
                        "byte_order=\"LittleEndian\">\n<Collection>\n" +
                            entries_ + "</Collection>\n</VTKFile>\n");
}

}  // namespace archetide
