// SPDX-License-Identifier: Apache-2.0
// Vectors of doubles, for loops that the compiler does not vectorize by itself, compiled once for each register width.
// For loops that it does vectorize see core/linalg/simd/simd_dispatch.h.

#ifndef DLCS_CORE_LINALG_SIMD_SIMD_H_
#define DLCS_CORE_LINALG_SIMD_SIMD_H_

#include <cstring>

#include "core/linalg/simd/simd_dispatch.h"

// A loop over vectors is a template on the type of vector, inlined into one function per instruction set; the function
// is chosen at run time. Every lane does IEEE arithmetic, and contraction is off (CMakeLists.txt), so a loop with
// independent elements has the same bits on every machine. Sums over lanes do not, and must not be formed.
#define DLCS_INLINE [[gnu::always_inline]] inline

// Functions that take or return vectors are always inlined, so the calling convention that the warning is about is not
// used.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace dlcs {

using Double2 = double __attribute__((vector_size(16)));
using Double4 = double __attribute__((vector_size(32)));
using Double8 = double __attribute__((vector_size(64)));

template <typename V>
DLCS_INLINE V Load(const double* from) {
  V vector;
  std::memcpy(&vector, from, sizeof(V));
  return vector;
}
template <typename V>
DLCS_INLINE void Store(const V& vector, double* to) {
  std::memcpy(to, &vector, sizeof(V));
}

// The widest of three versions of a function that this processor has the instructions for.
template <typename Function>
Function* ChooseVersion(Function* baseline, Function* avx2, Function* avx512f) {
  const Registers registers = WidestRegisters();
  if (registers == Registers::kAvx512) return avx512f;
  if (registers == Registers::kAvx2) return avx2;
  return baseline;
}

#ifdef __x86_64__
#define DLCS_TARGET(name) [[gnu::target(name)]]
#else
#define DLCS_TARGET(name)
#endif

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SIMD_SIMD_H_
