// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/sparse/aggregation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

constexpr int kNoGroup = -1;

void LookForStopAtSome(int row) {
  if (row % 4096 == 0) LookForStop();
}

std::vector<float> SizesOfDiagonal(const CompressedRows<float>& A) {
  std::vector<float> sizes(static_cast<std::size_t>(A.rows()));
  for (int i = 0; i < A.rows(); ++i) {
    for (int k = A.start[i]; k < A.start[i + 1]; ++k) {
      if (A.column[k] == i) sizes[i] = std::abs(A.value[k]);
    }
  }
  return sizes;
}

// Calls visit(j, a_ij) for the strong neighbors j of i.
class StrongNeighbors {
 public:
  StrongNeighbors(const CompressedRows<float>& A, double threshold, bool without_skew)
      : A_(A),
        transpose_(without_skew ? Transposed(A).value : std::vector<float>()),
        squared_(static_cast<float>(threshold * threshold)),
        diagonal_(SizesOfDiagonal(A)) {}

  template <typename Visit>
  void ForEach(int i, const Visit& visit) const {
    for (int k = A_.start[i]; k < A_.start[i + 1]; ++k) {
      const int j = A_.column[k];
      const float a = A_.value[k];
      if (j == i || a * a <= squared_ * diagonal_[i] * diagonal_[j]) continue;
      if (transpose_.empty() || (a < 0 && transpose_[k] <= 0)) visit(j, a);
    }
  }

 private:
  const CompressedRows<float>& A_;
  std::vector<float> transpose_;  // its values at the places of A, whose pattern is symmetric
  float squared_;
  std::vector<float> diagonal_;
};

struct Groups {
  std::vector<int> of;  // each unknown; kNoGroup without strong neighbors
  int count = 0;
};

Groups MakeGroups(int size, const StrongNeighbors& strong) {
  Groups groups{.of = std::vector<int>(static_cast<std::size_t>(size), kNoGroup)};
  std::vector<int>& of = groups.of;
  const auto begin_at = [&](int i) {
    of[i] = groups.count++;
    strong.ForEach(i, [&](int j, float) {
      if (of[j] == kNoGroup) of[j] = of[i];
    });
  };
  // Whole neighborhoods that do not overlap.
  for (int i = 0; i < size; ++i) {
    LookForStopAtSome(i);
    bool is_alone = true, is_free = of[i] == kNoGroup;
    strong.ForEach(i, [&](int j, float) {
      is_alone = false;
      is_free = is_free && of[j] == kNoGroup;
    });
    if (is_free && !is_alone) begin_at(i);
  }
  // What is left joins the group of its strongest neighbor.
  const std::vector<int> whole = of;
  for (int i = 0; i < size; ++i) {
    LookForStopAtSome(i);
    if (of[i] != kNoGroup) continue;
    float strongest = 0;
    strong.ForEach(i, [&](int j, float a) {
      if (whole[j] == kNoGroup || std::abs(a) <= strongest) return;
      strongest = std::abs(a);
      of[i] = whole[j];
    });
  }
  // Or it is among neighbors that have none either.
  for (int i = 0; i < size; ++i) {
    if (of[i] != kNoGroup) continue;
    bool is_alone = true;
    strong.ForEach(i, [&](int, float) { is_alone = false; });
    if (!is_alone) begin_at(i);
  }
  return groups;
}

}  // namespace

CompressedRows<float> SmoothedAggregation(const CompressedRows<float>& A, double threshold, bool without_skew) {
  constexpr float kDamping = 2.0F / 3;  // 4/3 of 1/2: no eigenvalue of the averages exceeds 2
  const StrongNeighbors strong(A, threshold, without_skew);
  const int size = static_cast<int>(A.rows());
  const Groups groups = MakeGroups(size, strong);
  CompressedRows<float> P{.cols = groups.count};
  P.start.reserve(static_cast<std::size_t>(size) + 1);
  std::vector<std::pair<int, float>> row;  // group and weight
  for (int i = 0; i < size; ++i) {
    LookForStopAtSome(i);
    row.clear();
    const auto add = [&](int group, float weight) {
      for (auto& [present, sum] : row) {
        if (present == group) {
          sum += weight;
          return;
        }
      }
      row.emplace_back(group, weight);
    };
    float sum = 0, size_of_sum = 0;
    const auto for_each_in_a_group = [&](const auto& visit) {
      strong.ForEach(i, [&](int j, float coupling) {
        if (groups.of[j] != kNoGroup) visit(groups.of[j], -coupling);
      });
    };
    for_each_in_a_group([&](int, float weight) {
      sum += weight;
      size_of_sum += std::abs(weight);
    });
    // A mean needs weights of one sign, most of them at least.
    const bool has_mean = sum > 0.5F * size_of_sum;
    if (groups.of[i] != kNoGroup) add(groups.of[i], has_mean ? 1 - kDamping : 1);
    if (has_mean) for_each_in_a_group([&](int group, float weight) { add(group, kDamping * weight / sum); });
    std::sort(row.begin(), row.end());
    for (const auto& [group, weight] : row) {
      P.column.push_back(group);
      P.value.push_back(weight);
    }
    P.start.push_back(static_cast<int>(P.column.size()));
  }
  return P;
}

CompressedRows<float> Transposed(const CompressedRows<float>& P) {
  CompressedRows<float> R{.cols = P.rows()};
  R.start.assign(static_cast<std::size_t>(P.cols) + 1, 0);
  R.column.resize(P.column.size());
  R.value.resize(P.value.size());
  for (const int j : P.column) ++R.start[j + 1];
  for (Index j = 0; j < P.cols; ++j) R.start[j + 1] += R.start[j];
  std::vector<int> next(R.start.begin(), R.start.end() - 1);
  for (int i = 0; i < P.rows(); ++i) {
    for (int k = P.start[i]; k < P.start[i + 1]; ++k) {
      const int at = next[P.column[k]]++;
      R.column[at] = i;
      R.value[at] = P.value[k];
    }
  }
  return R;
}

}  // namespace dlcs
