// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/strong_components.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dlcs {
namespace {

// Tarjan's algorithm, without recursion. `Neighbors` visits those of a vertex: Next(i, place) returns the one at the
// place, which it advances, or -1 after the last.
template <typename Neighbors>
class Components {
 public:
  Components(Index vertices, const Neighbors& neighbors)
      : neighbors_(neighbors), number_(vertices, -1), lowest_(vertices, -1), is_open_(vertices, false) {
    for (Index root = vertices - 1; root >= 0; --root) {
      if (number_[root] < 0) Visit(root);
    }
    std::reverse(components_.begin(), components_.end());
  }
  std::vector<std::vector<Index>> Take() { return std::move(components_); }

 private:
  struct Visitor {
    Index vertex;
    Index place;  // of the neighbor to look at
  };

  void Open(Index vertex, std::vector<Visitor>& path) {
    number_[vertex] = lowest_[vertex] = count_++;
    open_.push_back(vertex);
    is_open_[vertex] = true;
    path.push_back({vertex, 0});
  }

  void Visit(Index root) {
    std::vector<Visitor> path;
    Open(root, path);
    while (!path.empty()) {
      const Index i = path.back().vertex, j = neighbors_.Next(i, path.back().place);
      if (j >= 0) {
        if (number_[j] < 0) {
          Open(j, path);
        } else if (is_open_[j]) {
          lowest_[i] = std::min(lowest_[i], number_[j]);
        }
        continue;
      }
      path.pop_back();
      if (!path.empty()) lowest_[path.back().vertex] = std::min(lowest_[path.back().vertex], lowest_[i]);
      if (lowest_[i] == number_[i]) Close(i);
    }
  }

  void Close(Index first) {
    std::vector<Index>& component = components_.emplace_back();
    Index vertex = -1;
    while (vertex != first) {
      vertex = open_.back();
      open_.pop_back();
      is_open_[vertex] = false;
      component.push_back(vertex);
    }
    std::sort(component.begin(), component.end());
  }

  const Neighbors& neighbors_;
  std::vector<Index> number_, lowest_;
  std::vector<bool> is_open_;
  std::vector<Index> open_;
  Index count_ = 0;
  std::vector<std::vector<Index>> components_;
};

struct DenseNeighbors {
  const Eigen::Ref<const Matrix>& A;
  double threshold;

  Index Next(Index i, Index& place) const {
    while (place < A.cols()) {
      const Index j = place++;
      if (i != j && std::abs(A(i, j)) > threshold) return j;
    }
    return -1;
  }
};

struct SparseNeighbors {
  const Eigen::SparseMatrix<double, Eigen::RowMajor>& A;

  Index Next(Index i, Index& place) const {
    const int* const begins = A.outerIndexPtr();
    while (begins[i] + place < begins[i + 1]) {
      const Index at = begins[i] + place++, j = A.innerIndexPtr()[at];
      if (i != j && A.valuePtr()[at] != 0) return j;
    }
    return -1;
  }
};

}  // namespace

std::vector<std::vector<Index>> StronglyConnected(const Eigen::Ref<const Matrix>& A, double threshold) {
  return Components(A.rows(), DenseNeighbors{A, threshold}).Take();
}

std::vector<std::vector<Index>> StronglyConnected(const Eigen::SparseMatrix<double, Eigen::RowMajor>& A) {
  return Components(A.rows(), SparseNeighbors{A}).Take();
}

}  // namespace dlcs
