#include "common/params/param_tree.h"

#include <fmt/core.h>

#include <algorithm>
#include <optional>
#include <sstream>

#include "common/base/byte_stream.h"

namespace archetide {
namespace {

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
    const ParamNode parsed = parse_param_text("x = " + text + "\n", where.file);
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
  table.entries.push_back({name, child});
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
      throw InputError({{value.where, fmt::format("there is no {}[{}]", step.name, *step.index),
                         fmt::format("the list has {} entries, counted from 0", size)}});
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

// Whether every byte belongs to a character of UTF-8 (its form; not whether Unicode has it).
bool is_utf8(const std::string& text) {
  std::size_t follow = 0;  // bytes that the character still needs
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool inner = (byte & 0xC0) == 0x80;
    if (inner != (follow > 0) || byte == 0xC0 || byte == 0xC1 || byte > 0xF4) return false;
    if (inner)
      --follow;
    else
      follow = byte >= 0xF0 ? 3 : byte >= 0xE0 ? 2 : byte >= 0xC0 ? 1 : 0;
  }
  return follow == 0;
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

std::string read_param_file(const std::string& path) { return read_whole_file(path); }

void apply_override(ParamNode& root, const std::string& assignment) {
  const std::size_t equals = assignment.find('=');
  const std::string path = assignment.substr(0, equals);
  if (!is_utf8(assignment))
    throw InputError("a word behind --set is not UTF-8", "write it in UTF-8, as the scene file is");
  const SourceLocation where{"--set " + path, 0, 0};
  if (equals == std::string::npos) {
    throw InputError({{where, "expected key=value", "for example --set time.end=2.5"}});
  }
  assign(root, parse_path(path, where.file), 0, parse_value(assignment.substr(equals + 1), where));
}

}  // namespace archetide
