// SPDX-License-Identifier: Apache-2.0
#include "core/mpi/distributed_krylov.h"

namespace dlcs {

DistributedKrylov::DistributedKrylov(const DistributedRows& K, const Ownership& unknowns, bool is_symmetric,
                                     Workers& workers, MpiTeam& team)
    : KrylovSolver(Compressed(K.own), is_symmetric, workers, team), mpi_(team), halo_(K.halo) {
  outside_ = Compressed(K.outside);
  first_number_ = unknowns.first(team.rank());
  for (const Index unknown : halo_.unknowns()) outside_numbers_.push_back(unknowns.number(unknown));
  TryDiagonal();
}

void DistributedKrylov::Expand(const Vector& x) {
  halo_.Exchange(x, expanded_);
  outside_values_ = expanded_.col(0);
}

void DistributedKrylov::Precondition(const Vector& r, double /*size*/, Vector& z) {
  cycle_->Apply(r, z);
  for (std::size_t i = 0; i < fixed_in_cycle_.size(); ++i) {
    if (fixed_in_cycle_[i]) z[static_cast<Index>(i)] = 0;
  }
}

void DistributedKrylov::PrepareFixed(const std::vector<std::uint8_t>& is_fixed) {
  if (!mpi_.Any(!cycle_ || is_fixed != fixed_in_cycle_)) return;
  fixed_in_cycle_ = is_fixed;
  const Index size = K_.rows();
  Vector own(size);
  for (Index i = 0; i < size; ++i) own[i] = is_fixed[static_cast<std::size_t>(i)];
  Matrix outside;
  halo_.Exchange(own, outside);

  NumberedRows rows;
  for (Index i = 0; i < size; ++i) {
    const std::size_t before = rows.columns.size();
    const auto add = [&](Index number, double value) {
      rows.columns.push_back(static_cast<int>(number));
      rows.values.push_back(value);
    };
    for (int k = K_.start[i]; k < K_.start[i + 1]; ++k) {
      const int j = K_.column[k];
      if (j == i || (own[i] == 0 && own[j] == 0)) add(first_number_ + j, K_.value[k]);
    }
    for (int k = outside_.start[i]; k < outside_.start[i + 1]; ++k) {
      const int j = outside_.column[k];
      if (own[i] == 0 && outside(j, 0) == 0) add(outside_numbers_[static_cast<std::size_t>(j)], outside_.value[k]);
    }
    rows.numbers.push_back(static_cast<int>(first_number_ + i));
    rows.lengths.push_back(static_cast<int>(rows.columns.size() - before));
  }
  cycle_.reset();
  cycle_ = MultigridCycle::Make(mpi_.communicator(), rows, is_symmetric());
}

}  // namespace dlcs
