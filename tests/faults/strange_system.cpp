// Preloaded before a program: a clock that jumps, and a language with a decimal comma.

#include <dlfcn.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <clocale>
#include <cstdlib>

namespace {

// Up to a day to and fro, another one each time, the same ones in each run.
long jump() {
  static std::atomic<unsigned> state{1};
  constexpr long kDay = 86400;
  const unsigned next = state.fetch_add(2654435761u) * 1664525u + 1013904223u;
  return static_cast<long>(next % (2 * kDay)) - kDay;
}

const struct Language {
  Language() {
    if (std::getenv("ARCHETIDE_STRANGE_LOCALE")) std::setlocale(LC_ALL, "");
  }
} language;

}  // namespace

extern "C" int clock_gettime(clockid_t id, struct timespec* time) noexcept {
  const long result = ::syscall(SYS_clock_gettime, id, time);
  static const bool strange = std::getenv("ARCHETIDE_STRANGE_CLOCK") != nullptr;
  if (result == 0 && strange) time->tv_sec += jump();
  return static_cast<int>(result);
}
