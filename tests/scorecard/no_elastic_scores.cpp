// Without the precompute.
#include "tests/scorecard/score.h"

namespace archetide {

std::vector<ScoreCase> elastic_scores() { return {}; }

}  // namespace archetide
