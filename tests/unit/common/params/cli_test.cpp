#include "common/params/cli.h"

#include <gtest/gtest.h>

#include "common/base/input_error.h"

namespace archetide {
namespace {

/// What is logged when `work` fails.
std::string log_of(const std::function<int()>& work) {
  testing::internal::CaptureStderr();
  guarded_main(work);
  return testing::internal::GetCapturedStderr();
}

TEST(Cli, EveryErrorSaysSoOnce) {
  EXPECT_EQ(log_of([]() -> int { throw FileError("a.h5: missing"); }), "error: a.h5: missing\n");
  const std::string located = Diagnostic{{"--set x", 0, 0}, "no such file", "build it"}.text();
  EXPECT_EQ(log_of([&]() -> int { throw FileError(located); }),
            "--set x: error: no such file\n  build it\n");
  EXPECT_EQ(log_of([]() -> int { throw InputError("bad word", "hint"); }),
            "error: bad word\n  hint\n");
}

TEST(Cli, AnUnknownVerbIsAnsweredWithAList) {
  const std::string text = unknown_verb("biuld", {"build", "check"}).what();
  EXPECT_EQ(text, "error: unknown verb 'biuld'\n  did you mean 'build'? Known verbs: build check");
  EXPECT_NE(std::string(unknown_verb("zzz", {"build"}).what()).find("known verbs: build"),
            std::string::npos);
}

TEST(Cli, NumbersOutOfRangeAreNamedShortly) {
  EXPECT_EQ(number_message("0.5", Numbers::kPositive), "");
  EXPECT_EQ(number_message("0", Numbers::kNonNegative), "");
  for (const char* text : {"0", "-1", "nan", "inf", "1x", ""})
    EXPECT_EQ(number_message(text, Numbers::kPositive), std::string(text) + " is not a number above 0");
}

}  // namespace
}  // namespace archetide
