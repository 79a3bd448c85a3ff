// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/floating_nodes.h"

#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "core/circuits/linear_network.h"

namespace dlcs {
namespace {

// Whether a current can flow through the element while it blocks.
bool Leaks(const Element& element) {
  if (element.kind == ElementKind::kDiode) return std::isfinite(element.diode.off_resistance);
  return std::isfinite(element.switching.off_resistance) ||
         (element.body_diode && std::isfinite(element.body_diode->off_resistance));
}

// Parts of a whole, of which more and more are joined.
class Parts {
 public:
  explicit Parts(std::size_t count) : next_(count) { std::iota(next_.begin(), next_.end(), Index{0}); }

  Index Of(Index node) {
    while (next_[AsSize(node)] != node) node = next_[AsSize(node)] = next_[AsSize(next_[AsSize(node)])];
    return node;
  }
  void Join(Index one, Index other) { next_[AsSize(Of(one))] = Of(other); }

 private:
  std::vector<Index> next_;
};

// "a", "a and b", "a, b and 3 more".
std::string ListOf(const std::vector<std::string>& names) {
  if (names.size() == 1) return names[0];
  if (names.size() == 2) return names[0] + " and " + names[1];
  return names[0] + ", " + names[1] + " and " + std::to_string(names.size() - 2) + " more";
}

}  // namespace

std::vector<std::string> NotesOnFloatingNodes(const Circuit& circuit) {
  Parts parts(circuit.nodes.size());
  for (const Element& element : circuit.elements) {
    const bool is_current =
        element.kind == ElementKind::kCurrentSource || element.kind == ElementKind::kControlledCurrent;
    const bool blocks = element.kind == ElementKind::kDiode || element.kind == ElementKind::kSwitch;
    if (!is_current && (!blocks || Leaks(element))) parts.Join(element.plus, element.minus);
  }
  std::set<Index> driven, bounded;
  for (const Element& element : circuit.elements) {
    for (const Index node : {element.plus, element.minus}) {
      if (element.kind == ElementKind::kCurrentSource || element.kind == ElementKind::kControlledCurrent) {
        driven.insert(parts.Of(node));
      }
      if (element.kind == ElementKind::kDiode || element.kind == ElementKind::kSwitch) bounded.insert(parts.Of(node));
    }
  }
  std::map<Index, std::vector<std::string>> floating;
  for (Index node = 1; node < static_cast<Index>(circuit.nodes.size()); ++node) {
    const Index part = parts.Of(node);
    if (part == parts.Of(0) || driven.contains(part) || !bounded.contains(part)) continue;
    floating[part].push_back(circuit.nodes[AsSize(node)]);
  }
  std::vector<std::string> notes;
  for (const auto& [part, names] : floating) {
    notes.push_back("while all diodes and switches at " + ListOf(names) +
                    " block, the potential of this part is not determined; one that keeps them blocked is shown");
  }
  return notes;
}

}  // namespace dlcs
