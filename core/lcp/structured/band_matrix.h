// SPDX-License-Identifier: Apache-2.0
// Matrices whose nonzero entries are near the diagonal.

#ifndef DLCS_CORE_LCP_STRUCTURED_BAND_MATRIX_H_
#define DLCS_CORE_LCP_STRUCTURED_BAND_MATRIX_H_

#include <vector>

#include "core/types.h"

namespace dlcs {

// The least b with which all entries (i, j), |i - j| > b, are rounding: at most 8 ε of their row. At least 1. O(n²).
Index BandwidthUpToRounding(const Matrix& K);

// The entries (i, j) of an n × n matrix with |i - j| <= b, row by row: n (2b + 1) numbers.
class BandMatrix {
 public:
  // The entries of `K` within `bandwidth`; others are ignored.
  BandMatrix(const Matrix& K, Index bandwidth);

  Index size() const { return size_; }
  Index bandwidth() const { return bandwidth_; }
  // Entry (i, i + d) for -b <= d <= b stands at [d]; 0 where there is none.
  const double* Row(Index i) const { return &entries_[Start(i)]; }
  double* Row(Index i) { return &entries_[Start(i)]; }

 private:
  std::size_t Start(Index i) const { return static_cast<std::size_t>(i * (2 * bandwidth_ + 1) + bandwidth_); }

  Index size_, bandwidth_;
  std::vector<double> entries_;
};

// Products with a matrix by its diagonals. Functions of second differences with fixed ends, such as the K_0 of a
// Kronecker sum, have one number on each diagonal plus terms reflected at both ends,
//     K(i, j) = t_{|i-j|} - t_{i+j+2} - t_{2n-i-j},
// and are applied in this form: t is applied to the odd continuation of y beyond both ends, within the first cache.
class BandProduct {
 public:
  // Of the entries of `K` within `bandwidth`, others being zero. Cost: n times the bandwidth.
  BandProduct(const Matrix& K, Index bandwidth);

  // product = K y: 2 n (2b + 1) operations.
  void operator()(const Vector& y, Vector& product);

  bool is_reflected() const { return !reflected_.empty(); }

 private:
  Index n_, bandwidth_;
  std::vector<double> reflected_;  // t, where it is of that form
  Matrix above_, below_;           // otherwise K(i, i + d) and K(i, i - d) at (i, d - 1)
  Vector diagonal_;
  Vector padded_y_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_STRUCTURED_BAND_MATRIX_H_
