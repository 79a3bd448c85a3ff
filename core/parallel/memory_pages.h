// SPDX-License-Identifier: Apache-2.0
// Tunes the allocator for programs that solve many problems.

#ifndef DLCS_CORE_PARALLEL_MEMORY_PAGES_H_
#define DLCS_CORE_PARALLEL_MEMORY_PAGES_H_

#include <cstddef>

namespace dlcs {

// Freed memory stays with the process for the next array: with glibc up to 64 MB per heap, with jemalloc for ten
// seconds. By default glibc returns arrays of some hundred kilobytes to the system whenever they are freed, and
// allocating them again costs one page fault per page: a quarter of the time of an exponential-integrator solve with n
// = 255 and J = 400.
//
// To be called by main() before threads are started; libraries should not change the heap. Does nothing with other
// allocators.
void RetainFreedMemory();

// Returns freed memory to the system, with these two allocators.
void ReturnFreedMemory();

// Asks the system for huge pages for an array that is not written yet. Half a gigabyte then takes some hundred page
// faults instead of a hundred thousand, and is freed in one millisecond instead of twenty (which cannot be
// interrupted). A hint: does nothing on systems without huge pages.
void AdviseHugePages(void* data, std::size_t bytes);

}  // namespace dlcs

#endif  // DLCS_CORE_PARALLEL_MEMORY_PAGES_H_
