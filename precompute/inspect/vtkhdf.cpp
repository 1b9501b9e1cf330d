#include <fmt/core.h>

#include <cstring>

#include "common/files/hdf5_file.h"
#include "precompute/inspect/inspect.h"

namespace archetide {
namespace {

using Type = DataArray::Type;

template <class T>
DataArray packed(Type type, std::vector<std::size_t> shape, const T* data, std::size_t count) {
  DataArray array{type, std::move(shape), std::vector<char>(count * sizeof(T))};
  std::memcpy(array.bytes.data(), data, array.bytes.size());
  return array;
}

DataArray integers(const std::vector<std::int64_t>& list) {
  return packed(Type::kInt64, {list.size()}, list.data(), list.size());
}

void write_cells(Hdf5Writer& file, const TetMesh& tets) {
  constexpr std::uint8_t kVtkTetra = 10, kVtkQuadraticTetra = 24;
  const bool quadratic = tets.order() == 2;
  std::vector<std::int64_t> nodes, offsets = {0};
  for (std::size_t t = 0; t < tets.tets.size(); ++t) {
    nodes.insert(nodes.end(), tets.tets[t].begin(), tets.tets[t].end());
    if (quadratic) nodes.insert(nodes.end(), tets.mids[t].begin(), tets.mids[t].end());
    offsets.push_back(static_cast<std::int64_t>(nodes.size()));
  }
  const std::vector<std::uint8_t> types(tets.tets.size(),
                                        quadratic ? kVtkQuadraticTetra : kVtkTetra);
  const auto count = [](std::size_t n) { return integers({static_cast<std::int64_t>(n)}); };
  file.write("VTKHDF/NumberOfPoints", count(tets.nodes.size()), "1", "1");
  file.write("VTKHDF/NumberOfCells", count(tets.tets.size()), "1", "1");
  file.write("VTKHDF/NumberOfConnectivityIds", count(nodes.size()), "1", "1");
  file.write("VTKHDF/Connectivity", integers(nodes), "1", quadratic ? "10 nt" : "4 nt");
  file.write("VTKHDF/Offsets", integers(offsets), "1", "nt + 1");
  file.write("VTKHDF/Types", packed(Type::kUint8, {types.size()}, types.data(), types.size()), "1",
             "nt");
}

}  // namespace

void write_vtkhdf(const std::string& path, const Archetype& a) {
  const std::size_t n = a.tets.nodes.size(), r = static_cast<std::size_t>(a.r());
  // Views of a dataset came with the format of HDF5 1.10.
  Hdf5Writer file(path, Hdf5Writer::Format::k110);
  file.write(
      "VTKHDF/Points",
      packed(Type::kFloat64, {n, 3}, reinterpret_cast<const double*>(a.tets.nodes.data()), 3 * n),
      "m", "n x 3");
  file.group_attribute("VTKHDF", "Type", "UnstructuredGrid");
  file.group_attribute("VTKHDF", "Version", std::vector<std::int64_t>{1, 0});
  write_cells(file, a.tets);
  if (r > 0) {
    // 3n x r by columns is (r, n, 3) by rows.
    file.write("modes", packed(Type::kFloat64, {r, n, 3}, a.node_modes.data(), 3 * n * r), "m",
               "r x n x 3");
    for (std::size_t k = 0; k < r; ++k)
      file.view(fmt::format("VTKHDF/PointData/mode_{}", k + 1), "/modes", {r, n, 3}, k);
  }
  file.commit();
}

}  // namespace archetide
