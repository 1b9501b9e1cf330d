#include "runtime/output/run_info.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/base/input_error.h"
#include "tests/unit/output/scratch_folder.h"

namespace archetide {
namespace {

Manifest two_rings_and_a_rock() {
  Manifest m;
  m.scene = "rings";
  m.grid = {64, 64, 32, 0.125};
  m.has_water = true;
  m.bodies = {{"a", "torus", 1.0, 500.0, 11, 1.0},
              {"b", "torus", 1.0, 500.0, 11, 1.0},
              {"c", "rock", 9.0, 2000.0, 0, 1.0}};
  m.time = 2.0, m.end_time = 4.0, m.frames = 49, m.steps = 60, m.wall_seconds = 96.0;
  return m;
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(RunInfo, TellsWhatRanAndHowFarItIs) {
  const ScratchFolder folder;
  write_manifest(folder / "manifest.json", two_rings_and_a_rock());
  const std::string text = run_info_text(open_run_folder(folder.path()));
  for (const char* part :
       {"going on", "64 x 64 x 32 cells of 0.125 m, water", "1 rock (rigid), 2 torus (11 modes)",
        "2 of 4 s, 49 frames, 60 steps", "2.00 s a frame on 1 thread", "checkpoint  none",
        "0 frames, 0 pictures"})
    EXPECT_TRUE(has(text, part)) << part << " is not in\n" << text;
}

TEST(RunInfo, TellsHowItEnded) {
  const ScratchFolder folder;
  Manifest m = two_rings_and_a_rock();
  const auto state = [&](int exit, const char* reason) {
    m.exit = exit, m.reason = reason;
    write_manifest(folder / "manifest.json", m);
    const std::string text = run_info_text(open_run_folder(folder.path()));
    return text.substr(0, text.find('\n'));
  };
  EXPECT_EQ(state(kExitStopped, ""), "state       stopped");
  EXPECT_EQ(state(kExitNumerics, "it blew up"), "state       failed: it blew up");
  std::ofstream(folder / "done.stamp");
  EXPECT_EQ(state(kExitDone, ""), "state       done");
  const std::string json = run_info_json(open_run_folder(folder.path()));
  for (const char* part : {"\"scene\": \"rings\"", "\"state\": \"done\"", "\"checkpoint\": null",
                           "\"frames_on_disk\": 0"})
    EXPECT_TRUE(has(json, part)) << part << " is not in\n" << json;
}

}  // namespace
}  // namespace archetide
