#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "common/base/byte_stream.h"
#include "common/base/input_error.h"
#include "runtime/output/csv.h"
#include "runtime/output/manifest.h"
#include "runtime/output/run_tables.h"
#include "tests/unit/output/scratch_folder.h"
#include "tests/unit/output/shapes.h"

namespace archetide {
namespace {

// Names of the columns that a section of docs/files.md documents; `p*` stands for px, py, pz.
std::set<std::string> documented_columns(const std::string& section) {
  const auto root = std::filesystem::path(__FILE__).parent_path() / "../../..";
  const std::string text = read_whole_file((root / "docs/files.md").string());
  const auto begin = text.find("### " + section), end = text.find("\n### ", begin + 1);
  std::set<std::string> names;
  if (begin == std::string::npos) return names;
  std::istringstream lines(text.substr(begin, end - begin));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("| `")) continue;
    const std::string cell = line.substr(0, line.find('|', 1));
    for (std::size_t a = cell.find('`'); a != std::string::npos; a = cell.find('`', a + 1)) {
      const std::size_t b = cell.find('`', a + 1);
      const std::string name = cell.substr(a + 1, b - a - 1);
      a = b;
      if (!name.ends_with("*"))
        names.insert(name);
      else
        for (const char axis : {'x', 'y', 'z'})
          names.insert(name.substr(0, name.size() - 1) + axis);
    }
  }
  return names;
}

TEST(Csv, NumbersReadBackBitForBit) {
  const ScratchFolder folder;
  const std::vector<double> values = {1.0 / 3.0, -0.0, 6.02214076e23, 5e-324, M_PI, 1e22};
  CsvWriter csv(folder / "a.csv");
  csv.header({"value", "row"});
  for (std::size_t i = 0; i < values.size(); ++i) {
    csv.cell(values[i]).cell(static_cast<int>(i));
    csv.end_row();
  }
  csv.flush();
  EXPECT_EQ(read_csv(folder / "a.csv").column("value"), values);
}

TEST(Csv, AHalfWrittenLastRowIsLeftOutAndEmptyCellsAreNaN) {
  const ScratchFolder folder;
  std::ofstream(folder / "a.csv") << "a,b\n1,\n2,3\n4,";
  const CsvTable table = read_csv(folder / "a.csv");
  ASSERT_EQ(table.rows(), 2u);
  EXPECT_TRUE(std::isnan(table.column("b")[0]));
  EXPECT_EQ(table.column("b")[1], 3.0);
}

TEST(Csv, ARowOfAnotherLengthIsRefused) {
  const ScratchFolder folder;
  std::ofstream(folder / "a.csv") << "a,b\n1\n";
  EXPECT_THROW(read_csv(folder / "a.csv"), FileError);
}

TEST(BodiesTable, HeaderIsTheContract) {
  const ScratchFolder folder;
  ReducedBody body = rigid_body(tetrahedron_archetype());
  body.r = 2;
  BodiesTable table(folder / "bodies.csv", {body});
  table.flush();
  EXPECT_EQ(
      read_whole_file(folder / "bodies.csv"),
      "t,body,x,y,z,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz,px,py,pz,lx,ly,lz,fx,fy,fz,tx,ty,tz,q1,q2\n");
}

TEST(BodiesTable, VelocityAndSpinFollowFromTheMomenta) {
  const ScratchFolder folder;
  ReducedBody body = rigid_body(tetrahedron_archetype());
  body.mass_scale = 2.0;  // 4 kg, I = 1.6 kg m^2
  body.position = Vec3(1, 2, 3);
  body.rotation = Quat(0.5, 0.5, 0.5, 0.5);
  body.P = Vec3(4, 8, -2);
  body.L = Vec3(0.8, 0, 1.6);
  BodiesTable table(folder / "bodies.csv", {body});
  table.add(0.5, 0, body, Vec3(7, 8, 9), Vec3(1, 1, 2));
  table.flush();
  const CsvTable rows = read_csv(folder / "bodies.csv");
  const auto value = [&](const char* name) { return rows.column(name).at(0); };
  EXPECT_EQ(value("t"), 0.5);
  EXPECT_EQ(value("z"), 3.0);
  EXPECT_EQ(value("qw"), 0.5);
  EXPECT_DOUBLE_EQ(value("vx"), 1.0);
  EXPECT_DOUBLE_EQ(value("vz"), -0.5);
  EXPECT_NEAR(value("wx"), 0.5, 1e-15);
  EXPECT_NEAR(value("wz"), 1.0, 1e-15);
  EXPECT_EQ(value("py"), 8.0);
  EXPECT_EQ(value("lz"), 1.6);
  EXPECT_EQ(value("fz"), 9.0);
  EXPECT_EQ(value("tz"), 2.0);
}

TEST(BodiesTable, BodiesWithFewerModesLeaveCellsEmpty) {
  const ScratchFolder folder;
  ReducedBody rigid = rigid_body(tetrahedron_archetype()), widest = rigid;
  widest.r = 3;
  BodiesTable table(folder / "bodies.csv", {rigid, widest});
  table.add(0.0, 0, rigid, Vec3::Zero(), Vec3::Zero());
  table.flush();
  const std::string text = read_whole_file(folder / "bodies.csv");
  EXPECT_TRUE(text.ends_with(",0,,,\n")) << text;
}

TEST(StatsTable, SecondsOfAStepAreDifferencesByPhase) {
  const ScratchFolder folder;
  StatsTable table(folder / "stats.csv");
  Profile profile;
  StepReport step;
  profile.add("advect", 1.0);
  profile.add("advect/particles", 0.75);  // a part of "advect", not a phase next to it
  profile.add("solve", 2.0);
  table.add(step, profile);
  profile.add("solve", 4.0);
  profile.add("contact", 0.5);  // appears late: no column of its own
  table.add(step, profile);
  table.flush();
  const CsvTable rows = read_csv(folder / "stats.csv");
  EXPECT_EQ(rows.column("seconds"), (std::vector<double>{3.0, 4.5}));
  EXPECT_EQ(rows.column("seconds_advect"), (std::vector<double>{1.0, 0.0}));
  EXPECT_EQ(rows.column("seconds_solve"), (std::vector<double>{2.0, 4.0}));
  EXPECT_EQ(rows.column("seconds_other"), (std::vector<double>{0.0, 0.5}));
  EXPECT_FALSE(rows.has("seconds_advect/particles"));
}

TEST(StatsTable, MomentumIsThatOfWaterAndBodiesAndEnergyIsTheSum) {
  const ScratchFolder folder;
  StatsTable table(folder / "stats.csv");
  StepReport step;
  step.t = 0.25;
  step.water_momentum = Vec3(1, 2, 3), step.body_momentum = Vec3(10, 20, 30);
  step.water_kinetic = 1, step.body_kinetic = 2, step.body_elastic = 4, step.potential = 8;
  step.position.residual = 3e-9, step.velocity.residual = 1e-9;
  table.add(step, Profile());
  table.flush();
  const CsvTable rows = read_csv(folder / "stats.csv");
  EXPECT_EQ(rows.column("t").at(0), 0.25);
  EXPECT_EQ(rows.column("pz").at(0), 33.0);
  EXPECT_EQ(rows.column("water_pz").at(0), 3.0);
  EXPECT_EQ(rows.column("energy").at(0), 15.0);
  EXPECT_EQ(rows.column("residual").at(0), 3e-9);
}

TEST(StatsTable, EveryColumnIsDocumented) {
  const ScratchFolder folder;
  StatsTable table(folder / "stats.csv");
  Profile profile;
  for (const char* phase :
       {"positions", "contact", "surface", "advection", "velocities", "statistics", "markers"})
    profile.add(phase, 1.0);
  table.add(StepReport(), profile);
  table.flush();
  const std::set<std::string> documented = documented_columns("stats.csv");
  const CsvTable rows = read_csv(folder / "stats.csv");
  for (const std::string& name : rows.names)
    EXPECT_TRUE(documented.count(name)) << name << " is missing in docs/files.md";
  for (const std::string& name : documented)
    EXPECT_TRUE(rows.has(name)) << "docs/files.md names a column that is not written: " << name;
}

TEST(BodiesTable, EveryColumnIsDocumented) {
  const ScratchFolder folder;
  BodiesTable table(folder / "bodies.csv", {rigid_body(tetrahedron_archetype())});
  table.flush();
  const std::set<std::string> documented = documented_columns("bodies.csv");
  for (const std::string& name : read_csv(folder / "bodies.csv").names)
    EXPECT_TRUE(documented.count(name)) << name << " is missing in docs/files.md";
  EXPECT_TRUE(documented.count("q1") && documented.count("qr"));
}

TEST(Manifest, ReadsBackWhatWasWritten) {
  const ScratchFolder folder;
  Manifest m;
  m.version = "1.2.3", m.scene = "a \"quoted\" tub", m.command_line = "run x";
  m.grid.nx = 4, m.grid.ny = 5, m.grid.nz = 6, m.grid.dx = 0.1, m.grid.origin = Vec3(1, 2, 3);
  m.has_water = true;
  m.archetypes = {{"torus", "ff00", 100, 10, 5e6}};
  m.bodies = {{"b0", "torus", 1.5, 400.0, 10, 900.0}};
  m.worst_volume_drift = -1.0 / 3.0;
  m.phase_seconds = {{"solve", 2.5}};
  write_manifest(folder / "manifest.json", m);
  EXPECT_NE(read_whole_file(folder / "manifest.json").find("\"exit\": null"), std::string::npos);
  m.exit = 75;
  write_manifest(folder / "manifest.json", m);

  const Manifest back = read_manifest(folder / "manifest.json");
  EXPECT_EQ(back.scene, m.scene);
  EXPECT_EQ(back.exit, 75);
  EXPECT_EQ(back.grid.nz, 6);
  EXPECT_EQ(back.grid.dx, 0.1);
  EXPECT_EQ(back.grid.origin, m.grid.origin);
  ASSERT_EQ(back.bodies.size(), 1u);
  EXPECT_EQ(back.bodies[0].density, 400.0);
  ASSERT_EQ(back.archetypes.size(), 1u);
  EXPECT_EQ(back.archetypes[0].hash, "ff00");
  EXPECT_EQ(back.worst_volume_drift, m.worst_volume_drift);
  EXPECT_EQ(back.phase_seconds.at("solve"), 2.5);
}

TEST(Manifest, OtherJsonIsRefused) {
  const ScratchFolder folder;
  std::ofstream(folder / "manifest.json") << "{\"schema\": 1}";
  EXPECT_THROW(read_manifest(folder / "manifest.json"), FileError);
  std::ofstream(folder / "manifest.json") << "{";
  EXPECT_THROW(read_manifest(folder / "manifest.json"), FileError);
}

}  // namespace
}  // namespace archetide
