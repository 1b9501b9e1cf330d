// The documents name code, papers and decisions; what they name must be there.

#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "source_tree.h"

namespace {

const std::vector<std::string> kDocuments = {
    "docs/method.md",   "docs/notation.md", "docs/bibliography.md", "docs/decisions.md",
    "docs/stencils.md", "docs/scenes.md",   "docs/bodies.md",       "docs/files.md"};
const std::vector<std::string> kCode = {"common", "precompute", "runtime", "tests"};

using Faults = std::vector<std::string>;
using Tags = std::set<std::string>;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// What the first group of `pattern` matches, at every place of the text.
std::vector<std::string> matches(const std::string& text, const std::regex& pattern) {
  std::vector<std::string> found;
  for (std::sregex_iterator m(text.begin(), text.end(), pattern), end; m != end; ++m)
    found.push_back((*m)[1]);
  return found;
}

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

bool has_whole_word(const std::string& text, const std::string& word) {
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || !is_word(text[at - 1])) && (end == text.size() || !is_word(text[end])))
      return true;
  }
  return false;
}

/// Where a document says that something is: `path: name`, or several names.
struct Reference {
  std::string path;
  std::vector<std::string> names;
};

std::vector<Reference> references_of(const std::string& text) {
  static const std::regex kReference("`([^`\\s:]+\\.(?:cpp|h|mk)):\\s+([^`]+)`");
  static const std::regex kName("(\\w+)");
  std::vector<Reference> found;
  for (std::sregex_iterator m(text.begin(), text.end(), kReference), end; m != end; ++m)
    found.push_back({(*m)[1], matches((*m)[2], kName)});
  return found;
}

Faults faults_of(const std::string& document, const Reference& reference) {
  const std::string where = document + ": " + reference.path;
  if (!std::filesystem::is_regular_file(source_tree::root() / reference.path))
    return {where + " is no file"};
  const std::string text = source_tree::read(reference.path);
  Faults faults;
  for (const std::string& name : reference.names)
    if (!has_whole_word(text, name)) faults.push_back(where + " does not hold " + name);
  return faults;
}

/// What stands behind // in the lines of a source file.
std::string comments_of(const std::string& text) {
  std::string comments;
  for (const std::string& line : lines_of(text)) {
    const auto at = line.find("//");
    if (at != std::string::npos) comments += line.substr(at) + "\n";
  }
  return comments;
}

std::vector<std::string> documents() {
  std::vector<std::string> found;
  for (const std::string& path : source_tree::files({"docs"}))
    if (path.ends_with(".md")) found.push_back(path);
  return found;
}

/// Every text that may hold tags, with its path: documents, and the comments of the code. This
/// file plants some that are not defined.
std::vector<std::pair<std::string, std::string>> tagged_texts() {
  std::vector<std::pair<std::string, std::string>> texts;
  for (const std::string& path : documents()) texts.emplace_back(path, source_tree::read(path));
  for (const std::string& path : source_tree::files(kCode))
    if (source_tree::is_source(path) && !path.ends_with("documents_test.cpp"))
      texts.emplace_back(path, comments_of(source_tree::read(path)));
  return texts;
}

/// [EMF02]: at least two letters (a D with a number is a decision), * where authors are left out.
Tags papers_named(const std::string& text) {
  static const std::regex kPaper("\\[([A-Z][A-Za-z]+\\*?[0-9]{2})\\]");
  const auto found = matches(text, kPaper);
  return {found.begin(), found.end()};
}

Tags decisions_named(const std::string& text) {
  static const std::regex kDecision("\\[(D[0-9]+)\\]");
  const auto found = matches(text, kDecision);
  return {found.begin(), found.end()};
}

/// Labels of the project's own equations, S3: as "Eq. S3", "(S3)" or "docs/method.md, S3".
Tags equations_named(const std::string& text) {
  static const std::regex kLabel("(?:Eqs?\\. |\\(|method\\.md, )([BCKPSVW][0-9]+[a-z]?)\\b");
  const auto found = matches(text, kLabel);
  return {found.begin(), found.end()};
}

/// Those that stand beside a formula, \tag{S3}; a label that does so twice comes twice.
std::vector<std::string> equations_tagged(const std::string& method) {
  static const std::regex kTag("\\\\tag\\{([A-Z][0-9]+[a-z]?)\\}");
  return matches(method, kTag);
}

/// First groups of the lines that begin with `pattern`.
Tags defined(const std::string& text, const std::regex& pattern) {
  Tags tags;
  for (const std::string& line : lines_of(text)) {
    std::smatch m;
    if (std::regex_search(line, m, pattern, std::regex_constants::match_continuous))
      tags.insert(m[1]);
  }
  return tags;
}

Tags papers_defined(const std::string& bibliography) {
  return defined(bibliography, std::regex("\\*\\*\\[([^\\]]+)\\]\\*\\*"));
}

Tags decisions_defined(const std::string& decisions) {
  return defined(decisions, std::regex("## (D[0-9]+)\\b"));
}

Faults missing(const std::string& path, const Tags& named, const Tags& known) {
  Faults faults;
  for (const std::string& tag : named)
    if (!known.count(tag)) faults.push_back(path + " names [" + tag + "]");
  return faults;
}

/// Files that a page of Markdown links to, as it names them: [text](docs/scenes.md#section).
std::vector<std::string> links_of(const std::string& text) {
  static const std::regex kLink("\\]\\(([^)#:\\s]+)(?:#[^)]*)?\\)");
  return matches(text, kLink);
}

/// Numbers of the paper's equations that have a row in the table of a document: | 16 | ..
std::set<int> equations_listed(const std::string& text) {
  std::set<int> numbers;
  for (const std::string& tag : defined(text, std::regex("\\| *([0-9]+) *\\|")))
    numbers.insert(std::stoi(tag));
  return numbers;
}

}  // namespace

TEST(Documents, AreThere) {
  for (const std::string& path : kDocuments)
    EXPECT_FALSE(source_tree::read(path).empty()) << path << " is missing or empty";
}

TEST(Documents, NameOnlyFilesAndFunctionsThatExist) {
  for (const std::string& document : documents())
    for (const Reference& reference : references_of(source_tree::read(document))) {
      const Faults faults = faults_of(document, reference);
      EXPECT_TRUE(faults.empty()) << source_tree::joined(faults);
    }
  EXPECT_GT(references_of(source_tree::read("docs/method.md")).size(), 100u);
}

TEST(Documents, DefineEveryPaperThatIsNamed) {
  const Tags known = papers_defined(source_tree::read("docs/bibliography.md"));
  EXPECT_FALSE(known.empty());
  for (const auto& [path, text] : tagged_texts()) {
    const Faults faults = missing(path, papers_named(text), known);
    EXPECT_TRUE(faults.empty()) << source_tree::joined(faults);
  }
}

TEST(Documents, DefineEveryDecisionThatIsNamed) {
  const Tags known = decisions_defined(source_tree::read("docs/decisions.md"));
  EXPECT_FALSE(known.empty());
  for (const auto& [path, text] : tagged_texts()) {
    const Faults faults = missing(path, decisions_named(text), known);
    EXPECT_TRUE(faults.empty()) << source_tree::joined(faults);
  }
}

TEST(Documents, MethodHasEveryEquationThatTheCodeNames) {
  const std::string method = source_tree::read("docs/method.md");
  const std::vector<std::string> tagged = equations_tagged(method);
  const Tags unique(tagged.begin(), tagged.end());
  EXPECT_GT(unique.size(), 60u);
  EXPECT_EQ(unique.size(), tagged.size()) << "a label stands for two equations";
  Tags known = equations_named(method);
  known.insert(unique.begin(), unique.end());
  for (const std::string& path : source_tree::files({"common", "precompute", "runtime"})) {
    const Faults faults =
        missing(path, equations_named(comments_of(source_tree::read(path))), known);
    EXPECT_TRUE(faults.empty()) << source_tree::joined(faults);
  }
}

TEST(Documents, MethodListsEveryEquationOfThePaper) {
  const std::set<int> listed = equations_listed(source_tree::read("docs/method.md"));
  for (int equation = 1; equation <= 49; ++equation)
    EXPECT_TRUE(listed.count(equation)) << "Eq. " << equation;
}

TEST(Documents, LinksLeadToFiles) {
  std::vector<std::string> pages = documents();
  pages.push_back("README.md");
  std::size_t links = 0;
  for (const std::string& page : pages)
    for (const std::string& link : links_of(source_tree::read(page))) {
      const auto file = (source_tree::root() / page).parent_path() / link;
      EXPECT_TRUE(std::filesystem::exists(file)) << page << " links to " << link;
      ++links;
    }
  EXPECT_GT(links, 20u);
}

TEST(Documents, TheReadmeIsShortAndNamesTheTests) {
  const std::string readme = source_tree::read("README.md");
  EXPECT_LE(readme.size(), 8000u);
  std::istringstream ci(source_tree::read(".ci/run"));
  std::string command;
  for (std::string line; std::getline(ci, line);) command = line;  // the last one runs the tests
  EXPECT_NE(readme.find(command), std::string::npos) << command;
}

TEST(Documents, PlantedReferencesAreFound) {
  const auto found = references_of("see `runtime/a.cpp: f`, `b.mk: g,\n h` and `runtime/c.cpp`");
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].path, "runtime/a.cpp");
  EXPECT_EQ(found[0].names, (std::vector<std::string>{"f"}));
  EXPECT_EQ(found[1].names, (std::vector<std::string>{"g", "h"}));
  const std::string here = "tests/architecture/source_tree.h";
  EXPECT_TRUE(faults_of("a.md", {here, {"includes_under"}}).empty());
  EXPECT_EQ(faults_of("a.md", {here, {"includes_und"}}).size(), 1u);
  EXPECT_EQ(faults_of("a.md", {"runtime/no_such_file.cpp", {"f"}}).size(), 1u);
}

TEST(Documents, PlantedTagsAreFound) {
  const std::string text = "x[i] of [EMF02] and [RMSG*08], see [D17] and [0,1]";
  EXPECT_EQ(papers_named(text), (Tags{"EMF02", "RMSG*08"}));
  EXPECT_EQ(decisions_named(text), Tags{"D17"});
  EXPECT_EQ(equations_named("Eq. S3, (W2b), f(B4; docs/method.md, C1), V0, Eq. 45"),
            (Tags{"B4", "C1", "S3", "W2b"}));
  EXPECT_EQ(equations_tagged("x \\tag{S3}\n\\tag{P6a}"), (std::vector<std::string>{"S3", "P6a"}));
  EXPECT_EQ(papers_defined("**[EMF02]** Enright\nsee **[AB99]**\n"), Tags{"EMF02"});
  EXPECT_EQ(decisions_defined("## D17 Title\n### D18\n## D2\n"), (Tags{"D17", "D2"}));
  EXPECT_EQ(missing("a", {"AB99", "CD00"}, {"AB99"}).size(), 1u);
  EXPECT_EQ(links_of("[a](b.md) [c](d.md#e) ![f](g/h.png) x[i](t) http://j"),
            (std::vector<std::string>{"b.md", "d.md", "g/h.png", "t"}));
  EXPECT_EQ(comments_of("int a;  // [EMF02]\nint b[3];\n"), "// [EMF02]\n");
}
