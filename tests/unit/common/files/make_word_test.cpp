#include "common/files/make_word.h"

#include <gtest/gtest.h>

#include "common/base/input_error.h"

namespace archetide {
namespace {

std::string refusal(const std::string& name) {
  try {
    make_word(name);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(MakeWord, EscapesWhatMakeWouldSplitOrExpand) {
  EXPECT_EQ(make_word("a/my duck.obj"), "a/my\\ duck.obj");
  EXPECT_EQ(make_word("c:/a#1$x.obj"), "c\\:/a\\#1$$x.obj");
  EXPECT_EQ(make_word("T\xC3\xBCr-1_2.3,+@~!.obj"), "T\xC3\xBCr-1_2.3,+@~!.obj");
}

TEST(MakeWord, NamesThatAreMakefilesThemselvesAreRefused) {
  for (const std::string name : {"x=1\nSIM=touch\tX;true\nz=",
                                 "a\tb",
                                 "a\rb",
                                 "a%b",
                                 "a=b",
                                 "a;b",
                                 "a|b",
                                 "a&b",
                                 "a*b",
                                 "a?b",
                                 "a[b]",
                                 "a\\b",
                                 "a'b",
                                 "a\"b",
                                 "a`touch x`",
                                 "$(shell touch x)",
                                 "a(b)",
                                 "~x",
                                 ".PHONY",
                                 ""})
    EXPECT_NE(refusal(name), "") << name;
  const std::string text = refusal("two\nlines.obj");
  EXPECT_EQ(text.find("two\\x0alines.obj: error: make cannot handle this file name"), 0u) << text;
}

TEST(MakeFragment, RefusesATargetThatMakeCannotHandle) {
  EXPECT_THROW(make_fragment("a\nb", {"c"}), InputError);
  EXPECT_EQ(make_fragment("a", {"b c"}), "a: \\\n  b\\ c\n\nb\\ c:\n");
}

}  // namespace
}  // namespace archetide
