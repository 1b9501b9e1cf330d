#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "common/base/byte_stream.h"
#include "precompute/recipe.h"

namespace archetide {
namespace {

TEST(BodySchema, IsTheTableOfTheDocument) {
  const auto page = std::filesystem::path(__FILE__).parent_path() / "../../../docs/bodies.md";
  const std::string text = read_whole_file(page.string());
  std::istringstream lines(body_schema().markdown());
  for (std::string line; std::getline(lines, line);)
    EXPECT_NE(text.find(line + "\n"), std::string::npos)
        << "docs/bodies.md lacks (archetide-precompute schema --md): " << line;
}

}  // namespace
}  // namespace archetide
