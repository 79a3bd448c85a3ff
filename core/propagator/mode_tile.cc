// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/mode_tile.h"

#include <algorithm>

#include "core/linalg/simd/simd.h"

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

ModeTile::Terms::Terms(const ModeRecursion& recursion, Index first_mode, Index num_modes)
    : begin(first_mode), count(num_modes), exponentials(recursion.decay.cols()) {
  // As many as make whole groups; what is added is zero. An array that there is none of is zero, too.
  const auto rows_of = [&](const Matrix& values) {
    std::vector<Row> rows(static_cast<std::size_t>((exponentials + kGroup - 1) / kGroup * kGroup), Row{});
    for (Index k = 0; k < values.cols(); ++k) {
      std::copy_n(values.col(k).data() + begin, count, rows[static_cast<std::size_t>(k)].mode);
    }
    return rows;
  };
  const auto row_of = [&](const Vector& values) {
    Row row{};
    if (values.size() > 0) std::copy_n(values.data() + begin, count, row.mode);
    return row;
  };
  decay = rows_of(recursion.decay);
  past_weight = rows_of(recursion.past);
  mid_weight = rows_of(recursion.mid_past);
  start = rows_of(recursion.start);
  now = row_of(recursion.now);
  mid_before = row_of(recursion.mid_before);
  mid_after = row_of(recursion.mid_after);
}

ModeTile::ModeTile(const Terms& terms, const Eigen::Ref<const Vector>& first, bool forgets_first, Index most_steps)
    : terms_(terms),
      past_(terms.start),
      inputs_(static_cast<std::size_t>(most_steps + 1), Row{}),
      nodes_(static_cast<std::size_t>(most_steps)),
      middles_(static_cast<std::size_t>(most_steps)) {
  for (Row& row : past_) {
    for (Index r = 0; r < terms.count; ++r) row.mode[r] *= first[terms.begin + r];
  }
  if (forgets_first) return;
  for (Index r = 0; r < terms.count; ++r) inputs_[0].mode[r] = first[terms.begin + r];
}

void ModeTile::Carry(const Eigen::Ref<const Matrix>& inputs, Sums sums) {
  const auto steps = inputs.cols();
  for (Index j = 0; j < steps; ++j) {
    CopyModes(inputs.col(j).data() + terms_.begin, terms_.count, inputs_[static_cast<std::size_t>(j + 1)].mode);
  }
  static const auto carry = ChooseVersion(CarryBaseline, CarryAvx2, CarryAvx512);
  carry({static_cast<Index>(past_.size()), steps, terms_.decay.data(), terms_.past_weight.data(),
         terms_.mid_weight.data(), past_.data(), inputs_.data(), &terms_.now, &terms_.mid_before, &terms_.mid_after,
         nodes_.data(), middles_.data()},
        sums);
  inputs_[0] = inputs_[static_cast<std::size_t>(steps)];
}

Matrix ModeTile::Past() const {
  Matrix past(terms_.count, terms_.exponentials);
  for (Index k = 0; k < past.cols(); ++k) {
    std::copy_n(past_[static_cast<std::size_t>(k)].mode, past.rows(), past.col(k).data());
  }
  return past;
}

void ModeTile::Store(const std::vector<Row>& from, Eigen::Ref<Matrix> values) const {
  for (Index j = 0; j < values.cols(); ++j) {
    CopyModes(from[static_cast<std::size_t>(j)].mode, terms_.count, values.col(j).data() + terms_.begin);
  }
}

void ModeTile::Add(const std::vector<Row>& from, Eigen::Ref<Matrix> values) const {
  for (Index j = 0; j < values.cols(); ++j) {
    const double* const row = from[static_cast<std::size_t>(j)].mode;
    values.col(j).segment(terms_.begin, terms_.count) += Eigen::Map<const Vector>(row, terms_.count);
  }
}

}  // namespace dlcs
