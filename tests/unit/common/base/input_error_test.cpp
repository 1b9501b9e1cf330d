#include "common/base/input_error.h"

#include <gtest/gtest.h>

namespace archetide {
namespace {

TEST(Diagnostic, ShowsFileLineColumnAndHint) {
  const Diagnostic d{{"a.toml", 3, 7}, "unknown key 'cel'", "did you mean 'cell'?"};
  EXPECT_EQ(d.text(), "a.toml:3:7: error: unknown key 'cel'\n  did you mean 'cell'?");
}

TEST(Diagnostic, LeavesOutWhatIsUnknown) {
  EXPECT_EQ((Diagnostic{{"--set body.modes", 0, 0}, "bad", ""}).text(),
            "--set body.modes: error: bad");
  EXPECT_EQ((Diagnostic{{}, "bad", ""}).text(), "error: bad");
}

TEST(InputError, CarriesAllButPrintsTwenty) {
  const InputError error(std::vector<Diagnostic>(25, Diagnostic{{}, "bad", ""}));
  EXPECT_EQ(error.diagnostics.size(), 25u);
  EXPECT_EQ(error.exit_code, kExitInput);
  const std::string text = error.what();
  std::size_t printed = 0;
  for (std::size_t at = 0; (at = text.find("error: bad", at)) != std::string::npos; ++at) ++printed;
  EXPECT_EQ(printed, 20u);
  EXPECT_NE(text.find("(and 5 more errors)"), std::string::npos);
}

TEST(Errors, MapToTheirExitCodes) {
  EXPECT_EQ(NumericsError("x").exit_code, 3);
  EXPECT_EQ(FileError("x").exit_code, 4);
  EXPECT_EQ(MachineError("x").exit_code, 5);
}

TEST(ClosestMatch, FindsTyposAndSwappedLetters) {
  EXPECT_EQ(closest_match("densty", {"density", "young", "poisson"}), "density");
  EXPECT_EQ(closest_match("rnu", {"run", "render", "report"}), "run");
  EXPECT_EQ(closest_match("cel", {"grid", "cell"}), "cell");
}

TEST(ClosestMatch, PrefersTheNearerCandidate) {
  EXPECT_EQ(closest_match("position", {"positions", "position"}), "position");
}

TEST(ClosestMatch, IsSilentWhenNothingIsNear) {
  EXPECT_EQ(closest_match("viscosity", {"density", "young", "poisson"}), "");
  EXPECT_EQ(closest_match("x", {}), "");
}

}  // namespace
}  // namespace archetide
