// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/floating_nodes.h"

#include <cmath>
#include <map>
#include <set>

#include "core/circuits/components.h"
#include "core/circuits/linear_network.h"
#include "core/format_number.h"

namespace dlcs {
namespace {

// Whether a current can flow through the element while it blocks.
bool Leaks(const Element& element) {
  if (element.kind == ElementKind::kDiode) return std::isfinite(element.diode.off_resistance);
  return std::isfinite(element.switching.off_resistance) ||
         (element.body_diode && std::isfinite(element.body_diode->off_resistance));
}

bool DrivesCurrent(const Element& element) {
  return element.kind == ElementKind::kCurrentSource || element.kind == ElementKind::kControlledCurrent;
}

// "a", "a and b", "a, b and 3 more".
std::string Shortened(std::vector<std::string> names) {
  constexpr std::size_t kShown = 2;
  if (names.size() > kShown) {
    const std::size_t more = names.size() - kShown;
    names.resize(kShown);
    names.push_back(std::to_string(more) + " more");
  }
  return ListText(names);
}

}  // namespace

std::vector<std::string> NotesOnFloatingNodes(const Circuit& circuit) {
  Components parts(static_cast<Index>(circuit.nodes.size()));
  for (const Element& element : circuit.elements) {
    if (!DrivesCurrent(element) && (!MayBlock(element) || Leaks(element))) parts.Join(element.plus, element.minus);
  }
  std::set<Index> driven, bounded;
  for (const Element& element : circuit.elements) {
    for (const Index node : {element.plus, element.minus}) {
      if (DrivesCurrent(element)) driven.insert(parts.Find(node));
      if (MayBlock(element)) bounded.insert(parts.Find(node));
    }
  }
  std::map<Index, std::vector<std::string>> floating;
  for (Index node = 1; node < static_cast<Index>(circuit.nodes.size()); ++node) {
    const Index part = parts.Find(node);
    if (part == parts.Find(0) || driven.contains(part) || !bounded.contains(part)) continue;
    floating[part].push_back(circuit.nodes[AsSize(node)]);
  }
  std::vector<std::string> notes;
  for (const auto& [part, names] : floating) {
    notes.push_back("while all diodes and switches at " + Shortened(names) +
                    " block, the potential of this part is not determined; one that keeps them blocked is shown");
  }
  return notes;
}

}  // namespace dlcs
