// SPDX-License-Identifier: Apache-2.0
// How a program that solves again and again keeps its memory.

#ifndef DLCS_CORE_HEAP_H_
#define DLCS_CORE_HEAP_H_

namespace dlcs {

// Freed memory stays with the process, up to 64 MB a heap, for the next array. As it comes, glibc gives arrays of some
// hundred kilobytes back to the system whenever they are freed, and taking them again costs a fault a page: a quarter
// of a march of n = 255 and J = 400. malloc_trim(0) gives memory back nevertheless.
//
// For main(), before there are threads: a library leaves the heap to its program. Does nothing with other C libraries.
void KeepFreedMemory();

}  // namespace dlcs

#endif  // DLCS_CORE_HEAP_H_
