#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

/// The project's own files, as paths relative to its top folder.
namespace source_tree {

inline std::filesystem::path root() {
  return std::filesystem::path(__FILE__).parent_path().parent_path().parent_path();
}

inline std::string read(const std::string& path) {
  std::ifstream file(root() / path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

/// Every regular file under the given top-level files and folders, sorted.
inline std::vector<std::string> files(const std::vector<std::string>& tops) {
  namespace fs = std::filesystem;
  std::vector<std::string> found;
  for (const std::string& top : tops) {
    if (fs::is_regular_file(root() / top)) found.push_back(top);
    if (!fs::is_directory(root() / top)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root() / top))
      if (entry.is_regular_file())
        found.push_back(fs::relative(entry.path(), root()).generic_string());
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// Where code stands.
inline const std::vector<std::string> kCode = {"common", "precompute", "runtime",
                                               "assets/generate"};

inline bool holds(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

inline bool is_source(const std::string& path) {
  return path.ends_with(".h") || path.ends_with(".cpp");
}

/// One #include line: the file it stands in and what stands between the quotes or angle brackets.
struct Include {
  std::string file;
  std::string target;
  bool quoted = true;
};

inline std::vector<Include> includes_of(const std::string& file, const std::string& text) {
  std::vector<Include> includes;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const auto hash = line.find_first_not_of(" \t");
    if (hash == std::string::npos || line.compare(hash, 8, "#include") != 0) continue;
    const auto open = line.find_first_of("\"<", hash);
    const auto close = line.find_first_of("\">", open + 1);
    if (close == std::string::npos) continue;
    includes.push_back({file, line.substr(open + 1, close - open - 1), line[open] == '"'});
  }
  return includes;
}

inline std::vector<Include> includes_under(const std::vector<std::string>& tops) {
  std::vector<Include> all;
  for (const std::string& file : files(tops)) {
    if (!is_source(file)) continue;
    const auto some = includes_of(file, read(file));
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

inline std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

}  // namespace source_tree
