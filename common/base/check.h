#pragma once

#include <sstream>
#include <stdexcept>
#include <string>

namespace archetide {

/// A broken promise between two pieces of our own code: our bug, exit code 1.
struct AssertionError : std::logic_error {
  using std::logic_error::logic_error;
};

namespace detail {
template <class A, class B>
[[noreturn]] void check_failed(const char* file, int line, const char* text, const A& a,
                               const B& b) {
  std::ostringstream message;
  message << file << ':' << line << ": check failed: " << text << " (" << a << " against " << b
          << ')';
  throw AssertionError(message.str());
}
[[noreturn]] inline void check_failed(const char* file, int line, const char* text) {
  throw AssertionError(std::string(file) + ':' + std::to_string(line) + ": check failed: " + text);
}
}  // namespace detail
}  // namespace archetide

/// Always on. ARCHETIDE_CHECK(n > 0) or, printing both operands, ARCHETIDE_CHECK_OP(a, ==, b).
#define ARCHETIDE_CHECK(condition) \
  ((condition) ? void(0) : ::archetide::detail::check_failed(__FILE__, __LINE__, #condition))
#define ARCHETIDE_CHECK_OP(a, op, b) \
  (((a)op(b))                        \
       ? void(0)                     \
       : ::archetide::detail::check_failed(__FILE__, __LINE__, #a " " #op " " #b, (a), (b)))
