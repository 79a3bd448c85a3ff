// SPDX-License-Identifier: Apache-2.0
// Vectors of doubles, for loops that the compiler does not vectorize by itself (core/linalg/simd_dispatch.h is for
// those that it does), compiled once for each width of registers.

#ifndef DLCS_CORE_LINALG_SIMD_H_
#define DLCS_CORE_LINALG_SIMD_H_

#include <cstring>

#include "core/linalg/simd_dispatch.h"

// A loop over vectors is a template on the type of vector, inlined into one function per instruction set; which of them
// runs is chosen when the program runs. Every lane does IEEE arithmetic, and contraction is off (CMakeLists.txt): so a
// loop whose elements do not depend on each other has the same bits on every machine. Sums over lanes have not, and are
// not to be formed.
#define DLCS_INLINE [[gnu::always_inline]] inline

// Functions that take or return vectors are inlined, so no caller sees the convention that the warning is about.
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

#endif  // DLCS_CORE_LINALG_SIMD_H_
