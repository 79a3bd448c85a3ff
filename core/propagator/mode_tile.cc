// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/mode_tile.h"

#include <algorithm>

#include "core/linalg/simd.h"

namespace dlcs {
namespace {

// Exponentials that are carried at once: with their factors they fill the registers of AVX-512.
constexpr Index kGroup = 4;

// Row r of an array of V is one part of row r of the tile.
template <class V, Index parts>
struct Part {
  const V *decay, *past_weight, *mid_weight;
  V* past;
  const V* inputs;
  V *nodes, *middles;
};

// What û adds by itself.
template <class V, Index parts>
DLCS_INLINE void Begin(const Part<V, parts>& part, const V& now, const V& mid_before, const V& mid_after, Index steps) {
  V before = part.inputs[0];
  for (Index j = 0; j < steps; ++j) {
    const V after = part.inputs[(j + 1) * parts];
    part.nodes[j * parts] = now * after;
    part.middles[j * parts] = mid_before * before + mid_after * after;
    before = after;
  }
}

// The exponentials k ... k + kGroup - 1.
template <class V, Index parts, bool nodes, bool middles>
DLCS_INLINE void CarryGroup(const Part<V, parts>& part, Index k, Index steps) {
  V decay[kGroup], weight[kGroup] = {}, mid_weight[kGroup] = {}, past[kGroup];
  for (Index i = 0; i < kGroup; ++i) {
    decay[i] = part.decay[(k + i) * parts];
    past[i] = part.past[(k + i) * parts];
    if constexpr (nodes) weight[i] = part.past_weight[(k + i) * parts];
    if constexpr (middles) mid_weight[i] = part.mid_weight[(k + i) * parts];
  }
  for (Index j = 0; j < steps; ++j) {
    const V input = part.inputs[j * parts];
    if constexpr (middles) {
      V sum = part.middles[j * parts];
      for (Index i = 0; i < kGroup; ++i) sum += mid_weight[i] * past[i];
      part.middles[j * parts] = sum;
    }
    for (Index i = 0; i < kGroup; ++i) past[i] = decay[i] * past[i] + input;
    if constexpr (nodes) {
      V sum = part.nodes[j * parts];
      for (Index i = 0; i < kGroup; ++i) sum += weight[i] * past[i];
      part.nodes[j * parts] = sum;
    }
  }
  for (Index i = 0; i < kGroup; ++i) part.past[(k + i) * parts] = past[i];
}

using Row = ModeTile::Row;
using Sums = ModeTile::Sums;

struct Rows {
  Index terms, steps;
  const Row *decay, *past_weight, *mid_weight;
  Row* past;
  const Row *inputs, *now, *mid_before, *mid_after;
  Row *nodes, *middles;
};

template <class V>
DLCS_INLINE void CarryRows(const Rows& rows, Sums sums) {
  constexpr Index parts = sizeof(Row) / sizeof(V);
  const Index steps = rows.steps;
  const auto vectors = [](const Row* row) { return reinterpret_cast<const V*>(row); };
  const auto written = [](Row* row) { return reinterpret_cast<V*>(row); };
  for (Index p = 0; p < parts; ++p) {
    const Part<V, parts> part{vectors(rows.decay) + p,  vectors(rows.past_weight) + p, vectors(rows.mid_weight) + p,
                              written(rows.past) + p,   vectors(rows.inputs) + p,      written(rows.nodes) + p,
                              written(rows.middles) + p};
    if (sums != Sums::kNone) {
      Begin(part, vectors(rows.now)[p], vectors(rows.mid_before)[p], vectors(rows.mid_after)[p], steps);
    }
    for (Index k = 0; k < rows.terms; k += kGroup) {
      if (sums == Sums::kNone) CarryGroup<V, parts, false, false>(part, k, steps);
      if (sums == Sums::kNodes) CarryGroup<V, parts, true, false>(part, k, steps);
      if (sums == Sums::kNodesAndMiddles) CarryGroup<V, parts, true, true>(part, k, steps);
    }
  }
}

// Most tiles are full. These are copied without a function call.
DLCS_INLINE void CopyModes(const double* from, Index count, double* to) {
  if (count == ModeTile::kModes) {
    std::copy_n(from, ModeTile::kModes, to);
  } else {
    std::copy_n(from, count, to);
  }
}

void CarryBaseline(const Rows& rows, Sums sums) { CarryRows<Double2>(rows, sums); }
DLCS_TARGET("avx2") void CarryAvx2(const Rows& rows, Sums sums) { CarryRows<Double4>(rows, sums); }
DLCS_TARGET("avx512f") void CarryAvx512(const Rows& rows, Sums sums) { CarryRows<Double8>(rows, sums); }

}  // namespace

ModeTile::ModeTile(const ModeRecursion& recursion, Index begin, Index count, const Eigen::Ref<const Vector>& first,
                   bool forgets_first)
    : begin_(begin),
      count_(count),
      terms_(recursion.decay.cols()),
      decay_(RowsOf(recursion.decay)),
      past_weight_(RowsOf(recursion.past)),
      mid_weight_(RowsOf(recursion.mid_past)),
      past_(RowsOf(recursion.start)),
      now_(RowOf(recursion.now)),
      mid_before_(RowOf(recursion.mid_before)),
      mid_after_(RowOf(recursion.mid_after)),
      inputs_(kSteps + 1, Row{}),
      nodes_(kSteps),
      middles_(kSteps) {
  for (Row& row : past_) {
    for (Index r = 0; r < count_; ++r) row.mode[r] *= first[begin_ + r];
  }
  if (forgets_first) return;
  for (Index r = 0; r < count_; ++r) inputs_[0].mode[r] = first[begin_ + r];
}

void ModeTile::Carry(const Eigen::Ref<const Matrix>& inputs, Sums sums) {
  const auto steps = inputs.cols();
  for (Index j = 0; j < steps; ++j) {
    CopyModes(inputs.col(j).data() + begin_, count_, inputs_[static_cast<std::size_t>(j + 1)].mode);
  }
  static const auto carry = ChooseVersion(CarryBaseline, CarryAvx2, CarryAvx512);
  carry({static_cast<Index>(decay_.size()), steps, decay_.data(), past_weight_.data(), mid_weight_.data(), past_.data(),
         inputs_.data(), &now_, &mid_before_, &mid_after_, nodes_.data(), middles_.data()},
        sums);
  inputs_[0] = inputs_[static_cast<std::size_t>(steps)];
}

Matrix ModeTile::Past() const {
  Matrix past(count_, terms_);
  for (Index k = 0; k < terms_; ++k) std::copy_n(past_[static_cast<std::size_t>(k)].mode, count_, past.col(k).data());
  return past;
}

// As many as make whole groups; what is added is zero. An array that there is none of is zero, too.
std::vector<ModeTile::Row> ModeTile::RowsOf(const Matrix& terms) const {
  std::vector<Row> rows(static_cast<std::size_t>((terms_ + kGroup - 1) / kGroup * kGroup), Row{});
  for (Index k = 0; k < terms.cols(); ++k) {
    std::copy_n(terms.col(k).data() + begin_, count_, rows[static_cast<std::size_t>(k)].mode);
  }
  return rows;
}

ModeTile::Row ModeTile::RowOf(const Vector& values) const {
  Row row{};
  if (values.size() > 0) std::copy_n(values.data() + begin_, count_, row.mode);
  return row;
}

void ModeTile::Store(const std::vector<Row>& from, Eigen::Ref<Matrix> values) const {
  for (Index j = 0; j < values.cols(); ++j) {
    CopyModes(from[static_cast<std::size_t>(j)].mode, count_, values.col(j).data() + begin_);
  }
}

void ModeTile::Add(const std::vector<Row>& from, Eigen::Ref<Matrix> values) const {
  for (Index j = 0; j < values.cols(); ++j) {
    const double* const row = from[static_cast<std::size_t>(j)].mode;
    values.col(j).segment(begin_, count_) += Eigen::Map<const Vector>(row, count_);
  }
}

}  // namespace dlcs
