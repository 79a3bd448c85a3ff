// SPDX-License-Identifier: Apache-2.0
// The nodes of a circuit that are connected.

#ifndef DLCS_CORE_CIRCUITS_COMPONENTS_H_
#define DLCS_CORE_CIRCUITS_COMPONENTS_H_

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

#include "core/types.h"

namespace dlcs {

// Sets of nodes, of which more and more are joined. Cost of a call: next to nothing.
class Components {
 public:
  explicit Components(Index nodes) : parent_(static_cast<std::size_t>(nodes)) {
    std::iota(parent_.begin(), parent_.end(), Index{0});
  }

  // The least node of the set of `node`.
  Index Find(Index node) {
    while (Parent(node) != node) node = Parent(node) = Parent(Parent(node));
    return node;
  }
  // Whether they were apart.
  bool Join(Index one, Index other) {
    one = Find(one);
    other = Find(other);
    Parent(std::max(one, other)) = std::min(one, other);
    return one != other;
  }

 private:
  Index& Parent(Index node) { return parent_[static_cast<std::size_t>(node)]; }

  std::vector<Index> parent_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_COMPONENTS_H_
