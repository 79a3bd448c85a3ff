// SPDX-License-Identifier: Apache-2.0
// Runs loops over plain arrays with the widest vector registers of the processor.

#ifndef DLCS_CORE_LINALG_SIMD_SIMD_DISPATCH_H_
#define DLCS_CORE_LINALG_SIMD_SIMD_DISPATCH_H_

// Marks the lambda passed to RunWide() and the functions it calls: [&]() DLCS_WIDE { ... }
#define DLCS_WIDE __attribute__((always_inline))

namespace dlcs {

enum class Registers { kBaseline, kAvx2, kAvx512 };

// Of this processor.
inline Registers WidestRegisters() {
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx512f")) return Registers::kAvx512;
  if (__builtin_cpu_supports("avx2")) return Registers::kAvx2;
#endif
  return Registers::kBaseline;
}

namespace wide_internal {

template <class Body>
[[gnu::noinline]] void RunBaseline(const Body& body) {
  body();
}
#ifdef __x86_64__
template <class Body>
[[gnu::noinline, gnu::target("avx2")]] void RunAvx2(const Body& body) {
  body();
}
template <class Body>
#ifdef __clang__  // has no attribute for a preferred width
[[gnu::noinline, gnu::target("avx512f")]] void RunAvx512(const Body& body) {
#else
[[gnu::noinline, gnu::target("avx512f,prefer-vector-width=512")]] void RunAvx512(const Body& body) {
#endif
  body();
}
#endif

}  // namespace wide_internal

// Calls body(), compiled for these registers. Its loops are vectorized where they run over elements that do not depend
// on each other, through pointers that are declared __restrict. Each element goes through its operations in the order
// in which they are written, in IEEE arithmetic and without contraction, so the bits of the result are the same on
// every processor.
template <class Body>
void RunWide(const Body& body) {
#ifdef __x86_64__
  static const Registers registers = WidestRegisters();
  if (registers == Registers::kAvx512) return wide_internal::RunAvx512(body);
  if (registers == Registers::kAvx2) return wide_internal::RunAvx2(body);
#endif
  wide_internal::RunBaseline(body);
}

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_SIMD_SIMD_DISPATCH_H_
