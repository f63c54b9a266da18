#include "porthole/base/image.h"

#include <sys/mman.h>

namespace porthole {

void expect_use(void* memory, std::size_t bytes) {
    constexpr std::uintptr_t kPage = std::uintptr_t(2) << 20;
    const auto begin = (reinterpret_cast<std::uintptr_t>(memory) + kPage - 1) & ~(kPage - 1);
    const auto end = (reinterpret_cast<std::uintptr_t>(memory) + bytes) & ~(kPage - 1);
    // Advice only: a system that does not know it gives small pages.
    if (begin < end) ::madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

} // namespace porthole
