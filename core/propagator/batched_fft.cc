// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/batched_fft.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "core/linalg/simd/simd_dispatch.h"

namespace dlcs {
namespace {

// Transforms of a few elements, in place. Real and imaginary parts are kept apart, for the sake of the vectorizer.
template <int radix>
struct Butterfly;

template <>
struct Butterfly<2> {
  DLCS_WIDE static void Apply(double* re, double* im) {
    const double re0 = re[0], im0 = im[0];
    re[0] = re0 + re[1];
    im[0] = im0 + im[1];
    re[1] = re0 - re[1];
    im[1] = im0 - im[1];
  }
};

template <>
struct Butterfly<3> {
  DLCS_WIDE static void Apply(double* re, double* im) {
    // Table: sin of 2π/3.
    constexpr double kSin = 0.5 * std::numbers::sqrt3;
    const double sum_re = re[1] + re[2], sum_im = im[1] + im[2];
    const double turned_re = kSin * (im[2] - im[1]), turned_im = kSin * (re[1] - re[2]);
    const double middle_re = re[0] - 0.5 * sum_re, middle_im = im[0] - 0.5 * sum_im;
    re[0] += sum_re;
    im[0] += sum_im;
    re[1] = middle_re - turned_re;
    im[1] = middle_im - turned_im;
    re[2] = middle_re + turned_re;
    im[2] = middle_im + turned_im;
  }
};

template <>
struct Butterfly<4> {
  DLCS_WIDE static void Apply(double* re, double* im) {
    const double even_re = re[0] + re[2], even_im = im[0] + im[2], odd_re = re[0] - re[2], odd_im = im[0] - im[2];
    const double sum_re = re[1] + re[3], sum_im = im[1] + im[3], turned_re = im[3] - im[1], turned_im = re[1] - re[3];
    re[0] = even_re + sum_re;
    im[0] = even_im + sum_im;
    re[1] = odd_re - turned_re;
    im[1] = odd_im - turned_im;
    re[2] = even_re - sum_re;
    im[2] = even_im - sum_im;
    re[3] = odd_re + turned_re;
    im[3] = odd_im + turned_im;
  }
};

template <>
struct Butterfly<5> {
  DLCS_WIDE static void Apply(double* re, double* im) {
    // Table: cos and sin of 2π/5 and 4π/5.
    constexpr double kCos1 = 0.30901699437494742410, kCos2 = -0.80901699437494742410;
    constexpr double kSin1 = 0.95105651629515357212, kSin2 = 0.58778525229247312917;
    const double near_re = re[1] + re[4], near_im = im[1] + im[4], far_re = re[2] + re[3], far_im = im[2] + im[3];
    const double by_near_re = im[4] - im[1], by_near_im = re[1] - re[4];
    const double by_far_re = im[3] - im[2], by_far_im = re[2] - re[3];
    const double first_re = re[0] + kCos1 * near_re + kCos2 * far_re,
                 first_im = im[0] + kCos1 * near_im + kCos2 * far_im;
    const double second_re = re[0] + kCos2 * near_re + kCos1 * far_re;
    const double second_im = im[0] + kCos2 * near_im + kCos1 * far_im;
    const double turned1_re = kSin1 * by_near_re + kSin2 * by_far_re,
                 turned1_im = kSin1 * by_near_im + kSin2 * by_far_im;
    const double turned2_re = kSin2 * by_near_re - kSin1 * by_far_re,
                 turned2_im = kSin2 * by_near_im - kSin1 * by_far_im;
    re[0] += near_re + far_re;
    im[0] += near_im + far_im;
    re[1] = first_re - turned1_re;
    im[1] = first_im - turned1_im;
    re[2] = second_re - turned2_re;
    im[2] = second_im - turned2_im;
    re[3] = second_re + turned2_re;
    im[3] = second_im + turned2_im;
    re[4] = first_re + turned1_re;
    im[4] = first_im + turned1_im;
  }
};

// y[q + s(radix k + r)] = e^{-2πikr/n} (the transform of x[q + s(k + j n/radix)], j < radix)_r for q < s. The inner
// loop has to be free of loops, so those over j and r are written as packs.
template <int radix, int... j, int... r>
void RunPass(Index n, Index s, const double* w_re, const double* w_im, BatchedFft::Parts from, BatchedFft::Parts to,
             std::integer_sequence<int, j...> /*all*/, std::integer_sequence<int, r...> /*all but the last*/) {
  RunWide([=]() DLCS_WIDE {
    const Index m = n / radix;
    for (Index k = 0; k < m; ++k) {
      const double* __restrict x_re = from.re + s * k;
      const double* __restrict x_im = from.im + s * k;
      double* __restrict y_re = to.re + s * radix * k;
      double* __restrict y_im = to.im + s * radix * k;
      const double turn_re[] = {w_re[k * (radix - 1) + r]...};
      const double turn_im[] = {w_im[k * (radix - 1) + r]...};
      // All elements that are written are distinct, and none is read.
#pragma GCC ivdep
      for (Index q = 0; q < s; ++q) {
        double re[] = {x_re[q + s * m * j]...};
        double im[] = {x_im[q + s * m * j]...};
        Butterfly<radix>::Apply(re, im);
        y_re[q] = re[0];
        y_im[q] = im[0];
        ((y_re[q + s * (r + 1)] = turn_re[r] * re[r + 1] - turn_im[r] * im[r + 1]), ...);
        ((y_im[q + s * (r + 1)] = turn_re[r] * im[r + 1] + turn_im[r] * re[r + 1]), ...);
      }
    }
  });
}

template <int radix>
void RunPass(Index n, Index s, const double* w_re, const double* w_im, BatchedFft::Parts from, BatchedFft::Parts to) {
  RunPass<radix>(n, s, w_re, w_im, from, to, std::make_integer_sequence<int, radix>(),
                 std::make_integer_sequence<int, radix - 1>());
}

}  // namespace

bool BatchedFft::IsFastLength(Index length) {
  for (const Index prime : {2, 3, 5}) {
    while (length % prime == 0) length /= prime;
  }
  return length == 1;
}

BatchedFft::BatchedFft(Index length) : length_(length) {
  Index stride = 1;
  for (Index n = length; n > 1;) {
    const Index radix = n % 4 == 0 ? 4 : n % 2 == 0 ? 2 : n % 3 == 0 ? 3 : 5;
    Pass pass{radix, n, stride, Vector(n / radix * (radix - 1)), Vector(n / radix * (radix - 1))};
    for (Index k = 0; k < n / radix; ++k) {
      for (Index r = 1; r < radix; ++r) {
        const double angle = -2 * std::numbers::pi * static_cast<double>(k * r) / static_cast<double>(n);
        pass.re[k * (radix - 1) + r - 1] = std::cos(angle);
        pass.im[k * (radix - 1) + r - 1] = std::sin(angle);
      }
    }
    passes_.push_back(std::move(pass));
    n /= radix;
    stride *= radix;
  }
}

BatchedFft::Parts BatchedFft::Forward(Index lanes, Parts x, Parts work) const {
  for (const Pass& pass : passes_) {
    const Index s = pass.stride * lanes;
    const double *re = pass.re.data(), *im = pass.im.data();
    switch (pass.radix) {
      case 2:
        RunPass<2>(pass.n, s, re, im, x, work);
        break;
      case 3:
        RunPass<3>(pass.n, s, re, im, x, work);
        break;
      case 4:
        RunPass<4>(pass.n, s, re, im, x, work);
        break;
      default:
        RunPass<5>(pass.n, s, re, im, x, work);
    }
    std::swap(x, work);
  }
  return x;
}

}  // namespace dlcs
