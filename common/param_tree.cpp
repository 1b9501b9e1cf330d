#include "common/param_tree.h"

#include <toml++/toml.h>
#include <algorithm>
#include <fstream>
#include <optional>
#include <sstream>
#include <string_view>

namespace archetide {
namespace {

SourceLocation location(const toml::source_region& region, const std::string& file) {
  return {file, static_cast<int>(region.begin.line), static_cast<int>(region.begin.column)};
}

ParamNode convert(const toml::node& in, const std::string& file);

void convert_table(const toml::table& in, const std::string& file, ParamNode& out) {
  out.kind = ParamNode::Kind::kTable;
  for (const auto& [key, value] : in) {
    ParamNode child = convert(value, file);
    child.key_where = location(key.source(), file);
    out.entries.emplace_back(std::string(key.str()), std::move(child));
  }
  std::stable_sort(out.entries.begin(), out.entries.end(), [](const auto& a, const auto& b) {
    const SourceLocation &x = a.second.key_where, &y = b.second.key_where;
    return std::pair(x.line, x.column) < std::pair(y.line, y.column);
  });
}

ParamNode convert(const toml::node& in, const std::string& file) {
  using Kind = ParamNode::Kind;
  ParamNode out;
  out.where = location(in.source(), file);
  if (const auto* table = in.as_table()) {
    convert_table(*table, file, out);
  } else if (const auto* array = in.as_array()) {
    out.kind = Kind::kArray;
    for (const toml::node& item : *array) out.items.push_back(convert(item, file));
  } else if (const auto* text = in.as_string()) {
    out.kind = Kind::kString, out.string = text->get();
  } else if (const auto* whole = in.as_integer()) {
    out.kind = Kind::kInteger, out.integer = whole->get();
    out.number = static_cast<double>(out.integer);
  } else if (const auto* real = in.as_floating_point()) {
    out.kind = Kind::kNumber, out.number = real->get();
  } else if (const auto* flag = in.as_boolean()) {
    out.kind = Kind::kBool, out.boolean = flag->get();
  } else {
    out.kind = Kind::kDate;
  }
  return out;
}

// Walks over TOML text, skipping strings and comments, and reports the first non-ASCII byte outside
// them: the parser's own handling of non-ASCII bare keys is undefined behaviour.
class AsciiScanner {
 public:
  AsciiScanner(std::string_view text, const std::string& file) : text_(text), file_(file) {}

  void scan() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '#') {
        skip_past_comment();
      } else if (c == '"' || c == '\'') {
        skip_past_string(c);
      } else {
        if (static_cast<unsigned char>(c) >= 0x80) fail();
        advance();
      }
    }
  }

 private:
  void advance() {
    if (text_[at_] == '\n') line_ += 1, line_start_ = at_ + 1;
    ++at_;
  }
  void skip_past_comment() {
    while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  }
  void skip_past_string(char quote) {
    const std::string triple(3, quote);
    const bool multi_line = text_.substr(at_, 3) == triple;
    const std::string_view end = std::string_view(triple).substr(0, multi_line ? 3 : 1);
    at_ += end.size();
    while (at_ < text_.size() && text_.substr(at_, end.size()) != end) {
      if (!multi_line && text_[at_] == '\n') return;
      if (quote == '"' && text_[at_] == '\\' && at_ + 1 < text_.size()) ++at_;
      advance();
    }
    at_ = std::min(at_ + end.size(), text_.size());
    while (multi_line && at_ < text_.size() && text_[at_] == quote) ++at_;
  }
  [[noreturn]] void fail() const {
    const SourceLocation where{file_, line_, static_cast<int>(at_ - line_start_) + 1};
    throw InputError({{where, "non-ASCII character outside quotes",
                       "keys and values may hold other characters only between quotes"}});
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0, line_start_ = 0;
  int line_ = 1;
};

void reject_unparsable(const std::string& text, const std::string& file) {
  if (text.compare(0, 3, "\xEF\xBB\xBF") == 0) {
    throw InputError({{{file, 1, 1},
                       "the file begins with a UTF-8 byte order mark",
                       "save it as UTF-8 without BOM"}});
  }
  if (const std::size_t nul = text.find('\0'); nul != std::string::npos) {
    const int line = 1 + static_cast<int>(std::count(text.begin(), text.begin() + nul, '\n'));
    throw InputError({{{file, line, 0}, "this is not a text file (it holds a zero byte)", ""}});
  }
  AsciiScanner(text, file).scan();
}

// --- overrides ---

// One step of an override path: a key and, when given, an index into its list.
struct PathStep {
  std::string name;
  std::optional<std::size_t> index;
};

PathStep parse_step(const std::string& text, const std::string& label) {
  const std::size_t open = text.find('[');
  PathStep step{text.substr(0, open), std::nullopt};
  bool good = !step.name.empty();
  if (good && open != std::string::npos) {
    const std::string digits = text.substr(open + 1, text.size() - open - 2);
    good = text.back() == ']' && !digits.empty() && digits.size() < 9 &&
           digits.find_first_not_of("0123456789") == std::string::npos;
    if (good) step.index = std::stoul(digits);
  }
  if (!good) {
    throw InputError(
        {{{label, 0, 0}, "cannot read the path", "expected section.key or list[0].key"}});
  }
  return step;
}

std::vector<PathStep> parse_path(const std::string& path, const std::string& label) {
  std::vector<PathStep> steps;
  std::stringstream stream(path);
  for (std::string part; std::getline(stream, part, '.');) steps.push_back(parse_step(part, label));
  if (steps.empty()) parse_step("", label);
  return steps;
}

void relocate(ParamNode& node, const SourceLocation& where) {
  node.where = node.key_where = where;
  for (ParamNode& item : node.items) relocate(item, where);
  for (auto& entry : node.entries) relocate(entry.second, where);
}

ParamNode parse_value(const std::string& text, const SourceLocation& where) {
  ParamNode value;
  try {
    const std::string line = "x = " + text + "\n";
    reject_unparsable(line, where.file);
    ParamNode parsed;
    convert_table(toml::parse(line), where.file, parsed);
    if (parsed.entries.size() != 1) throw InputError("more than one value");
    value = parsed.entries[0].second;
  } catch (const std::exception&) {
    value.kind = ParamNode::Kind::kString, value.string = text;
  }
  relocate(value, where);
  return value;
}

ParamNode& child_or_new(ParamNode& table, const std::string& name, const SourceLocation& where) {
  if (ParamNode* child = table.find(name)) return *child;
  ParamNode child;
  child.where = child.key_where = where;
  table.entries.emplace_back(name, child);
  return table.entries.back().second;
}

// `key=absent` takes the key away, as if the file did not have it.
bool takes_away(const ParamNode& value) {
  return value.kind == ParamNode::Kind::kString && value.string == "absent";
}

void assign(ParamNode& table, const std::vector<PathStep>& steps, std::size_t at,
            const ParamNode& value) {
  const PathStep& step = steps[at];
  const bool last = at + 1 == steps.size();
  if (table.kind != ParamNode::Kind::kTable) {
    throw InputError(
        {{value.where, "'" + step.name + "' is set inside a value that is no table", ""}});
  }
  if (last && !step.index && takes_away(value)) {
    const auto named = [&](const auto& entry) { return entry.first == step.name; };
    if (std::erase_if(table.entries, named) > 0) return;
    throw InputError({{value.where, "there is no '" + step.name + "' to take away", ""}});
  }
  ParamNode& child = child_or_new(table, step.name, value.where);
  if (step.index) {
    const std::size_t size = child.kind == ParamNode::Kind::kArray ? child.items.size() : 0;
    if (*step.index >= size) {
      throw InputError(
          {{value.where, "there is no " + step.name + "[" + std::to_string(*step.index) + "]",
            "the list has " + std::to_string(size) + " entries, counted from 0"}});
    }
    ParamNode& item = child.items[*step.index];
    return last ? void(item = value) : assign(item, steps, at + 1, value);
  }
  if (last) {
    child = value;
  } else if (child.is_table_list()) {
    for (ParamNode& item : child.items) assign(item, steps, at + 1, value);
  } else {
    assign(child, steps, at + 1, value);
  }
}

}  // namespace

const ParamNode* ParamNode::find(const std::string& name) const {
  for (const auto& entry : entries) {
    if (entry.first == name) return &entry.second;
  }
  return nullptr;
}

ParamNode* ParamNode::find(const std::string& name) {
  return const_cast<ParamNode*>(std::as_const(*this).find(name));
}

bool ParamNode::is_table_list() const {
  return kind == Kind::kArray && !items.empty() &&
         std::all_of(items.begin(), items.end(),
                     [](const ParamNode& item) { return item.kind == Kind::kTable; });
}

ParamNode parse_param_text(const std::string& text, const std::string& file) {
  reject_unparsable(text, file);
  try {
    ParamNode root;
    convert_table(toml::parse(text), file, root);
    root.where = root.key_where = {file, 1, 1};
    return root;
  } catch (const toml::parse_error& error) {
    throw InputError({{location(error.source(), file), std::string(error.description()), ""}});
  }
}

std::string read_param_file(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  std::stringstream text;
  if (!stream || !(text << stream.rdbuf())) {
    throw FileError(path + ": cannot read this file; check its name and permissions");
  }
  return text.str();
}

void apply_override(ParamNode& root, const std::string& assignment) {
  const std::size_t equals = assignment.find('=');
  const std::string path = assignment.substr(0, equals);
  const SourceLocation where{"--set " + path, 0, 0};
  if (equals == std::string::npos) {
    throw InputError({{where, "expected key=value", "for example --set time.end=2.5"}});
  }
  assign(root, parse_path(path, where.file), 0, parse_value(assignment.substr(equals + 1), where));
}

}  // namespace archetide
