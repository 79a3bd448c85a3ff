// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/mode_history.h"

#include <algorithm>

#include "core/linalg/simd/simd.h"

namespace dlcs {
namespace {

constexpr Index kNodes = ModeHistory::kNodes, kModes = ModeHistory::kModes;

struct Tiles {
  Index tiles, terms;
  const double *decay, *weight;
  double* past;
  const double* inputs;  // `stride` from column to column, as of `ahead`
  double* ahead;
  Index stride;
};

template <typename V, bool takes_inputs>
DLCS_INLINE void PassTiles(const Tiles& all) {
  constexpr Index kWidth = sizeof(V) / sizeof(double);
  for (Index tile = 0; tile < all.tiles; ++tile) {
    for (Index part = 0; part < kModes; part += kWidth) {
      const Index mode = tile * kModes + part;
      V inputs[kNodes] = {}, sums[kNodes] = {};
      if constexpr (takes_inputs) {
        for (Index m = 0; m < kNodes; ++m) inputs[m] = Load<V>(all.inputs + m * all.stride + mode);
      }
      Index at = tile * all.terms * kModes + part;
      for (Index k = 0; k < all.terms; ++k, at += kModes) {
        const V decay = Load<V>(all.decay + at), weight = Load<V>(all.weight + at);
        V past = Load<V>(all.past + at);
        if constexpr (takes_inputs) {
          for (Index m = 0; m < kNodes; ++m) past = decay * past + inputs[m];
          Store(past, all.past + at);
        }
        for (Index m = 0; m < kNodes; ++m) {
          sums[m] += weight * past;
          past *= decay;
        }
      }
      for (Index m = 0; m < kNodes; ++m) Store(sums[m], all.ahead + m * all.stride + mode);
    }
  }
}

template <typename V>
DLCS_INLINE void PassAll(const Tiles& all, bool takes_inputs) {
  takes_inputs ? PassTiles<V, true>(all) : PassTiles<V, false>(all);
}

void PassBaseline(const Tiles& all, bool takes_inputs) { PassAll<Double2>(all, takes_inputs); }
DLCS_TARGET("avx2") void PassAvx2(const Tiles& all, bool takes_inputs) { PassAll<Double4>(all, takes_inputs); }
DLCS_TARGET("avx512f") void PassAvx512(const Tiles& all, bool takes_inputs) { PassAll<Double8>(all, takes_inputs); }

}  // namespace

ModeHistory::ModeHistory(const ModeRecursion& recursion, const Vector& first, bool forgets_first)
    : terms_(recursion.decay.cols()),
      num_modes_(recursion.decay.rows()),
      decay_(TilesOf(recursion.decay)),
      weight_(TilesOf(recursion.past)),
      past_(TilesOf((recursion.start.array().colwise() * first.array()).matrix())),
      sum_(num_modes_) {
  const Index tiles = (num_modes_ + kModes - 1) / kModes;
  effects_ = ahead_ = inputs_ = Matrix::Zero(tiles * kModes, kNodes);
  Matrix effect = recursion.past;
  for (Index m = 0; m < kNodes; ++m) {
    effects_.col(m).head(num_modes_) = effect.rowwise().sum();
    effect = effect.cwiseProduct(recursion.decay);
  }
  Pass(false);
  Push(forgets_first ? Vector(Vector::Zero(first.size())) : first);
}

void ModeHistory::Push(const Eigen::Ref<const Vector>& input) {
  inputs_.col(num_inputs_++).head(num_modes_) = input;
  if (num_inputs_ == kNodes) Pass(true);
  sum_ = ahead_.col(num_inputs_).head(num_modes_);
  for (Index l = 0; l < num_inputs_; ++l) {
    sum_ += effects_.col(num_inputs_ - 1 - l).head(num_modes_).cwiseProduct(inputs_.col(l).head(num_modes_));
  }
}

void ModeHistory::Pass(bool takes_inputs) {
  static const auto pass = ChooseVersion(PassBaseline, PassAvx2, PassAvx512);
  pass({ahead_.rows() / kModes, terms_, decay_.data()->mode, weight_.data()->mode, past_.data()->mode, inputs_.data(),
        ahead_.data(), ahead_.rows()},
       takes_inputs);
  num_inputs_ = 0;
}

std::vector<ModeHistory::Row> ModeHistory::TilesOf(const Matrix& terms) const {
  std::vector<Row> rows(static_cast<std::size_t>((num_modes_ + kModes - 1) / kModes * terms_));
  for (Index k = 0; k < terms_; ++k) {
    for (Index r = 0; r < num_modes_; ++r) {
      rows[static_cast<std::size_t>(r / kModes * terms_ + k)].mode[r % kModes] = terms(r, k);
    }
  }
  return rows;
}

}  // namespace dlcs
