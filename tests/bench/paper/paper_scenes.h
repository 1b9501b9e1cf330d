#pragma once

#include <limits>
#include <string>
#include <vector>

namespace archetide {

/// A line of tests/bench/paper/scenes.txt: one run for one figure of the paper.
struct PaperScene {
  std::string name;    // of the run and its folder; NAME_paper is compared with NAME
  std::string figure;  // of the paper
  std::string scene;   // file in assets/scenes, without .scene.toml
  double goal = std::numeric_limits<double>::quiet_NaN();  // mean s a frame, two cores; NaN: none
  std::string settings;  // key=value words beside what the file says
  std::string shows;     // what to look for
};

/// Throws FileError when there is no such file, InputError with the line of what is no such line.
std::vector<PaperScene> read_paper_scenes(const std::string& path);

}  // namespace archetide
