#pragma once

#include <string>

namespace archetide {

/// Joins pictures/frame.NNNNNN.png, from number `first` on, into `film` (H.264, else MPEG-4) with
/// ffmpeg. Returns an empty string on success, otherwise one line that says why there is no film.
std::string make_film(const std::string& pictures_folder, int first, int count, double fps,
                      const std::string& film);

}  // namespace archetide
