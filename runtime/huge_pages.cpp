// The operators new and delete of the program: large arrays lie on huge pages [D55].

#include <cstdint>
#include <cstdlib>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace {

constexpr std::uintptr_t kHugePage = std::uintptr_t{2} << 20, kLarge = 2 * kHugePage;

/// Asks for huge pages wherever one fits in; a wish, small ones serve as well.
void wish_for_huge_pages([[maybe_unused]] void* memory, [[maybe_unused]] std::size_t bytes) {
#ifdef MADV_HUGEPAGE
  const auto at = reinterpret_cast<std::uintptr_t>(memory);
  const std::uintptr_t first = (at + kHugePage - 1) / kHugePage * kHugePage,
                       last = (at + bytes) / kHugePage * kHugePage;
  if (last > first) madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
#endif
}

}  // namespace

void* operator new(std::size_t bytes) {
  for (;;) {
    void* memory = std::malloc(bytes > 0 ? bytes : 1);
    if (memory && bytes >= kLarge) wish_for_huge_pages(memory, bytes);
    if (memory) return memory;
    const std::new_handler handler = std::get_new_handler();
    if (!handler) throw std::bad_alloc();
    handler();
  }
}

void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
