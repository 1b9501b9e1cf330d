#include "tests/bench/paper/paper_page.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "common/base/input_error.h"
#include "common/files/atomic_file.h"
#include "runtime/output/csv.h"
#include "tests/support/holds.h"
#include "tests/unit/output/scratch_folder.h"

namespace archetide {
namespace {

using Row = std::map<std::string, double>;

const char* const kColumns[] = {"t",
                                "halvings",
                                "seconds",
                                "iterations",
                                "iterations_position",
                                "water_volume",
                                "spray_volume",
                                "outflow_volume",
                                "volume_residual",
                                "px",
                                "py",
                                "pz",
                                "transported_px",
                                "transported_py",
                                "transported_pz",
                                "solid_px",
                                "solid_py",
                                "solid_pz",
                                "weight_px",
                                "weight_py",
                                "weight_pz",
                                "contact_px",
                                "contact_py",
                                "contact_pz",
                                "unmatched_px",
                                "unmatched_py",
                                "unmatched_pz",
                                "water_kinetic",
                                "body_kinetic",
                                "body_elastic",
                                "transported_kinetic",
                                "contact_energy",
                                "drag_energy",
                                "slowed_energy",
                                "held_energy",
                                "solved_energy",
                                "max_penetration",
                                "max_deformation"};

void write_stats(const std::string& path, const std::vector<Row>& rows) {
  CsvWriter csv(path);
  csv.header({std::begin(kColumns), std::end(kColumns)});
  for (const Row& row : rows) {
    for (const char* name : kColumns) csv.cell(row.count(name) ? row.at(name) : 0.0);
    csv.end_row();
  }
  csv.flush();
}

// Two frames of two steps and of one, in cells of 0.5 m.
const std::vector<Row> kRows = {{{"t", 0.05},
                                 {"halvings", 2},
                                 {"seconds", 1},
                                 {"iterations", 4},
                                 {"iterations_position", 2},
                                 {"water_volume", 2.0},
                                 {"px", 1.0},
                                 {"water_kinetic", 1}},
                                {{"t", 0.1},
                                 {"seconds", 2},
                                 {"iterations", 6},
                                 {"iterations_position", 4},
                                 {"water_volume", 1.9},
                                 {"spray_volume", 0.06},
                                 {"volume_residual", 0.04},
                                 {"px", 3.0},
                                 {"py", 4.0},
                                 {"weight_px", 2.0},
                                 {"unmatched_py", 4.0},
                                 {"water_kinetic", 3},
                                 {"body_kinetic", 4},
                                 {"body_elastic", 1},
                                 {"solved_energy", 0.5},
                                 {"drag_energy", -0.3},
                                 {"max_penetration", 0.3}},
                                {{"t", 0.2},
                                 {"seconds", 5},
                                 {"iterations", 9},
                                 {"iterations_position", 7},
                                 {"water_volume", 2.0},
                                 {"px", 1.0},
                                 {"pz", 0.5},
                                 {"solved_energy", -1},
                                 {"max_deformation", 0.2}}};

class PaperPage : public testing::Test {
 protected:
  // A run of the rows above; exit < 0: it goes on.
  void run(const std::string& name, int exit, const std::string& reason = "") const {
    std::filesystem::create_directories(folder_ / name);
    Manifest m;
    m.scene = name, m.exit = exit, m.reason = reason;
    m.grid.nx = m.grid.ny = m.grid.nz = 2, m.grid.dx = 0.5;
    m.fps = 10.0, m.end_time = 0.2, m.peak_bytes = 3 << 20, m.frames = 3;
    m.cpu_seconds = 12.0, m.wall_seconds = 7.0;
    write_manifest(folder_ / name + "/manifest.json", m);
    write_stats(folder_ / name + "/stats.csv", kRows);
    if (exit == kExitDone) write_file_atomically(folder_ / name + "/done.stamp", "now\n");
  }
  PaperRun read(const std::string& name, double goal = PaperFigures::kUnknown) const {
    return read_paper_run(folder_.path(), {name, "4", "tub", goal, "", "a <ring>"});
  }

  const ScratchFolder folder_;
};

TEST_F(PaperPage, FiguresAreThoseOfTheTables) {
  run("tub", kExitDone);
  const PaperFigures f = read("tub").figures;
  EXPECT_DOUBLE_EQ(f.seconds, 4.0);  // frames of 3 and 5 s
  EXPECT_DOUBLE_EQ(f.worst_seconds, 5.0);
  EXPECT_DOUBLE_EQ(f.iterations, 6.0);  // 4 and 8
  EXPECT_DOUBLE_EQ(f.worst_iterations, 9.0);
  EXPECT_NEAR(f.volume, 0.02, 1e-15);
  EXPECT_NEAR(f.kept, 0.0, 1e-15);
  EXPECT_DOUBLE_EQ(f.energy, 0.2 / 8.0);
  EXPECT_DOUBLE_EQ(f.regained, 0.2 / 8.0);
  EXPECT_EQ(f.steps, 3.0);
  EXPECT_EQ(f.halvings, 2.0);
  EXPECT_DOUBLE_EQ(f.cpu_seconds, 6.0);
  EXPECT_DOUBLE_EQ(f.unmatched, 4.0 / 5.0);
  EXPECT_DOUBLE_EQ(f.rest, 0.5 / 5.0);  // the last row's pz
  EXPECT_DOUBLE_EQ(f.overlap, 0.6);
  EXPECT_DOUBLE_EQ(f.deformation, 0.2);
}

TEST_F(PaperPage, BodiesThatAppearBringTheirMomentum) {
  run("tub", kExitDone);
  CsvWriter csv(folder_ / "tub/bodies.csv");
  csv.header({"t", "body", "z"});
  csv.cell(0.0).cell(0).cell(1.0).end_row();
  csv.cell(0.2).cell(0).cell(1.0).end_row();
  csv.cell(0.2).cell(1).cell(1.0).end_row();
  csv.flush();
  EXPECT_NEAR(read("tub").figures.rest, 0.0, 1e-15);
}

TEST_F(PaperPage, SaysHowEachRunEnded) {
  run("done", kExitDone), run("stopped", kExitStopped), run("going", -1);
  run("failed", kExitNumerics, "the energy is no longer finite");
  write_file_atomically(folder_ / "refused.refused", "torus.h5: no such file\n");
  EXPECT_EQ(read("none").state, PaperState::kNotRun);
  EXPECT_EQ(read("done").state, PaperState::kDone);
  EXPECT_EQ(read("stopped").state, PaperState::kUnfinished);
  EXPECT_EQ(read("going").state, PaperState::kUnfinished);
  const std::string page =
      paper_page({read("none"), read("stopped"), read("failed"), read("refused")}, false);
  EXPECT_TRUE(holds(page, "not run"));
  EXPECT_TRUE(holds(page, "not finished: 0.20 of 0.20 s"));
  EXPECT_TRUE(holds(page, "failed: the energy is no longer finite"));
  EXPECT_TRUE(holds(page, "failed: torus.h5: no such file"));
  EXPECT_TRUE(holds(page, "a &lt;ring&gt;"));
  EXPECT_FALSE(holds(page, ">nan"));
}

TEST_F(PaperPage, MissesAreShownAsMisses) {
  run("tub", kExitDone);
  const std::string missed = paper_table({read("tub", 3.0)}, false);
  EXPECT_TRUE(holds(missed, "| 4 | tub | 2 × 2 × 2 | **4.00 (goal 3.00)** | 5.00 | 15.0 | 6.0 |"))
      << missed;
  EXPECT_TRUE(holds(missed, "| **2.000 % (goal 0.100 %)** |")) << missed;
  EXPECT_TRUE(holds(missed, "| **0.60 (goal 0.50)** | 0.20 |")) << missed;
  EXPECT_TRUE(holds(missed, "In all 0:07 of wall time.")) << missed;
  EXPECT_TRUE(holds(paper_table({read("tub", 4.0)}, false), "| 4.00 |"));
  EXPECT_TRUE(holds(paper_table({read("tub", 3.0)}, true), "| 4.00 |"));  // coarse: no goal
}

TEST_F(PaperPage, ShowsThePapersMethodBesideOurs) {
  run("tub", kExitDone), run("tub_paper", kExitDone);
  EXPECT_TRUE(holds(paper_page({read("tub"), read("tub_paper")}, false), "beside ours: tub<"));
  EXPECT_FALSE(holds(paper_page({read("tub"), read("none")}, false), "beside ours"));
}

TEST_F(PaperPage, ScenesThatAreNoneAreRefusedByLine) {
  const std::string list = folder_ / "scenes.txt";
  write_file_atomically(
      list, "# head\ntub | 4 | tub | 3 | a=1 | b=2 | A ring\nrock | 5 | - | - | | | x\n");
  const std::vector<PaperScene> scenes = read_paper_scenes(list);
  ASSERT_EQ(scenes.size(), 2u);
  EXPECT_EQ(scenes[0].settings, "a=1");
  EXPECT_EQ(scenes[0].shows, "A ring");
  EXPECT_EQ(scenes[0].goal, 3.0);
  EXPECT_TRUE(std::isnan(scenes[1].goal));
  for (const char* line : {"tub | 4 | tub\n", "tub | 4 | tub | fast | | | x\n"}) {
    write_file_atomically(list, std::string("# head\n") + line);
    try {
      read_paper_scenes(list);
      ADD_FAILURE() << line;
    } catch (const InputError& e) {
      EXPECT_TRUE(holds(e.what(), "scenes.txt:2: ")) << e.what();
    }
  }
}

}  // namespace
}  // namespace archetide
