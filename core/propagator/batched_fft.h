// SPDX-License-Identifier: Apache-2.0
// Fourier transforms of several sequences side by side.

#ifndef DLCS_CORE_PROPAGATOR_BATCHED_FFT_H_
#define DLCS_CORE_PROPAGATOR_BATCHED_FFT_H_

#include <vector>

#include "core/types.h"

namespace dlcs {

// X_k = Σ_j x_j e^{-2πijk/length} by Stockham's algorithm with the radices 4, 2, 3 and 5. Element j of the sequence in
// lane l stands at [j · lanes + l]: the inner loops of every pass run over the lanes, so that sixteen transforms take
// little longer than one. There is no planning by measurement, and the bits of a lane depend only on its own sequence.
// Source: [Van Loan 1992] C. Van Loan. Computational frameworks for the fast Fourier transform. SIAM. Section 1.7.
class BatchedFft {
 public:
  // 2^a 3^b 5^c.
  static bool IsFastLength(Index length);

  BatchedFft() = default;
  // `length` must be fast.
  explicit BatchedFft(Index length);

  Index length() const { return length_; }

  struct Parts {
    double *re, *im;
  };
  // Transforms `x`; uses `work`, of the same size, length · lanes. Returns the one of the two that holds the result.
  // Threads: any number at once.
  Parts Forward(Index lanes, Parts x, Parts work) const;

 private:
  // Length n of the transforms that are left is cut into radix times n / radix.
  struct Pass {
    Index radix, n, stride;
    Vector re, im;  // e^{-2πikr/n} at [k · (radix - 1) + r - 1], k < n / radix
  };

  Index length_ = 0;
  std::vector<Pass> passes_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_BATCHED_FFT_H_
