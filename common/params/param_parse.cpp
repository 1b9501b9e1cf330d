// Text to a tree, by toml++, which no other file knows.

#include <stdexcept>

namespace archetide {
namespace {

/// toml++ found itself in a state that it holds impossible (`[.` does that).
struct ParserGaveUp : std::logic_error {
  using std::logic_error::logic_error;
};

[[noreturn]] void parser_gave_up(const char* expected) { throw ParserGaveUp(expected); }

}  // namespace
}  // namespace archetide

// The parser's assertions are how it notices some wrong input: they stay, in every kind of build,
// as exceptions.
#undef NDEBUG
#define TOML_HEADER_ONLY 1
#define TOML_ASSERT(expression) \
  ((expression) ? static_cast<void>(0) : ::archetide::parser_gave_up(#expression))
#include <toml++/toml.h>

#include <algorithm>
#include <string_view>

#include "common/params/param_tree.h"

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
    out.entries.push_back({std::string(key.str()), std::move(child)});
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

/// True when the parser gives up somewhere in these bytes.
bool gives_up(std::string_view text) {
  try {
    static_cast<void>(toml::parse(text));
  } catch (const ParserGaveUp&) {
    return true;
  } catch (const toml::parse_error&) {
  }
  return false;
}

/// Where a parser that gives up on `text` does so: the end of the shortest part that it gives up
/// on. It reads from the front, so every longer part fails too.
SourceLocation where_it_gives_up(std::string_view text, const std::string& file) {
  std::size_t good = 0, bad = text.size();
  while (bad - good > 1) {
    const std::size_t middle = good + (bad - good) / 2;
    (gives_up(text.substr(0, middle)) ? bad : good) = middle;
  }
  const std::string_view before = text.substr(0, good);
  const auto line = std::count(before.begin(), before.end(), '\n');
  const std::size_t line_start = before.rfind('\n') + 1;  // 0 when there is none
  return {file, static_cast<int>(line) + 1, static_cast<int>(good - line_start) + 1};
}

}  // namespace

ParamNode parse_param_text(const std::string& text, const std::string& file) {
  reject_unparsable(text, file);
  try {
    ParamNode root;
    convert_table(toml::parse(text), file, root);
    root.where = root.key_where = {file, 1, 1};
    return root;
  } catch (const toml::parse_error& error) {
    throw InputError({{location(error.source(), file), std::string(error.description()), ""}});
  } catch (const ParserGaveUp&) {
    throw InputError({{where_it_gives_up(text, file), "this is no TOML",
                       "expected a key, a value or a closing bracket here"}});
  }
}

}  // namespace archetide
