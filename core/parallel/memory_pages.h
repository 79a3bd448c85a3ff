// SPDX-License-Identifier: Apache-2.0
// How a program that solves again and again keeps its memory.

#ifndef DLCS_CORE_PARALLEL_MEMORY_PAGES_H_
#define DLCS_CORE_PARALLEL_MEMORY_PAGES_H_

#include <cstddef>

namespace dlcs {

// Freed memory stays with the process, up to 64 MB a heap, for the next array. As it comes, glibc gives arrays of some
// hundred kilobytes back to the system whenever they are freed, and taking them again costs a fault a page: a quarter
// of a march of n = 255 and J = 400. malloc_trim(0) gives memory back nevertheless.
//
// For main(), before there are threads: a library leaves the heap to its program. Does nothing with other C libraries.
void RetainFreedMemory();

// Asks the system for large pages below an array that is not written yet. Half a gigabyte is then taken with some
// hundred faults instead of a hundred thousand, and given back in a millisecond instead of twenty, which nothing could
// interrupt. A hint: does nothing on systems that have no such pages or keep them for others.
void AdviseHugePages(void* data, std::size_t bytes);

}  // namespace dlcs

#endif  // DLCS_CORE_PARALLEL_MEMORY_PAGES_H_
