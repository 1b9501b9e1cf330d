// Command lines and input files with random mistakes in them: whatever the words, a program ends by itself with an exit
// code that says whose fault it was and a message, soon, and with bounded memory.

#include <fmt/core.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <map>
#include <random>

#include "tests/faults/process.h"

namespace archetide {
namespace {

namespace fs = std::filesystem;

constexpr char kHelp[] =
    "mutate BIN ASSETS FOLDER [--seed N] [--seconds T | --count N] [--only N]\n"
    "Runs the programs in BIN on mutated command lines and files of ASSETS, in FOLDER, which is "
    "emptied.\n"
    "--only N: case N of this seed alone, which is kept in FOLDER. Exit 0, or 3 when a case is "
    "wrong.\n";

constexpr double kMostSeconds = 60.0, kMostMegabytes = 2500.0;

using Random = std::mt19937_64;

int below(Random& random, std::size_t n) { return static_cast<int>(random() % n); }
template <class List>
const auto& one_of(Random& random, const List& list) {
  return list[random() % std::size(list)];
}

// What stands where something else should.
const std::array kStrange = {"0",
                             "-1",
                             "1",
                             "3",
                             "1e308",
                             "-1e308",
                             "1e-308",
                             "nan",
                             "inf",
                             "2147483648",
                             "-2147483649",
                             "9223372036854775807",
                             "99999999999999999999",
                             "0.1",
                             "\"\"",
                             "\"x\"",
                             "''",
                             "[]",
                             "{}",
                             "[[]]",
                             "[1,2]",
                             "[0,0,0]",
                             "[nan,0,0]",
                             "[1e9,1e9,1e9]",
                             "true",
                             "false",
                             "absent",
                             "1979-05-27",
                             "\"../../..\"",
                             "\"/dev/zero\"",
                             "\"/dev/null\"",
                             "\".\"",
                             "\"\\u0000\"",
                             "\xff",
                             "\"\xc3\"",
                             "=",
                             "]",
                             "}",
                             "\"",
                             "#",
                             "\n",
                             "\t",
                             "1/0",
                             "\"1/0\"",
                             "\"1/3\"",
                             "0x7fffffff",
                             "1_000",
                             "+5",
                             "full",
                             "\"full\"",
                             "\"all\"",
                             "*",
                             "$(id)",
                             "`id`",
                             "%s%n",
                             "a.b.c",
                             "body[0]",
                             "body[9].modes=1"};

// A text with some of its words, lines or bytes replaced, doubled, moved or gone.
std::string mutated(std::string text, Random& random) {
  for (int n = 1 + below(random, 3); n > 0; --n) {
    const std::size_t at = random() % (text.size() + 1);
    switch (below(random, 6)) {
      case 0:
        text.insert(at, one_of(random, kStrange));
        break;
      case 1:
        text.erase(at, random() % 20);
        break;
      case 2:
        if (at < text.size()) text[at] = static_cast<char>(random());
        break;
      default: {  // a word or a value
        const std::size_t begin = text.find_first_of(" =,[\n", at);
        if (begin == text.npos) break;
        const std::size_t first = text.find_first_not_of(" =,[\n", begin);
        if (first == text.npos) break;
        const std::size_t end = std::min(text.find_first_of(" ,]}=\n", first), text.size());
        text.replace(first, end - first, one_of(random, kStrange));
      }
    }
  }
  return text;
}

const std::array kKeys = {"time.end",
                          "time.fps",
                          "step.max",
                          "step.cfl",
                          "step.scheme",
                          "fluid.grid",
                          "fluid.cell",
                          "fluid.water",
                          "fluid.water.level",
                          "fluid.density",
                          "fluid.walls",
                          "fluid.particles",
                          "fluid.drag",
                          "coupling.tolerance",
                          "coupling.geometry",
                          "coupling.on_fail",
                          "body.modes",
                          "body.position",
                          "body.velocity",
                          "body.density",
                          "body[0].rotation",
                          "body[7].modes",
                          "contact",
                          "contact.friction",
                          "contact.restitution",
                          "output.frames",
                          "output.checkpoint",
                          "limits.volume_drift",
                          "gravity",
                          "scatter.count",
                          "joint",
                          "static",
                          "expect",
                          "name",
                          "schema",
                          "",
                          "x",
                          "fluid..grid",
                          "body[",
                          "body[-1].modes",
                          "a.b.c.d"};

// Works in a folder with copies of the assets and one archetype.
class Mutator {
 public:
  Mutator(std::string bin, const std::string& assets, std::string folder)
      : bin_(fs::absolute(bin)), folder_(fs::absolute(folder)) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    for (const auto& part : {"bodies", "scenes"})
      for (const auto& file : fs::directory_iterator(fs::path(assets) / part)) {
        fs::copy_file(file.path(), fs::path(folder_) / file.path().filename());
        const std::string name = file.path().filename().string();
        if (name.ends_with(".scene.toml")) scenes_.push_back(name);
        if (name.ends_with(".body.toml")) bodies_.push_back(name);
        if (name.ends_with(".obj")) meshes_.push_back(name);
      }
    for (auto* list : {&scenes_, &bodies_, &meshes_}) std::sort(list->begin(), list->end());
    write_bytes(folder_ + "/small.scene.toml", kSmall);
    write_bytes(
        folder_ + "/ball.body.toml",
        "schema = 1\nmesh = \"sphere.obj\"\ntet = { target = 300 }\nmaterial = { density = 500.0, "
        "young = 5e4, poisson = 0.4 }\nmodes = { count = 3 }\n");
    const Ending end =
        run({{precompute(), "build", "ball.body.toml", "-q", "-o", "ball.h5"}, folder_});
    if (end.code != 0) throw std::runtime_error("no archetype: " + end.text);
    archetype_ = bytes_of(folder_ + "/ball.h5");
  }

  /// Case `seed`: what is wrong with it, or "". `shown`: its command line.
  std::string try_case(std::uint64_t seed, std::string& shown, int& code) {
    Random random(seed);
    Command c;
    c.folder = folder_;
    c.words = command_line(random);
    c.seconds = kMostSeconds;
    c.environment = {"OMP_WAIT_POLICY=passive", "ARCHETIDE_MEMORY_LIMIT=2G"};
    shown.clear();
    for (const std::string& word : c.words) shown += (shown.empty() ? "" : " ") + quoted(word);
    const Ending end = run(c);
    code = end.code;
    std::error_code none;
    for (const char* made : {"r", "made.h5", "page.html", "f.vtu"})
      fs::remove_all(fs::path(folder_) / made, none);
    return verdict(end);
  }

 private:
  static constexpr char kSmall[] =
      "schema = 1\ntime = { end = 0.05, fps = 20 }\nstep = { max = 0.05 }\n[fluid]\ngrid = [8, 8, "
      "8]\n"
      "cell = \"1/8\"\nwater = { level = 0.5 }\nwalls = { zmax = \"open\" "
      "}\n[contact]\nrestitution = 0.1\n"
      "[[body]]\narchetype = \"ball.h5\"\nposition = [0.5, 0.5, 0.6]\nscale = 1.0\nmodes = 3\n";

  static std::string quoted(const std::string& word) {
    std::string out = "'";
    for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
  }
  static std::string verdict(const Ending& end) {
    static const std::array kCodes = {0, 2, 3, 4, 5, 75};
    if (end.deaf) return "does not end on SIGTERM after 60 s";
    if (std::find(kCodes.begin(), kCodes.end(), end.code) == kCodes.end())
      return fmt::format("exit {}: {}", end.code, end.text.substr(0, 400));
    if (end.code != 0 && end.code != 75 && end.text.empty())
      return fmt::format("exit {} without a message", end.code);
    if (end.peak_megabytes > kMostMegabytes)
      return fmt::format("takes {:f} MB", end.peak_megabytes);
    return "";
  }

  std::string sim() const { return bin_ + "/archetide-sim"; }
  std::string precompute() const { return bin_ + "/archetide-precompute"; }
  std::string spoiled(const std::string& source, const std::string& name, Random& random) const {
    std::string bytes = mutated(bytes_of(folder_ + "/" + source), random);
    if (bytes.size() > 1 << 20) bytes.resize(1 << 20);
    write_bytes(folder_ + "/" + name, bytes);
    return name;
  }
  std::string scene(Random& random) const {
    const std::string source = below(random, 3) ? "small.scene.toml" : one_of(random, scenes_);
    return below(random, 4) ? spoiled(source, "any.scene.toml", random) : source;
  }
  std::string body(Random& random) const {
    if (below(random, 3) == 0) {  // a good file with a spoiled mesh
      spoiled(one_of(random, meshes_), "any.obj", random);
      write_bytes(folder_ + "/any.body.toml",
                  "schema = 1\nmesh = \"any.obj\"\nmaterial = { density = 500.0, young = 5e4, "
                  "poisson = 0.4 }\n"
                  "modes = { count = 3 }\ntet = { target = 300 }\n");
      return "any.body.toml";
    }
    return spoiled(below(random, 2) ? "ball.body.toml" : one_of(random, bodies_), "any.body.toml",
                   random);
  }
  std::string archetype(Random& random) const {
    std::string bytes = archetype_;
    for (int n = below(random, 3); n > 0; --n)
      bytes[random() % bytes.size()] = static_cast<char>(random());
    if (below(random, 8) == 0) bytes.resize(random() % bytes.size());
    write_bytes(folder_ + "/any.h5", bytes);
    return "any.h5";
  }
  void add_set(std::vector<std::string>& words, Random& random) const {
    words.push_back("--set");
    words.push_back(one_of(random, kKeys) + std::string("=") + one_of(random, kStrange));
  }

  std::vector<std::string> simulator_line(Random& random) const {
    std::vector<std::string> words = {sim()};
    switch (below(random, 8)) {
      case 0:
        words.insert(words.end(), {"check", scene(random)});
        break;
      case 1:
        words.insert(words.end(), {"deps", scene(random), "-o", "r", "target"});
        break;
      case 2:
        words.insert(words.end(), {"schema", "--md"});
        break;
      case 3:
        words.insert(words.end(),
                     {one_of(random, std::array{"render", "report", "diff", "bench"}), "r"});
        break;
      default:
        words.insert(words.end(), {"run", scene(random), "-o", "r", "--frames", "1", "-t", "1"});
    }
    if (words[1] == "check" || words[1] == "run")
      for (int n = below(random, 3); n > 0; --n) add_set(words, random);
    return words;
  }
  std::vector<std::string> precompute_line(Random& random) const {
    switch (below(random, 5)) {
      case 0:
        return {precompute(), "info", archetype(random), "--json"};
      case 1:
        return {precompute(), "export", archetype(random),       "-o",
                "f.vtu",      "--mode", one_of(random, kStrange)};
      case 2:
        return {precompute(), "check", body(random)};
      case 3:
        return {precompute(), "report", archetype(random), "-o", "page.html"};
      default:
        return {precompute(), "build", body(random),   "-o", "made.h5",
                "-t",         "1",     "--time-limit", "20"};
    }
  }
  std::vector<std::string> command_line(Random& random) const {
    std::vector<std::string> words =
        below(random, 3) ? simulator_line(random) : precompute_line(random);
    if (below(random, 4) == 0) {  // a mistake in the words themselves
      const int at = 1 + below(random, words.size() - 1);
      switch (below(random, 4)) {
        case 0:
          words.erase(words.begin() + at);
          break;
        case 1:
          words.insert(words.begin() + at, words[at]);
          break;
        case 2:
          words[at] = one_of(random, kStrange);
          break;
        default:
          words[at] = mutated(words[at], random);
      }
    }
    for (std::string& word : words) word = word.substr(0, word.find('\0'));
    return words;
  }

  std::string bin_, folder_, archetype_;
  std::vector<std::string> scenes_, bodies_, meshes_;
};

int mutate(int argc, char** argv) {
  std::map<std::string, std::uint64_t> options = {
      {"--seed", 1}, {"--seconds", 0}, {"--count", 200}, {"--only", 0}};
  std::vector<std::string> words;
  for (int n = 1; n < argc; ++n) {
    const auto option = options.find(argv[n]);
    if (option != options.end() && n + 1 < argc)
      option->second = std::stoull(argv[++n]);
    else
      words.emplace_back(argv[n]);
  }
  if (words.size() != 3) return std::fputs(kHelp, stderr), 2;
  Mutator mutator(words[0], words[1], words[2]);
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::seconds(options["--seconds"]);
  std::map<int, int> codes;
  int wrong = 0;
  std::uint64_t n = options["--only"] ? options["--only"] - 1 : 0;
  const auto goes_on = [&](std::uint64_t done) {
    if (options["--only"]) return done < options["--only"];
    return options["--seconds"] ? Clock::now() < end : done < options["--count"];
  };
  while (goes_on(n)) {
    ++n;
    std::string shown;
    int code = 0;
    const std::string what = mutator.try_case(options["--seed"] << 32 | n, shown, code);
    ++codes[code];
    if (what.empty()) continue;
    ++wrong;
    std::printf("case %llu: %s\n  %s\n", static_cast<unsigned long long>(n), shown.c_str(),
                what.c_str());
    std::fflush(stdout);
  }
  std::printf("mutate: seed %llu, %llu cases, %d wrong; exit codes:",
              static_cast<unsigned long long>(options["--seed"]),
              static_cast<unsigned long long>(n), wrong);
  for (const auto& [code, count] : codes) std::printf(" %d: %d", code, count);
  std::printf("\n");
  return wrong > 0 ? 3 : 0;
}

}  // namespace
}  // namespace archetide

int main(int argc, char** argv) {
  try {
    return archetide::mutate(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "mutate: %s\n", error.what());
    return 1;
  }
}
