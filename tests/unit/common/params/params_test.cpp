#include "common/params/params.h"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

#include "common/base/check.h"
#include "common/params/param_tree.h"

namespace archetide {
namespace {

// One key of every type, a required one, a range, choices, a refused feature, a section that may be
// absent.
const Schema& sample_schema() {
  static const Schema schema(
      "sample.toml",
      {{.path = "schema", .type = KeyType::kInteger, .fallback = "required", .meaning = "always 1"},
       {.path = "name", .type = KeyType::kString, .fallback = "\"unnamed\"", .meaning = "a label"},
       {.path = "gravity", .type = KeyType::kVec3, .unit = "m/s^2", .fallback = "[0, 0, -9.81]"},
       {.path = "material.density", .unit = "kg/m^3", .range = above(0), .fallback = "required"},
       {.path = "material.poisson", .range = {-1, 0.5, true, true}, .fallback = "0.3"},
       {.path = "fluid",
        .type = KeyType::kTable,
        .fallback = "absent",
        .meaning = "absent = no water"},
       {.path = "fluid.grid",
        .type = KeyType::kIntVec3,
        .range = between(1, 4096),
        .fallback = "required"},
       {.path = "fluid.cell", .unit = "m", .range = above(0), .fallback = "required"},
       {.path = "fluid.geometry",
        .type = KeyType::kString,
        .fallback = "\"cut-cell\"",
        .choices = {"cut-cell", "voxel"}},
       {.path = "fluid.exact", .type = KeyType::kBool, .fallback = "true"},
       {.path = "body[].modes",
        .type = KeyType::kIntegerOrString,
        .range = between(0, 1000),
        .fallback = "absent",
        .choices = {"all"},
        .later = "full bodies",
        .later_values = {"full"}},
       {.path = "body[].position", .type = KeyType::kVec3, .unit = "m", .fallback = "required"},
       {.path = "frames",
        .type = KeyType::kStrings,
        .fallback = "[\"surface.ply\"]",
        .choices = {"surface.ply", "bodies.vtp"},
        .later = "this kind of frame",
        .later_values = {"surface.vdb"}},
       {.path = "box", .type = KeyType::kPoints, .unit = "m", .fallback = "absent"},
       {.path = "joint[]",
        .type = KeyType::kTables,
        .fallback = "absent",
        .meaning = "refused",
        .later = "joints"}});
  return schema;
}

Document parse(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return Document::parse(text, "f.toml", sample_schema(), overrides);
}

// A complete valid file with `extra` lines at the top level.
std::string file_with(const std::string& extra, const std::string& tail = "") {
  return "schema = 1\n" + extra + "\n[material]\ndensity = 400\n" + tail;
}

// All complaints about a text, one diagnostic a line.
std::string complaints(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    parse(text, overrides);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "'" << part << "' is not in:\n" << text;
}

TEST(Params, GivesTypedValuesAndDefaults) {
  const Section root = parse(file_with("box = [[0, 0, 0], [\"1/2\", 2, 3]]", R"(
    [fluid]
    grid = [8, 16, 32]
    cell = "1/192"
    [[body]]
    position = [1, 2, 3]
    modes = 7
    [[body]]
    position = [4, 5, 6.5]
    modes = "all"
  )"))
                           .root();
  EXPECT_EQ(root.string("name"), "unnamed");
  EXPECT_EQ(root.vec3("gravity"), Vec3(0, 0, -9.81));
  EXPECT_EQ(root.number("material.density"), 400.0);
  EXPECT_EQ(root.number("material.poisson"), 0.3);
  EXPECT_EQ(root.points("box")[1], Vec3(0.5, 2, 3));
  EXPECT_EQ(root.strings("frames"), std::vector<std::string>{"surface.ply"});
  const Section fluid = root.section("fluid");
  EXPECT_EQ(fluid.int_vec3("grid"), Vec3i(8, 16, 32));
  EXPECT_DOUBLE_EQ(fluid.number("cell"), 1.0 / 192.0);
  EXPECT_TRUE(fluid.boolean("exact"));
  const std::vector<Section> bodies = root.sections("body");
  ASSERT_EQ(bodies.size(), 2u);
  EXPECT_EQ(bodies[0].integer("modes"), 7);
  EXPECT_TRUE(bodies[1].is_string("modes"));
  EXPECT_EQ(bodies[1].vec3("position"), Vec3(4, 5, 6.5));
  EXPECT_EQ(bodies[1].shown("modes"), "body[1].modes");
  EXPECT_EQ(bodies[1].location("modes").line, 14);
}

TEST(Params, AbsentSectionsAreSeenAsAbsent) {
  const Section root = parse(file_with("")).root();
  EXPECT_FALSE(root.has("fluid"));
  EXPECT_FALSE(root.has("body"));
  EXPECT_TRUE(root.sections("body").empty());
  EXPECT_THROW(root.vec3("box"), AssertionError);  // absent and without default: the caller's bug
  EXPECT_THROW(root.has("fliud"), AssertionError);
}

TEST(Params, UnknownKeyNamesTheNearestOne) {
  expect_contains(complaints(file_with("", "[fluid]\ngrid = [1, 1, 1]\ncel = 0.1\n")),
                  "f.toml:7:1: error: unknown key 'fluid.cel'\n  did you mean 'fluid.cell'?");
  expect_contains(complaints(file_with("colour = 3")), "known here:");
}

TEST(Params, WrongTypeSaysWhatIsExpected) {
  const std::string text = complaints(file_with("gravity = 9.81\nname = 3"));
  expect_contains(
      text, "f.toml:2:11: error: gravity: 9.81 has the wrong type\n  expected [x, y, z] in m/s^2");
  expect_contains(text, "f.toml:3:8: error: name: 3 has the wrong type");
  expect_contains(complaints(file_with("", "[fluid]\ngrid = [1, 1.5, 1]\ncell = 1\n")),
                  "fluid.grid");
  expect_contains(complaints(file_with("", "[[fluid]]\ngrid = [1, 1, 1]\n")), "fluid: a list of 1");
  expect_contains(complaints(file_with("frames = [1]")), "frames: a list of 1 has the wrong type");
  expect_contains(complaints(file_with("name = 1979-05-27")), "a date or time");
}

TEST(Params, OutOfRangeAndNotANumberAreRefused) {
  expect_contains(complaints("schema = 1\nmaterial = { density = 0, poisson = 0.5 }\n"),
                  "material.density: 0 is out of range");
  expect_contains(complaints("schema = 1\nmaterial = { density = 1, poisson = 0.5 }\n"),
                  "material.poisson: 0.5 is out of range\n  expected number, (-1, 0.5)");
  for (const char* bad : {"nan", "inf", "-inf", "\"nan\"", "\"1/0\"", "\"0/0\""}) {
    EXPECT_NE(complaints("schema = 1\nmaterial = { density = " + std::string(bad) + " }\n"), "")
        << bad;
  }
  expect_contains(complaints(file_with("gravity = [0, 0, inf]")), "gravity: inf is out of range");
  expect_contains(
      complaints(file_with("schema2 = 1\n[[body]]\nposition = [0,0,0]\nmodes = 99999999999")),
      "body[0].modes");
}

TEST(Params, FractionsInQuotesAreNumbers) {
  const auto cell = [](const std::string& value) {
    return parse(file_with("", "[fluid]\ngrid = [1, 1, 1]\ncell = " + value))
        .root()
        .number("fluid.cell");
  };
  EXPECT_DOUBLE_EQ(cell("\"1/192\""), 1.0 / 192.0);
  EXPECT_DOUBLE_EQ(cell("\"0.5\""), 0.5);
  EXPECT_DOUBLE_EQ(cell("\"1e1/4\""), 2.5);
  EXPECT_THROW(cell("\"1/2/3\""), InputError);
  EXPECT_THROW(cell("\"1/\""), InputError);
  EXPECT_THROW(cell("\"wide\""), InputError);
}

TEST(Params, ChoicesAreCheckedWithSuggestion) {
  expect_contains(
      complaints(file_with("", "[fluid]\ngrid = [1, 1, 1]\ncell = 1\ngeometry = \"vozel\"")),
      "did you mean \"voxel\"?");
  expect_contains(complaints(file_with("frames = [\"surface.plx\"]")),
                  "did you mean \"surface.ply\"?");
}

TEST(Params, MissingKeysAreNamedOnlyWhereTheirSectionIs) {
  const std::string text = complaints("schema = 1\n[fluid]\n");
  expect_contains(text, "missing key 'material.density'");
  expect_contains(text, "f.toml:2:1: error: missing key 'fluid.grid'");
  expect_contains(text, "missing key 'fluid.cell'");
  EXPECT_EQ(complaints(file_with("")), "");  // no [fluid]: nothing of it is missing
  expect_contains(complaints(file_with("", "[[body]]\nmodes = 0\n")),
                  "missing key 'body[0].position'");
}

TEST(Params, AllErrorsComeAtOnce) {
  try {
    parse("schema = 1\ntypo = 1\ngravity = 1\nmaterial = { density = -1 }\n[[joint]]\n");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(error.diagnostics.size(), 4u);
  }
}

TEST(Params, FeaturesOfLaterVersionsAreRefusedByName) {
  expect_contains(complaints(file_with("[[joint]]\nbodies = [\"a\", \"b\"]")),
                  "f.toml:2:3: error: not in this version: joints ([[joint]])");
  expect_contains(complaints(file_with("", "[[body]]\nposition = [0, 0, 0]\nmodes = \"full\"")),
                  "not in this version: full bodies (body[0].modes = \"full\")");
  expect_contains(complaints(file_with("frames = [\"surface.vdb\"]")), "not in this version");
}

TEST(Params, SchemaKeyComesFirstAndIsKnown) {
  expect_contains(complaints("material = { density = 1 }\n"), "missing key 'schema'");
  expect_contains(complaints("schema = 2\nmaterial = { density = 1 }\n"), "schema 2 is not known");
  expect_contains(complaints("name = \"a\"\nschema = 1\nmaterial = { density = 1 }\n"),
                  "must be the first");
}

TEST(Params, UnreadKeysAreFound) {
  const Document document = parse(file_with("name = \"a\""));
  EXPECT_EQ(document.unread(),
            (std::vector<std::string>{"f.toml:2:1: name", "f.toml:3:2: material"}));
  document.root().string("name");
  document.root().section("material");
  EXPECT_EQ(document.unread(), std::vector<std::string>{"f.toml:4:1: material.density"});
  EXPECT_THROW(document.check_all_read(), AssertionError);
  document.root().number("material.density");
  EXPECT_NO_THROW(document.check_all_read());
}

TEST(Overrides, ReplaceAddAndReachIntoLists) {
  const std::string text =
      file_with("", "[[body]]\nposition = [0, 0, 0]\nmodes = 5\n[[body]]\nposition = [1, 1, 1]\n");
  const auto modes = [&](const std::string& override, int body) {
    return parse(text, {override}).root().sections("body")[body].integer("modes");
  };
  EXPECT_EQ(modes("body[0].modes=0", 0), 0);
  EXPECT_EQ(modes("body.modes=3", 0), 3);
  EXPECT_EQ(modes("body.modes=3", 1), 3);
  const Section root = parse(text, {"material.density=\"1/4\"", "name=tub", "fluid.cell=0.5",
                                    "fluid.grid=[2, 2, 2]", "frames=[\"bodies.vtp\"]"})
                           .root();
  EXPECT_EQ(root.number("material.density"), 0.25);
  EXPECT_EQ(root.string("name"), "tub");  // a bare word is a string
  EXPECT_EQ(root.int_vec3("fluid.grid"), Vec3i(2, 2, 2));
  EXPECT_EQ(root.strings("frames"), std::vector<std::string>{"bodies.vtp"});
  EXPECT_EQ(root.location("name").file, "--set name");
}

TEST(Overrides, AbsentTakesAKeyAway) {
  const std::string text = file_with("name = \"a\"", "[[body]]\nposition = [0, 0, 0]\nmodes = 5\n");
  EXPECT_FALSE(parse(text, {"name=absent"}).root().has("name"));
  EXPECT_FALSE(parse(text, {"body.modes=absent"}).root().sections("body")[0].has("modes"));
  expect_contains(complaints(text, {"nam=absent"}), "there is no 'nam' to take away");
  expect_contains(complaints(text, {"schema=absent"}), "schema");  // it is required
}

TEST(Overrides, AreValidatedLikeTheFile) {
  const std::string text = file_with("");
  expect_contains(complaints(text, {"material.densty=1"}),
                  "--set material.densty: error: unknown key 'material.densty'\n  did you mean "
                  "'material.density'?");
  expect_contains(complaints(text, {"material.density=-1"}), "--set material.density: error: ");
  expect_contains(complaints(text, {"body[0].modes=1"}), "there is no body[0]");
  expect_contains(complaints(text, {"name"}), "expected key=value");
  expect_contains(complaints(text, {"body[x].modes=1"}), "cannot read the path");
  expect_contains(complaints(text, {"=1"}), "cannot read the path");
  expect_contains(complaints(text, {"schema.x=1"}), "no table");
}

TEST(Overrides, WordsThatAreNoUtf8AreRefused) {
  EXPECT_EQ(complaints(file_with(""), {"name=T\xC3\xBC\xE2\x82\xAC\xF0\x9F\x90\x9F"}), "");
  for (const std::string bad :
       {"\xff", "\xC3", "\xC0\x80", "\x80", "\xE2\x82x", "\xF5\x80\x80\x80"})
    expect_contains(complaints(file_with(""), {"name=" + bad}), "not UTF-8");
}

TEST(Overrides, TextOfWhatRanReadsBackToTheSame) {
  const std::string text = file_with(
      "name = \"a \\\" \\n \\\\ b\"\nframes = [\"bodies.vtp\"]",
      "[[body]]\nposition = [0.1, 1e-300, 3]\nmodes = 5\n[[body]]\nposition = [1, 1, 1]\n");
  EXPECT_EQ(parse(text).text(), text);
  const std::vector<std::string> overrides = {"body.modes=2", "material.density=0.1"};
  const Document first = parse(text, overrides);
  const Document second = parse(first.text());
  EXPECT_EQ(to_toml(parse_param_text(second.text(), "f")), first.text());
  EXPECT_EQ(second.root().string("name"), "a \" \n \\ b");
  EXPECT_EQ(second.root().number("material.density"), 0.1);
  EXPECT_EQ(second.root().sections("body")[0].vec3("position"), Vec3(0.1, 1e-300, 3));
  EXPECT_EQ(second.root().sections("body")[1].integer("modes"), 2);
}

TEST(Parser, SyntaxErrorsHaveAPlace) {
  expect_contains(complaints("schema = 1\nname = \n"), "f.toml:2:8: error:");
  expect_contains(complaints("schema = 1\nschema = 1\n"), "f.toml:2");
}

TEST(Parser, ByteOrderMarkAndForeignBareKeysAreRefusedBeforeParsing) {
  expect_contains(complaints("\xEF\xBB\xBFschema = 1\n"), "byte order mark");
  expect_contains(complaints("\xEF\xBB\xBF"), "byte order mark");
  expect_contains(complaints("schema = 1\nh\xC3\xB6he = 1\n"), "f.toml:2:2: error: non-ASCII");
  expect_contains(complaints(std::string("schema = 1\n\0", 12)), "not a text file");
}

TEST(Parser, ForeignCharactersAreFineInStringsAndComments) {
  const std::string odd = "name = \"T\xC3\xBC\\\" r\" # \xC3\xA4 'quote\n";
  EXPECT_EQ(parse(file_with(odd)).root().string("name"), "T\xC3\xBC\" r");
  EXPECT_EQ(complaints(file_with("name = '''\n\xC3\xA4''' # \"\xC3\xA4\n")), "");
}

TEST(Parser, TextThatTheParserHoldsImpossibleIsASyntaxError) {
  expect_contains(complaints("[."), "f.toml:1:2: error: this is no TOML");
  expect_contains(complaints("a=[}"), "f.toml:1:4: error: this is no TOML");
  expect_contains(complaints("schema = 1\nname = \"\xC3\xA4\"\na = [}\n"), "f.toml:3:6: error:");
  EXPECT_EQ(parse(file_with(""), {"name=[}"}).root().string("name"), "[}");
}

TEST(Parser, EmptyFileLacksItsKeys) {
  const std::string path = fmt::format("{}empty_{}.toml", testing::TempDir(), ::getpid());
  std::ofstream(path).flush();
  EXPECT_EQ(read_param_file(path), "");
  EXPECT_THROW(Document::read(path, sample_schema()), InputError);
  std::remove(path.c_str());
}

TEST(Parser, UnreadableFileIsAFileError) {
  EXPECT_THROW(Document::read("/no/such/file.toml", sample_schema()), FileError);
  EXPECT_THROW(Document::read("/", sample_schema()), FileError);
}

TEST(SchemaTable, DefaultsParseAndValidate) {
  for (const Key& key : sample_schema().keys()) {
    if (key.fallback == "required" || key.fallback == "absent") continue;
    const ParamNode node = parse_param_text("x = " + key.fallback + "\n", key.path);
    EXPECT_TRUE(check_value(key, *node.find("x"), key.path).empty()) << key.path;
  }
}

TEST(SchemaTable, PrintsEveryKeyInAllForms) {
  for (const std::string& text :
       {sample_schema().text(), sample_schema().json(), sample_schema().markdown()}) {
    for (const Key& key : sample_schema().keys()) expect_contains(text, key.path);
    expect_contains(text, "kg/m^3");
  }
}

TEST(SchemaTable, TwoRowsForOneKeyAreABug) {
  EXPECT_THROW(Schema("twice", {{.path = "a"}, {.path = "a"}}), AssertionError);
}

}  // namespace
}  // namespace archetide
