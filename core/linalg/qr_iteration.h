// SPDX-License-Identifier: Apache-2.0
// The loop of the QR algorithm with single shifts, for any kind of numbers.

#ifndef DLCS_CORE_LINALG_QR_ITERATION_H_
#define DLCS_CORE_LINALG_QR_ITERATION_H_

#include "core/parallel/stop_scope.h"
#include "core/types.h"

namespace dlcs {

// Makes an upper Hessenberg matrix T of `size` rows upper triangular, from the last eigenvalue up. `qr` holds T and has
//     bool CutsOff(i)                   sets T(i+1, i) to zero if it is negligible relative to the diagonal entries
//                                       next to it
//     Number Shift(end, iteration)      the shift for the block that ends at `end`, after so many iterations for one
//                                       eigenvalue
//     void Begin(begin, end, shift)     rotates rows and columns begin, begin + 1 so that T - shift loses its first
//                                       entry below the diagonal
//     void Chase(i, end)                the same at i, so that T(i+1, i-1) vanishes
// False if the eigenvalues take more than `most_iterations` on average. Checks for a stop before every rotation.
// Source: [Golub & Van Loan 2013, 7.5].
template <typename Qr>
bool IterateQr(Index size, Index most_iterations, Qr& qr) {
  Index left = most_iterations * size;
  int iteration = 0;  // since the last eigenvalue was found
  for (Index end = size - 1; end > 0;) {
    if (qr.CutsOff(end - 1)) {
      --end;
      iteration = 0;
      continue;
    }
    if (left-- == 0) return false;
    Index begin = end - 1;
    while (begin > 0 && !qr.CutsOff(begin - 1)) --begin;
    qr.Begin(begin, end, qr.Shift(end, iteration++));
    for (Index i = begin + 1; i < end; ++i) {
      LookForStop();
      qr.Chase(i, end);
    }
  }
  return true;
}

}  // namespace dlcs

#endif  // DLCS_CORE_LINALG_QR_ITERATION_H_
