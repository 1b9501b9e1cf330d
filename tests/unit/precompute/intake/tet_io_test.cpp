#include "precompute/intake/tet_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <sstream>

#include "common/base/input_error.h"
#include "common/files/base64.h"
#include "precompute/intake/regions.h"
#include "tests/unit/precompute/precompute_test_meshes.h"

namespace archetide {
namespace {

using testing_meshes::ScratchFolder;

/// A box of 48 tets and a lone triangle cell, as VTK XML in one of its encodings.
enum class Encoding { kAscii, kBinary, kAppendedRaw, kAppendedBase64 };

TetMesh box() { return shapes::tet_box(2, 2, 2, 0.5); }

template <class T>
std::string array(Encoding encoding, const std::string& type, const std::string& name,
                  const std::vector<T>& values, std::string& appended) {
  std::ostringstream tag;
  tag.precision(17);
  tag << "<DataArray type=\"" << type << "\" Name=\"" << name << "\"";
  const std::uint32_t length = static_cast<std::uint32_t>(values.size() * sizeof(T));
  std::string bytes(sizeof length + length, '\0');
  std::memcpy(bytes.data(), &length, sizeof length);
  std::memcpy(bytes.data() + sizeof length, values.data(), length);
  if (encoding == Encoding::kAscii) {
    tag << " format=\"ascii\">\n";
    for (const T v : values) tag << +v << ' ';
    tag << "\n</DataArray>\n";
  } else if (encoding == Encoding::kBinary) {
    tag << " format=\"binary\">\n  " << base64(bytes) << "\n</DataArray>\n";
  } else {
    tag << " format=\"appended\" offset=\"" << appended.size() << "\"/>\n";
    appended += encoding == Encoding::kAppendedRaw ? bytes : base64(bytes);
  }
  return tag.str();
}

std::string as_vtu(Encoding e, const std::string& head_attributes = "", int cell_type = 10) {
  std::vector<float> points;
  std::vector<std::int64_t> corners, ends;
  std::vector<std::uint8_t> types;
  for (const Vec3& x : box().nodes)
    for (const double c : x) points.push_back(static_cast<float>(c));
  corners = {0, 1, 2};  // a boundary triangle, to be left out
  ends = {3};
  types = {5};
  for (const auto& tet : box().tets) {
    corners.insert(corners.end(), tet.begin(), tet.end());
    ends.push_back(static_cast<std::int64_t>(corners.size()));
    types.push_back(static_cast<std::uint8_t>(cell_type));
  }
  std::string appended;
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type='UnstructuredGrid' version=\"0.1\" "
      "byte_order=\"LittleEndian\" " +
      head_attributes +
      ">\n<UnstructuredGrid><Piece NumberOfPoints=\"27\" NumberOfCells=\"49\">\n<PointData>\n";
  text += array(e, "Float32", "heat", points, appended);
  text += "</PointData>\n<Points>\n" + array(e, "Float32", "Points", points, appended);
  text += "</Points>\n<Cells>\n" + array(e, "Int64", "connectivity", corners, appended);
  text += array(e, "Int64", "offsets", ends, appended);
  text += array(e, "UInt8", "types", types, appended);
  text += "</Cells>\n</Piece></UnstructuredGrid>\n";
  if (!appended.empty())
    text += std::string("<AppendedData encoding=\"") +
            (e == Encoding::kAppendedRaw ? "raw" : "base64") + "\">\n_" + appended +
            "\n</AppendedData>\n";
  return text + "</VTKFile>\n";
}

TEST(TetIo, ReadsVtuInEveryUncompressedEncoding) {
  const ScratchFolder folder;
  for (const Encoding e :
       {Encoding::kAscii, Encoding::kBinary, Encoding::kAppendedRaw, Encoding::kAppendedBase64}) {
    const TetMesh mesh = read_tets(folder.write("Box.VTU", as_vtu(e)), 2.0);
    ASSERT_EQ(mesh.nodes.size(), box().nodes.size()) << int(e);
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
      EXPECT_EQ(mesh.nodes[i], Vec3(2.0 * box().nodes[i]));  // halves are exact in float
    EXPECT_EQ(mesh.tets, box().tets);
  }
}

std::string refusal(const std::string& path) {
  try {
    read_tets(path, 1.0);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(TetIo, RefusesVtuThatItCannotRead) {
  const ScratchFolder folder;
  const auto has = [&](const std::string& text, const std::string& part) {
    const std::string found = refusal(folder.write("a.vtu", text));
    EXPECT_NE(found.find(part), std::string::npos) << found;
  };
  has(as_vtu(Encoding::kAscii, "compressor=\"vtkZLibDataCompressor\""), "compressed (vtkZLib");
  has(as_vtu(Encoding::kAscii, "", 24), "cells of VTK type 24 are not supported");
  has(as_vtu(Encoding::kAscii, "", 5), "no tetrahedra");
  has("solid ascii\n", "not a VTK XML file");
  // Cut off at any length: refused or, behind the arrays, whole; never a crash.
  for (const Encoding e :
       {Encoding::kAscii, Encoding::kBinary, Encoding::kAppendedRaw, Encoding::kAppendedBase64}) {
    const std::string whole = as_vtu(e);
    for (std::size_t n = 0; n < whole.size() - 60; n += 97)
      EXPECT_NE(refusal(folder.write("cut.vtu", whole.substr(0, n))), "") << int(e) << " " << n;
  }
}

std::string as_medit() {
  std::ostringstream text;
  text << "MeshVersionFormatted 2\nDimension 3\nVertices\n" << box().nodes.size() << "\n";
  for (const Vec3& x : box().nodes) text << x.transpose() << " 0\n";
  text << "Tetrahedra\n" << box().tets.size() << "\n";
  for (const auto& tet : box().tets) {
    for (const int node : tet) text << node + 1 << ' ';
    text << "1\n";
  }
  text << "End\n";
  return text.str();
}

TEST(TetIo, ReadsMedit) {
  const ScratchFolder folder;
  const TetMesh mesh = read_tets(folder.write("box.mesh", as_medit()), 1.0);
  EXPECT_EQ(mesh.nodes.size(), 27u);
  EXPECT_EQ(mesh.tets.size(), 48u);
  double volume = 0.0;
  for (int t = 0; t < 48; ++t) volume += tet_volume(mesh, t);
  EXPECT_NEAR(volume, 1.0, 1e-14);
}

constexpr char kTwoTets[] =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 5 \"heavy\"\n"
    "$EndPhysicalNames\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n$EndNodes\n"
    "$Elements\n2\n1 4 2 5 1 1 2 3 4\n2 4 2 6 2 2 3 4 5\n$EndElements\n";

TEST(TetIo, PhysicalGroupsOfAMshFileAreMaterialRegions) {
  const ScratchFolder folder;
  // Two tets, one in each group; the second group has a number only.
  const std::string path = folder.write("two.msh", kTwoTets);
  TetGroups groups;
  const TetMesh mesh = read_tets(path, 1.0, &groups);
  ASSERT_EQ(mesh.tets.size(), 2u);
  EXPECT_EQ(groups, (TetGroups{{"heavy", {0}}, {"6", {1}}}));
  const Material base{1.0, 1e5, 0.3}, other{7.0, 1e5, 0.3};
  MaterialRegion region{{}, other, {}};
  region.region.group = "heavy";
  const MaterialField field = find_materials(base, {region}, mesh, Vec3::Zero(), groups);
  EXPECT_EQ(field.at(0).density, 7.0);
  EXPECT_EQ(field.at(1).density, 1.0);
  region.region.group = "havy";
  try {
    find_materials(base, {region}, mesh, Vec3::Zero(), groups);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("its groups are: 6, heavy"), std::string::npos);
  }
}

TEST(TetIo, ReadsEveryKindOfMshAlike) {
  const std::string folder = ARCHETIDE_CORPUS "/msh/";
  for (const char* name :
       {"v2.msh", "v22_binary.msh", "v40.msh", "v41.msh", "v41_binary.msh", "v41_big_endian.msh"}) {
    TetGroups groups;
    const TetMesh mesh = read_tets(folder + name, 1.0, &groups);
    ASSERT_EQ(mesh.nodes.size(), 5u) << name;
    EXPECT_EQ(mesh.nodes[4], Vec3(1, 1, 1)) << name;
    ASSERT_EQ(mesh.tets.size(), 2u) << name;
    EXPECT_EQ(mesh.tets[0], (std::array<int, 4>{0, 1, 2, 3})) << name;
    const auto holds_first = [](const auto& group) { return group.second.front() == 0; };
    EXPECT_TRUE(std::any_of(groups.begin(), groups.end(), holds_first)) << name;
  }
}

TEST(TetIo, MeshesWhoseCountsLieEndAtOnce) {
  const ScratchFolder folder;
  // Gmsh ended by a signal on the first, and never on the last.
  EXPECT_NE(
      refusal(folder.write("a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n99999999999\n")),
      "");
  EXPECT_NE(refusal(folder.write("b.msh",
                                 "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n"
                                 "$EndNodes\n$Elements\n1\n1 4 2147483647 1 1 1 1\n")),
            "");
  EXPECT_NE(refusal(folder.write(
                "c.mesh", "MeshVersionFormatted 2\nDimension 3\nVertices\n2147483647\n0 0 0")),
            "");
}

/// A script that leaves a file, `mark`, when gmsh runs it.
std::string script(const std::string& mark) { return "SystemCall \"touch " + mark + "\";\n"; }

TEST(TetIo, MeshFilesThatAreScriptsAreNotRun) {
  const ScratchFolder folder;
  const std::string mark = folder.file("ran");
  const std::string scripts[] = {script(mark), "// $MeshFormat\n" + script(mark),
                                 "\n$MeshFormat\n" + script(mark),
                                 "For i In {0:1:0}\n" + script(mark) + "EndFor\n"};
  for (const std::string& text : scripts) {
    for (const char* name : {"a.msh", "a.MSH", "a.Msh"})
      EXPECT_NE(refusal(folder.write(name, text)).find("does not begin with $MeshFormat"),
                std::string::npos)
          << name << ": " << text;
    for (const char* name : {"a.mesh", "a.Mesh"})
      EXPECT_NE(refusal(folder.write(name, text)), "") << name << ": " << text;
  }
  EXPECT_FALSE(std::filesystem::exists(mark));
}

TEST(TetIo, NothingBesideAMeshFileIsRead) {
  const ScratchFolder folder;
  const std::string mark = folder.file("ran");
  const std::string msh = folder.write("two.msh", kTwoTets),
                    medit = folder.write("box.mesh", as_medit());
  for (const std::string& path : {std::string("two.msh"), std::string("box.mesh")})
    folder.write(path + ".opt", script(mark));
  EXPECT_EQ(read_tets(msh, 1.0).tets.size(), 2u);
  EXPECT_EQ(read_tets(medit, 1.0).tets.size(), 48u);
  EXPECT_FALSE(std::filesystem::exists(mark));
}

TEST(TetIo, RefusalsNameTheFileOfTheUser) {
  const ScratchFolder folder;
  const std::string text = refusal(folder.write("torn.msh", "$MeshFormat\n9.9 0 8\n"));
  EXPECT_EQ(text.find(folder.file("torn.msh")), 0u) << text;
  EXPECT_EQ(text.find("input.msh"), std::string::npos) << text;
}

}  // namespace
}  // namespace archetide
