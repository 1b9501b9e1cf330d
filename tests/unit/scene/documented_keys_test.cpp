#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "common/base/byte_stream.h"
#include "runtime/scene/scene_schema.h"

namespace archetide {
namespace {

TEST(SceneSchema, IsTheTableOfTheDocument) {
  const auto page = std::filesystem::path(__FILE__).parent_path() / "../../../docs/scenes.md";
  const std::string text = read_whole_file(page.string());
  std::istringstream lines(scene_schema().markdown());
  for (std::string line; std::getline(lines, line);)
    EXPECT_NE(text.find(line + "\n"), std::string::npos)
        << "docs/scenes.md lacks (archetide-sim schema --md): " << line;
}

}  // namespace
}  // namespace archetide
