#include "common/params/params.h"

#include <fmt/core.h>

#include <cmath>
#include <set>

#include "common/base/check.h"

namespace archetide {
namespace {

std::string with_brackets(const std::string& path) { return path + "[]"; }

Vec3 to_vec3(const ParamNode& node) {
  return Vec3(number_of(node.items[0]), number_of(node.items[1]), number_of(node.items[2]));
}

// `schema = 1` stands before everything else, so that a program knows at once what it reads.
void check_schema_key(const ParamNode& root, std::vector<Diagnostic>& found) {
  const ParamNode* version = root.find("schema");
  if (!version) return;
  if (version->kind == ParamNode::Kind::kInteger && version->integer != 1) {
    found.push_back({version->where, fmt::format("schema {} is not known", version->integer),
                     "this program reads schema = 1"});
  } else if (root.entries.front().first != "schema") {
    found.push_back({version->key_where, "schema = 1 must be the first key of the file", ""});
  }
}

void collect_unread(const ParamNode& table, const std::string& path,
                    const std::set<const ParamNode*>& read, std::vector<std::string>& out) {
  for (const auto& [name, value] : table.entries) {
    const std::string shown = key_path(path, name);
    if (!read.contains(&value)) {
      out.push_back(fmt::format("{}:{}:{}: {}", value.key_where.file, value.key_where.line,
                                value.key_where.column, shown));
    } else if (value.kind == ParamNode::Kind::kTable) {
      collect_unread(value, shown, read, out);
    } else if (value.is_table_list()) {
      for (std::size_t n = 0; n < value.items.size(); ++n) {
        collect_unread(value.items[n], fmt::format("{}[{}]", shown, n), read, out);
      }
    }
  }
}

}  // namespace

struct Section::State {
  std::string text;  // as read
  ParamNode tree;    // after the overrides
  bool overridden = false;
  Schema schema;
  std::map<std::string, ParamNode> defaults;  // by schema path, filled on demand
  std::set<const ParamNode*> read;
};

void throw_if_any(const std::vector<Diagnostic>& diagnostics) {
  if (!diagnostics.empty()) throw InputError(diagnostics);
}

// --- Document ---

Document Document::read(const std::string& path, const Schema& schema,
                        const std::vector<std::string>& overrides) {
  return parse(read_param_file(path), path, schema, overrides);
}

Document Document::parse(const std::string& text, const std::string& file, const Schema& schema,
                         const std::vector<std::string>& overrides) {
  ParamNode tree = parse_param_text(text, file);
  std::vector<Diagnostic> found;
  check_schema_key(tree, found);
  for (const std::string& assignment : overrides) {
    try {
      apply_override(tree, assignment);
    } catch (const InputError& error) {
      found.insert(found.end(), error.diagnostics.begin(), error.diagnostics.end());
    }
  }
  const std::vector<Diagnostic> bad = schema.check(tree);
  found.insert(found.end(), bad.begin(), bad.end());
  throw_if_any(found);

  Document document;
  document.state_ = std::make_shared<Section::State>(
      Section::State{text, std::move(tree), !overrides.empty(), schema, {}, {}});
  document.state_->read.insert(document.state_->tree.find("schema"));
  return document;
}

std::string Document::text() const {
  return state_->overridden ? to_toml(state_->tree) : state_->text;
}

Section Document::root() const {
  Section root;
  root.state_ = state_;
  root.node_ = &state_->tree;
  root.where_ = state_->tree.where;
  return root;
}

std::vector<std::string> Document::unread() const {
  std::vector<std::string> out;
  collect_unread(state_->tree, "", state_->read, out);
  return out;
}

void Document::check_all_read() const {
  const std::vector<std::string> keys = unread();
  if (!keys.empty()) throw AssertionError("a known key was never read: " + keys.front());
}

// --- Section ---

// The node of a dotted path in the file, or null; marks every table on the way as read.
const ParamNode* Section::find(const std::string& path) const {
  const ParamNode* at = node_;
  for (std::size_t begin = 0; at && begin < path.size();) {
    const std::size_t dot = std::min(path.find('.', begin), path.size());
    at = at->find(path.substr(begin, dot - begin));
    if (at) state_->read.insert(at);
    begin = dot + 1;
  }
  return at;
}

std::string Section::schema_path(const std::string& path) const { return key_path(path_, path); }

// The value in the file, or the parsed default.
const ParamNode& Section::value(const std::string& path) const {
  const Key* key = state_->schema.find(schema_path(path));
  if (!key) key = state_->schema.find(with_brackets(schema_path(path)));
  if (!key) throw AssertionError("the schema has no key " + schema_path(path));
  if (const ParamNode* node = find(path)) return *node;
  if (key->fallback == "required" || key->fallback == "absent" || key->fallback.empty()) {
    throw AssertionError("no default for " + schema_path(path) + ", ask has() first");
  }
  auto [it, added] = state_->defaults.try_emplace(key->path);
  if (added) {
    it->second =
        *parse_param_text("x = " + key->fallback + "\n", "default of " + key->path).find("x");
  }
  return it->second;
}

bool Section::has(const std::string& path) const {
  const std::string full = schema_path(path);
  if (!state_->schema.find(full) && !state_->schema.find(with_brackets(full))) {
    throw AssertionError("the schema has no key " + full);
  }
  return find(path) != nullptr;
}

bool Section::boolean(const std::string& path) const { return value(path).boolean; }

int Section::integer(const std::string& path) const {
  return static_cast<int>(value(path).integer);
}

double Section::number(const std::string& path) const { return number_of(value(path)); }

std::string Section::string(const std::string& path) const { return value(path).string; }

std::vector<std::string> Section::strings(const std::string& path) const {
  std::vector<std::string> out;
  for (const ParamNode& item : value(path).items) out.push_back(item.string);
  return out;
}

Vec3 Section::vec3(const std::string& path) const { return to_vec3(value(path)); }

Vec3i Section::int_vec3(const std::string& path) const { return vec3(path).cast<int>(); }

std::vector<Vec3> Section::points(const std::string& path) const {
  std::vector<Vec3> out;
  for (const ParamNode& item : value(path).items) out.push_back(to_vec3(item));
  return out;
}

bool Section::is_string(const std::string& path) const {
  return value(path).kind == ParamNode::Kind::kString;
}

Section Section::section(const std::string& path) const {
  const Key* key = state_->schema.find(schema_path(path));
  if (!key || key->type != KeyType::kTable) throw AssertionError("no table " + schema_path(path));
  Section child = *this;
  child.node_ = find(path);
  child.path_ = key->path;
  child.shown_ = shown(path);
  if (child.node_) child.where_ = child.node_->where;
  return child;
}

std::vector<Section> Section::sections(const std::string& path) const {
  const std::string list_path = with_brackets(schema_path(path));
  if (!state_->schema.find(list_path)) throw AssertionError("no list of tables " + list_path);
  std::vector<Section> out;
  const ParamNode* list = find(path);
  for (std::size_t n = 0; list && n < list->items.size(); ++n) {
    Section child = *this;
    child.node_ = &list->items[n];
    child.path_ = list_path;
    child.shown_ = fmt::format("{}[{}]", shown(path), n);
    child.where_ = child.node_->where;
    out.push_back(child);
  }
  return out;
}

SourceLocation Section::location(const std::string& path) const {
  const ParamNode* node = find(path);
  return node ? node->where : where_;
}

std::string Section::shown(const std::string& path) const { return key_path(shown_, path); }

Diagnostic Section::error(const std::string& path, const std::string& what,
                          const std::string& hint) const {
  return {location(path), shown(path) + ": " + what, hint};
}

}  // namespace archetide
