// The program as it is called.

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>

#include "common/archetype/skin.h"
#include "precompute_test_meshes.h"

namespace archetide {
namespace {

using testing_meshes::ScratchFolder;

struct Answer {
  int exit_code;
  std::string text;  // stdout and stderr
};

/// `before`: what the shell does before, or an empty text.
Answer program(const std::string& arguments, const std::string& before = "") {
  const std::string command = before + ARCHETIDE_PRECOMPUTE_BIN + " " + arguments + " 2>&1";
  FILE* pipe = ::popen(command.c_str(), "r");
  Answer answer{-1, ""};
  if (!pipe) return answer;
  std::array<char, 512> buffer;
  while (std::fgets(buffer.data(), buffer.size(), pipe)) answer.text += buffer.data();
  answer.exit_code = WEXITSTATUS(::pclose(pipe));
  return answer;
}

TEST(CommandLine, UnknownVerbsAreAnsweredWithAList) {
  const Answer answer = program("biuld");
  EXPECT_EQ(answer.exit_code, 2);
  EXPECT_NE(answer.text.find("did you mean 'build'? Known verbs: build check info"),
            std::string::npos)
      << answer.text;
}

TEST(CommandLine, EndsHoweverLittleAddressSpaceThereIs) {
  constexpr int kTimedOut = 124;  // of `timeout`
  for (int megabytes = 150; megabytes <= 400; megabytes += 20) {
    const std::string limit = fmt::format("ulimit -v {}; timeout 10 ", 1024 * megabytes);
    ASSERT_NE(program("schema", limit).exit_code, kTimedOut) << megabytes << " MB";
  }
}

TEST(CommandLine, EachVerbHasExamplesOfItsOwn) {
  for (const std::string verb : {"build", "check", "info", "export", "report", "propose", "schema"})
    EXPECT_NE(program(verb + " -h").text.find("  archetide-precompute " + verb), std::string::npos)
        << verb;
}

TEST(CommandLine, AReportOfSkinsAloneIsRefused) {
  const ScratchFolder folder;
  Skin skin;
  skin.name = "skin", skin.generator = "test", skin.recipe = "", skin.mesh_file = "a.obj";
  skin.surface.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  skin.surface.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  skin.blend = 0.1, skin.parts = {"a"};
  skin.part_of.assign(4, {});
  skin.weights.assign(16, 0.0);
  for (int v = 0; v < 4; ++v) skin.weights[4 * v] = 1.0;
  const std::string path = folder.file("skin.h5"), page = folder.file("page.html");
  write_skin(path, skin);
  const Answer answer = program("report " + path + " -o " + page);
  EXPECT_EQ(answer.exit_code, 2) << answer.text;
  EXPECT_FALSE(std::filesystem::exists(page));
}

TEST(CommandLine, BuildMakesTheFolderOfItsOutput) {
  const ScratchFolder folder;
  const std::string output = folder.file("new/folders/a.h5");
  const Answer answer = program("build " + folder.file("no_such.body.toml") + " -o " + output);
  EXPECT_EQ(answer.exit_code, 4) << answer.text;
  EXPECT_TRUE(std::filesystem::is_directory(folder.file("new/folders")));
}

/// A bar of tets as Medit text.
std::string medit_bar() {
  const TetMesh bar = shapes::tet_box(6, 2, 1, 0.05);
  std::ostringstream text;
  text << "MeshVersionFormatted 2\nDimension 3\nVertices\n" << bar.nodes.size() << '\n';
  for (const Vec3& x : bar.nodes) text << x.transpose() << " 0\n";
  text << "Tetrahedra\n" << bar.tets.size() << '\n';
  for (const auto& tet : bar.tets) {
    for (const int node : tet) text << node + 1 << ' ';
    text << "0\n";
  }
  return text.str() + "End\n";
}

TEST(CommandLine, ProposeWritesAFileThatIsNotThereYet) {
  const ScratchFolder folder;
  folder.write("bar.mesh", medit_bar());
  const std::string output = folder.file("new/bar.body.toml");
  const std::string words = "propose " + folder.file("bar.mesh") + " -o " + output;
  const Answer first = program(words);
  EXPECT_EQ(first.exit_code, 0) << first.text;
  EXPECT_NE(first.text.find("first mode"), std::string::npos) << first.text;
  const std::string text = read_whole_file(output);
  EXPECT_NE(text.find("mesh = \"../bar.mesh\"\n"), std::string::npos) << text;
  const Answer second = program(words + " --density 900");
  EXPECT_EQ(second.exit_code, 2);
  EXPECT_NE(second.text.find("is there already"), std::string::npos) << second.text;
  EXPECT_EQ(read_whole_file(output), text);
  EXPECT_EQ(
      program("propose " + folder.file("gone.off") + " -o " + folder.file("b.body.toml")).exit_code,
      4);
  EXPECT_FALSE(std::filesystem::exists(folder.file("b.body.toml")));
}

TEST(CommandLine, ProposePrintsNothingButTheFile) {
  const ScratchFolder folder;
  const std::string mesh = folder.write("bar.mesh", medit_bar());
  const Answer answer = program("propose -q -- " + mesh);
  EXPECT_EQ(answer.exit_code, 0);
  EXPECT_TRUE(answer.text.starts_with("# 0.")) << answer.text;
  EXPECT_EQ(program("check " + folder.write("bar.body.toml", answer.text)).exit_code, 0);
}

}  // namespace
}  // namespace archetide
