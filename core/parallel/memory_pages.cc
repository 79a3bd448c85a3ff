// SPDX-License-Identifier: Apache-2.0
#include "core/parallel/memory_pages.h"

#include <cstdlib>

#ifdef __GLIBC__
#include <malloc.h>
#endif
#ifdef __linux__
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#endif

// Of jemalloc, where a program links it.
extern "C" int mallctl(const char* name, void* old, std::size_t* old_size, void* value, std::size_t size)
    __attribute__((weak));

namespace dlcs {

void RetainFreedMemory() {
  if (mallctl) {
    // Without its thread jemalloc returns memory only when more is allocated, which an idle server does not do.
    bool yes = true;
    mallctl("background_thread", nullptr, nullptr, &yes, sizeof yes);
    return;
  }
#ifdef __GLIBC__
  constexpr int kMegabyte = 1 << 20;
  mallopt(M_MMAP_THRESHOLD, 32 * kMegabyte);
  mallopt(M_TRIM_THRESHOLD, 64 * kMegabyte);
#endif
}

void ReturnFreedMemory() {
  if (mallctl) {
    constexpr const char* kPurgeAllArenas = "arena.4096.purge";
    mallctl(kPurgeAllArenas, nullptr, nullptr, nullptr, 0);
    return;
  }
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

void AdviseHugePages([[maybe_unused]] void* data, [[maybe_unused]] std::size_t bytes) {
#ifdef __linux__
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto address = reinterpret_cast<std::uintptr_t>(data);
  const std::uintptr_t begin = (address + page - 1) / page * page, end = (address + bytes) / page * page;
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);  // whether or not it is taken
#endif
}

}  // namespace dlcs
