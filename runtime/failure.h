#pragma once

#include <fmt/core.h>

#include <optional>
#include <string>

#include "common/base/input_error.h"
#include "common/base/types.h"

namespace archetide {

/// What the numbers broke at, as far as it is known.
struct Culprit {
  int body = -1;              // index
  int mode = -1;              // of that body, from 0
  std::optional<Vec3i> cell;  // of the water
  int joint = -1;             // index, from 0; of `body` and ..
  int other_body = -1;        // .. this one, or -1: the world

  /// "body 3, mode 2, cell [4, 5, 6]", "joint 0, body 3, body 4"; "" when nothing is known.
  std::string text() const {
    std::string out;
    const auto add = [&](const std::string& part) { out += (out.empty() ? "" : ", ") + part; };
    if (joint >= 0) add(fmt::format("joint {}", joint));
    if (body >= 0) add(fmt::format("body {}", body));
    if (other_body >= 0) add(fmt::format("body {}", other_body));
    if (joint >= 0 && other_body < 0) add("the world");
    if (mode >= 0) add(fmt::format("mode {}", mode + 1));
    if (cell) add(fmt::format("cell [{}, {}, {}]", (*cell)[0], (*cell)[1], (*cell)[2]));
    return out;
  }
};

/// A run that cannot or must not go on (exit 3). `what` names the culprit and the time.
struct SimulationFailure : NumericsError {
  SimulationFailure(const std::string& quantity_, const std::string& what, double time_,
                    Culprit culprit_)
      : NumericsError(fmt::format("{} at t = {:f} s{}", what, time_,
                                  culprit_.text().empty() ? "" : " (" + culprit_.text() + ")")),
        quantity(quantity_),
        time(time_),
        culprit(std::move(culprit_)) {}

  std::string quantity;  // "limits.speed", "convergence", "finite", ...
  double time;           // s
  Culprit culprit;
};

}  // namespace archetide
