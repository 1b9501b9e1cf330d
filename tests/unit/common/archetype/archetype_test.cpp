#include "common/archetype/archetype.h"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "common/base/byte_stream.h"
#include "common/base/check.h"
#include "common/base/input_error.h"
#include "common/files/hdf5_file.h"

namespace archetide {
namespace {

std::string scratch(const std::string& name) {
  return fmt::format("{}archetype_{}_{}", testing::TempDir(), ::getpid(), name);
}

void put_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

/// One tet with r modes of random numbers: every field differs from its default and from the
/// others.
Archetype sample(int r) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> uniform(0.1, 1.0);
  const auto number = [&](Eigen::Index, Eigen::Index) { return uniform(random); };
  Archetype a;
  a.name = "sample";
  a.generator = "test 1";
  a.recipe = "schema = 1\n# \xc3\xa9\n";
  a.mesh_file = "sample.obj";
  a.mesh_hash = "ab12";
  a.mesher = "input";
  a.mass_kind = "consistent";
  a.density = 400, a.young = 5e4, a.poisson = 0.4, a.alpha = 0.5, a.beta = 0.01;
  a.tets.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  a.tets.tets = {{0, 1, 2, 3}};
  a.surface = boundary_surface(a.tets, a.surface_to_node);
  vertex_normals_and_areas(a.surface, a.surface_normals, a.surface_areas);
  a.volume = tet_volume(a.tets, 0);
  a.centre = Vec3(1, 2, 3);
  a.min_dihedral = 54.7, a.min_radius_ratio = 0.7;
  a.sdf.origin = Vec3(-1, -2, -3);
  a.sdf.spacing = 0.25;
  a.sdf.nodes = Vec3i(2, 3, 4);
  for (int i = 0; i < 24; ++i) a.sdf.values.push_back(static_cast<float>(uniform(random)));
  a.omega2 = VecX::NullaryExpr(r, [&](Eigen::Index i) { return 1.0 + static_cast<double>(i); });
  a.residuals = VecX::NullaryExpr(r, [&](Eigen::Index) { return uniform(random); });
  a.is_static.assign(static_cast<std::size_t>(r), 0);
  if (r > 1) a.is_static.back() = 1;
  a.frequency_error =
      VecX::NullaryExpr(r > 1 ? r - 1 : r, [&](Eigen::Index) { return uniform(random); });
  a.clamped = "foot";
  a.point_sets = {{"foot", {0, 2}}, {"none", {}}, {"tip", {3}}};
  a.joint_frames = {{"hinge", Vec3(0.1, 0.2, 0.3), Mat3::NullaryExpr(number)}};
  a.surface_modes = MatX::NullaryExpr(12, r, number);
  a.node_modes = MatX::NullaryExpr(12, r, number);
  a.M_r = MatX::NullaryExpr(r, r, number);
  a.K_r = MatX::NullaryExpr(r, r, number);
  a.integrals.mass = 66.7;
  a.integrals.Sxx = Mat3::NullaryExpr(number);
  for (int i = 0; i < r; ++i)
    a.integrals.I3.push_back(Vec3::NullaryExpr([&] { return uniform(random); }));
  for (int i = 0; i < r; ++i) a.integrals.A.push_back(Mat3::NullaryExpr(number));
  for (int i = 0; i < r * r; ++i) a.integrals.B.push_back(Mat3::NullaryExpr(number));
  return a;
}

void expect_same_runtime_part(const Archetype& a, const Archetype& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.generator, b.generator);
  EXPECT_EQ(a.recipe, b.recipe);
  EXPECT_EQ(a.mesh_file, b.mesh_file);
  EXPECT_EQ(a.mesh_hash, b.mesh_hash);
  EXPECT_EQ(a.mesher, b.mesher);
  EXPECT_EQ(a.mass_kind, b.mass_kind);
  EXPECT_EQ(a.blas, b.blas);
  EXPECT_EQ(a.density, b.density);
  EXPECT_EQ(a.young, b.young);
  EXPECT_EQ(a.poisson, b.poisson);
  EXPECT_EQ(a.alpha, b.alpha);
  EXPECT_EQ(a.beta, b.beta);
  EXPECT_EQ(a.volume, b.volume);
  EXPECT_EQ(a.centre, b.centre);
  EXPECT_EQ(a.min_dihedral, b.min_dihedral);
  EXPECT_EQ(a.min_radius_ratio, b.min_radius_ratio);
  EXPECT_EQ(a.surface.vertices, b.surface.vertices);
  EXPECT_EQ(a.surface.triangles, b.surface.triangles);
  EXPECT_EQ(a.surface_to_node, b.surface_to_node);
  EXPECT_EQ(a.surface_normals, b.surface_normals);
  EXPECT_EQ(a.surface_areas, b.surface_areas);
  EXPECT_EQ(a.sdf.origin, b.sdf.origin);
  EXPECT_EQ(a.sdf.spacing, b.sdf.spacing);
  EXPECT_EQ(a.sdf.nodes, b.sdf.nodes);
  EXPECT_EQ(a.sdf.values, b.sdf.values);
  EXPECT_EQ(a.omega2, b.omega2);
  EXPECT_EQ(a.residuals, b.residuals);
  EXPECT_EQ(a.is_static, b.is_static);
  EXPECT_EQ(a.frequency_error, b.frequency_error);
  EXPECT_EQ(a.clamped, b.clamped);
  ASSERT_EQ(a.point_sets.size(), b.point_sets.size());
  for (std::size_t i = 0; i < a.point_sets.size(); ++i) {
    EXPECT_EQ(a.point_sets[i].name, b.point_sets[i].name);
    EXPECT_EQ(a.point_sets[i].vertices, b.point_sets[i].vertices);
  }
  ASSERT_EQ(a.joint_frames.size(), b.joint_frames.size());
  for (std::size_t i = 0; i < a.joint_frames.size(); ++i) {
    EXPECT_EQ(a.joint_frames[i].name, b.joint_frames[i].name);
    EXPECT_EQ(a.joint_frames[i].point, b.joint_frames[i].point);
    EXPECT_EQ(a.joint_frames[i].axes, b.joint_frames[i].axes);
  }
  EXPECT_EQ(a.surface_modes, b.surface_modes);
  EXPECT_EQ(a.M_r, b.M_r);
  EXPECT_EQ(a.K_r, b.K_r);
  EXPECT_EQ(a.integrals.mass, b.integrals.mass);
  EXPECT_EQ(a.integrals.Sxx, b.integrals.Sxx);
  EXPECT_EQ(a.integrals.I3, b.integrals.I3);
  EXPECT_EQ(a.integrals.A, b.integrals.A);
  EXPECT_EQ(a.integrals.B, b.integrals.B);
}

/// The message of the FileError that reading must throw, or "" when it reads.
std::string reading_error(const std::string& path, Part part = Part::kAll) {
  try {
    read_archetype(path, part);
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

TEST(ArchetypeFile, ReadsBackEveryFieldBitForBit) {
  const std::string path = scratch("round.h5");
  for (const int r : {0, 1, 3}) {
    const Archetype a = sample(r);
    write_archetype(path, a);
    const Archetype b = read_archetype(path);
    expect_same_runtime_part(a, b);
    EXPECT_EQ(a.tets.nodes, b.tets.nodes);
    EXPECT_EQ(a.tets.tets, b.tets.tets);
    EXPECT_EQ(a.node_modes, b.node_modes);
    EXPECT_EQ(b.content_hash.size(), 64u);
  }
  std::filesystem::remove(path);
}

TEST(ArchetypeFile, RuntimePartLeavesOutTetsAndNodeModes) {
  const std::string path = scratch("runtime.h5");
  const Archetype a = sample(2);
  write_archetype(path, a);
  const Archetype b = read_archetype(path, Part::kRuntime);
  expect_same_runtime_part(a, b);
  EXPECT_TRUE(b.tets.nodes.empty());
  EXPECT_EQ(b.node_modes.size(), 0);
  EXPECT_EQ(b.content_hash, read_archetype(path).content_hash);
  std::filesystem::remove(path);
}

/// Matrices for the four nodes of `sample`.
TetMatrices sample_matrices() {
  TetMatrices m;
  m.order = {2, 0, 3, 1};
  for (int p = 0; p < 4; ++p) {
    for (int q = 0; q <= p; ++q) {
      m.column.push_back(q);
      m.mass.push_back(1.0 + p + 0.1 * q);
      m.stiffness.push_back(Mat3::Constant(p) + Mat3(Vec3(1, 2, q).asDiagonal()));
    }
    m.row_ends.push_back(static_cast<int>(m.column.size()));
  }
  return m;
}

TEST(ArchetypeFile, MatricesOfTheTetsAreReadWithTheWholeOnly) {
  const std::string path = scratch("matrices.h5");
  Archetype a = sample(2);
  const std::string without = write_archetype(path, a);
  EXPECT_TRUE(read_archetype(path).matrices.empty());
  a.matrices = sample_matrices();
  EXPECT_EQ(write_archetype(path, a), without);  // they follow from the rest
  EXPECT_TRUE(read_archetype(path, Part::kRuntime).matrices.empty());
  const TetMatrices m = read_archetype(path).matrices;
  EXPECT_EQ(m.order, a.matrices.order);
  EXPECT_EQ(m.row_ends, a.matrices.row_ends);
  EXPECT_EQ(m.column, a.matrices.column);
  EXPECT_EQ(m.mass, a.matrices.mass);
  EXPECT_EQ(m.stiffness, a.matrices.stiffness);
  EXPECT_EQ(m.lambda.size(), 0);
  a.matrices.lambda = VecX::Constant(1, 2e4), a.matrices.mu = VecX::Constant(1, 7e3);
  EXPECT_EQ(write_archetype(path, a), without);
  EXPECT_EQ(read_archetype(path).matrices.lambda, a.matrices.lambda);
  EXPECT_EQ(read_archetype(path).matrices.mu, a.matrices.mu);
  std::filesystem::remove(path);
}

TEST(ArchetypeValidation, RefusesMatricesThatAreNoneOfTheTets) {
  const auto refused = [](const auto& damage) {
    Archetype a = sample(2);
    a.matrices = sample_matrices();
    validate(a);
    damage(a.matrices);
    EXPECT_THROW(validate(a), AssertionError);
  };
  refused([](TetMatrices& m) { m.order[1] = 2; });        // a node twice
  refused([](TetMatrices& m) { m.order.pop_back(); });    // a node missing
  refused([](TetMatrices& m) { m.column[1] = 3; });       // above the diagonal
  refused([](TetMatrices& m) { m.row_ends[0] = 0; });     // an empty row
  refused([](TetMatrices& m) { m.row_ends[3] = 1000; });  // beyond the end
  refused([](TetMatrices& m) { m.mass.back() = 0.0; });   // no mass
  refused([](TetMatrices& m) { m.stiffness[2](1, 1) = NAN; });
  refused([](TetMatrices& m) { m.mu = VecX::Ones(1); });  // lambda missing
  refused([](TetMatrices& m) { m.lambda = VecX::Ones(1), m.mu = VecX::Zero(1); });
  refused([](TetMatrices& m) { m.lambda = m.mu = VecX::Ones(2); });  // more than there are tets
}

TEST(ArchetypeFile, SameContentsGiveTheSameBytes) {
  const std::string first = scratch("first.h5"), second = scratch("second.h5");
  write_archetype(first, sample(3));
  ::sleep(1);  // a stored time of writing, in seconds, would differ
  write_archetype(second, sample(3));
  EXPECT_EQ(read_whole_file(first), read_whole_file(second));
  std::filesystem::remove(first);
  std::filesystem::remove(second);
}

TEST(ArchetypeFile, ContentHashChangesWithAnyNumber) {
  const std::string path = scratch("hash.h5");
  Archetype a = sample(2);
  write_archetype(path, a);
  const std::string before = read_archetype(path).content_hash;
  a.node_modes(5, 1) = std::nextafter(a.node_modes(5, 1), 2.0);
  write_archetype(path, a);
  EXPECT_NE(read_archetype(path).content_hash, before);
  std::filesystem::remove(path);
}

TEST(ArchetypeFile, TruncationAtAnyPlaceIsAFileError) {
  const std::string path = scratch("cut.h5");
  write_archetype(path, sample(3));
  const std::string whole = read_whole_file(path);
  for (const double part : {0.0, 0.001, 0.01, 0.1, 0.5, 0.9, 0.999}) {
    put_bytes(path,
              whole.substr(0, static_cast<std::size_t>(part * static_cast<double>(whole.size()))));
    EXPECT_NE(reading_error(path), "") << "cut at " << part;
  }
  put_bytes(path, whole.substr(0, whole.size() - 1));
  EXPECT_NE(reading_error(path).find("truncated"), std::string::npos) << reading_error(path);
  std::filesystem::remove(path);
}

// Either reading fails with FileError, or the byte was one that holds nothing (alignment, spare
// room).
TEST(ArchetypeFile, AFlippedByteIsAFileErrorOrChangesNothing) {
  const std::string path = scratch("flip.h5");
  const Archetype a = sample(2);
  write_archetype(path, a);
  const std::string whole = read_whole_file(path);
  int silent = 0, flips = 0;
  for (std::size_t at = 0; at < whole.size(); at += 23, ++flips) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    put_bytes(path, damaged);
    if (reading_error(path).empty()) {
      ++silent;
      expect_same_runtime_part(a, read_archetype(path));
    }
  }
  EXPECT_LT(silent, flips / 10);  // measured 3.4 % of the bytes
  RecordProperty("silent_flips", silent);
  std::filesystem::remove(path);
}

TEST(ArchetypeFile, AFlippedBitInStoredNumbersIsNamedAHashMismatch) {
  const std::string path = scratch("bit.h5");
  const Archetype a = sample(2);
  write_archetype(path, a);
  std::string bytes = read_whole_file(path);
  const auto find = [&](const double& x) {
    return bytes.find(std::string(reinterpret_cast<const char*>(&x), 8));
  };
  std::string damaged = bytes;
  damaged[find(a.node_modes(3, 1))] ^= 1;
  put_bytes(path, damaged);
  EXPECT_NE(reading_error(path).find("full_hash"), std::string::npos) << reading_error(path);
  EXPECT_EQ(reading_error(path, Part::kRuntime), "");
  damaged = bytes;
  damaged[find(a.K_r(1, 0))] ^= 1;
  put_bytes(path, damaged);
  EXPECT_NE(reading_error(path, Part::kRuntime).find("runtime_hash"), std::string::npos);
  std::filesystem::remove(path);
}

TEST(ArchetypeFile, SaysWhatIsWrongWithAForeignFile) {
  const std::string path = scratch("foreign.h5");
  EXPECT_NE(reading_error(path).find("no such file"), std::string::npos);
  EXPECT_NE(reading_error(path).find("archetide-precompute build"), std::string::npos);
  EXPECT_NE(reading_error(testing::TempDir()).find("not a file"), std::string::npos);
  put_bytes(path, "v 0 0 0\n");
  EXPECT_NE(reading_error(path).find("not an HDF5 file"), std::string::npos);
  {
    Hdf5Writer other(path);
    other.attribute("format", "something else");
    other.commit();
  }
  EXPECT_NE(reading_error(path).find("not a body archetype"), std::string::npos);
  {
    Hdf5Writer newer(path);
    newer.attribute("format", "archetide body archetype");
    newer.attribute("format_version", Archetype::kNonlinearFormatVersion + 1);
    newer.commit();
  }
  EXPECT_NE(reading_error(path).find("format version 4, this program reads versions 2 and 3"),
            std::string::npos)
      << reading_error(path);
  std::filesystem::remove(path);
}

/// sample(2) with an elastic energy of three points, whose stiffness at rest is K_r.
Archetype nonlinear_sample() {
  Archetype a = sample(2);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0.1, 1.0);
  const auto number = [&](Eigen::Index, Eigen::Index) { return uniform(random); };
  const auto positive = [&](Eigen::Index) { return uniform(random); };
  a.elastic = ElasticCubature(MatX::NullaryExpr(27, 2, number), VecX::NullaryExpr(3, positive),
                              VecX::NullaryExpr(3, positive), VecX::NullaryExpr(3, positive));
  a.K_r = a.elastic.stiffness(VecX::Zero(2));
  return a;
}

TEST(ArchetypeFile, KeepsTheElasticEnergy) {
  const std::string path = scratch("elastic.h5");
  const Archetype a = nonlinear_sample();
  write_archetype(path, a);
  for (const Part part : {Part::kRuntime, Part::kAll}) {
    const Archetype b = read_archetype(path, part);
    EXPECT_EQ(a.elastic.gradients, b.elastic.gradients);
    EXPECT_EQ(a.elastic.weights, b.elastic.weights);
    EXPECT_EQ(a.elastic.lambda, b.elastic.lambda);
    EXPECT_EQ(a.elastic.mu, b.elastic.mu);
    EXPECT_EQ(a.elastic.energy(VecX::Ones(2)), b.elastic.energy(VecX::Ones(2)));
  }
  std::string bytes = read_whole_file(path);
  const double weight = a.elastic.weights[1];
  bytes[bytes.find(std::string(reinterpret_cast<const char*>(&weight), 8))] ^= 1;
  put_bytes(path, bytes);
  EXPECT_NE(reading_error(path).find("elastic_hash"), std::string::npos) << reading_error(path);
  std::filesystem::remove(path);
}

TEST(ArchetypeFile, TheWholeOfOneWithoutTetsIsRefused) {
  const std::string path = scratch("hollow.h5");
  Archetype a = sample(1);
  a.tets.tets.clear();
  write_archetype(path, a);
  EXPECT_NE(reading_error(path).find("tets: empty"), std::string::npos) << reading_error(path);
  EXPECT_EQ(reading_error(path, Part::kRuntime), "");
  std::filesystem::remove(path);
}

TEST(ArchetypeFile, AFailedWriteKeepsTheOldFile) {
  const std::string path = scratch("kept.h5");
  write_archetype(path, sample(1));
  const std::string before = read_whole_file(path);
  Archetype broken = sample(1);
  broken.omega2[0] = std::nan("");
  EXPECT_THROW(write_archetype(path, broken), AssertionError);
  {
    Hdf5Writer abandoned(path);
    abandoned.attribute("format", "half");
  }
  EXPECT_EQ(read_whole_file(path), before);
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  EXPECT_THROW(write_archetype("/nonexistent/folder/a.h5", sample(1)), MachineError);
  std::filesystem::remove(path);
}

TEST(ArchetypeValidation, NamesTheFieldThatIsWrong) {
  const auto complaint = [](auto&& spoil) {
    Archetype a = sample(2);
    spoil(a);
    try {
      validate(a);
    } catch (const AssertionError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(complaint([](Archetype&) {}), "");
  EXPECT_NE(
      complaint([](Archetype& a) { a.surface_modes(4, 1) = std::nan(""); }).find("surface_modes"),
      std::string::npos);
  EXPECT_NE(
      complaint([](Archetype& a) { a.integrals.B.pop_back(); }).find("field B: size 3, expected 4"),
      std::string::npos);
  EXPECT_NE(
      complaint([](Archetype& a) { a.surface.triangles[0][1] = 4; }).find("surface_triangles"),
      std::string::npos);
  EXPECT_NE(complaint([](Archetype& a) { a.sdf.values.pop_back(); }).find("sdf_values"),
            std::string::npos);
  const auto names = [&](const char* field, auto&& spoil) {
    EXPECT_NE(complaint(spoil).find(field), std::string::npos) << field;
  };
  names("sdf_spacing", [](Archetype& a) { a.sdf.spacing = 0.0; });
  for (const double factor : {1e200, 1e-200})
    names("density: not that of matter",
          [&](Archetype& a) { a.density *= factor, a.integrals.mass *= factor; });
  names("sdf_spacing", [](Archetype& a) { a.sdf.spacing = std::nan(""); });
  names("sdf_origin", [](Archetype& a) { a.sdf.origin[1] = std::nan(""); });
  names("sdf_nodes", [](Archetype& a) { a.sdf.nodes = Vec3i(1, 1, 24); });
  names("sdf_values", [](Archetype& a) {  // the product wraps around to nothing
    a.sdf.nodes = Vec3i(1 << 30, 1 << 30, 1 << 30), a.sdf.values.clear();
  });
  names("surface_triangles", [](Archetype& a) { a.surface.triangles.clear(); });
  names("mass", [](Archetype& a) { a.integrals.mass *= 1e200; });
  names("Sxx", [](Archetype& a) { a.integrals.Sxx *= 1e200; });
  names("Sxx", [](Archetype& a) { a.integrals.Sxx.setZero(); });
  names("K_r", [](Archetype& a) { a.K_r.setZero(); });
  names("M_r", [](Archetype& a) { a.M_r.setZero(); });
  const auto elastic = [&](const char* field, auto&& spoil) {
    names(field, [&](Archetype& a) {
      a = nonlinear_sample();
      spoil(a.elastic);
    });
  };
  elastic("elastic weights", [](ElasticCubature& e) { e.weights[0] = -1.0; });
  elastic("elastic mu", [](ElasticCubature& e) { e.mu[2] = std::nan(""); });
  elastic("elastic lambda", [](ElasticCubature& e) { e.lambda[1] = -10.0; });
  elastic("elastic gradients", [](ElasticCubature& e) { e.gradients(3, 1) = std::nan(""); });
  elastic("elastic gradients", [](ElasticCubature& e) { e.gradients.conservativeResize(27, 1); });
  names("elastic gradients", [](Archetype& a) { a = nonlinear_sample(), a.K_r *= 1e3; });
  EXPECT_NE(complaint([](Archetype& a) { a.poisson = 0.5; }).find("poisson"), std::string::npos);
  EXPECT_NE(complaint([](Archetype& a) { a.tets.tets[0][3] = -1; }).find("tets"),
            std::string::npos);
}

}  // namespace
}  // namespace archetide
