// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/known_voltages.h"

#include <cstddef>
#include <utility>
#include <variant>

namespace dlcs::client {

KnownVoltages::Joined::Joined(Index nodes)
    : above(static_cast<std::size_t>(nodes)), volts(static_cast<std::size_t>(nodes)), size(above.size(), 1) {
  for (std::size_t node = 0; node < above.size(); ++node) above[node] = static_cast<Index>(node);
}

KnownVoltages::Joined::Place KnownVoltages::Joined::Of(Index node) const {
  double sum = 0;
  for (auto at = static_cast<std::size_t>(node); above[at] != static_cast<Index>(at);) {
    sum += volts[at];
    at = static_cast<std::size_t>(above[at]);
    node = static_cast<Index>(at);
  }
  return {node, sum};
}

// The smaller tree goes below the larger one: a path to the top has a logarithmic length.
void KnownVoltages::Joined::Join(Index plus, Index minus, double difference) {
  Place one = Of(plus), other = Of(minus);
  if (one.top == other.top) return;
  // v(one.top) - v(other.top)
  double top = difference - one.volts + other.volts;
  if (size[static_cast<std::size_t>(one.top)] > size[static_cast<std::size_t>(other.top)]) {
    std::swap(one, other);
    top = -top;
  }
  above[static_cast<std::size_t>(one.top)] = other.top;
  volts[static_cast<std::size_t>(one.top)] = top;
  size[static_cast<std::size_t>(other.top)] += size[static_cast<std::size_t>(one.top)];
}

KnownVoltages::KnownVoltages(const Circuit& circuit)
    : by_constants_(static_cast<Index>(circuit.nodes.size())), by_all_(static_cast<Index>(circuit.nodes.size())) {
  for (const Element& element : circuit.elements) {
    if (element.kind != ElementKind::kVoltageSource) continue;
    by_all_.Join(element.plus, element.minus, 0);
    const auto* const wave = std::get_if<ConstantWave>(&element.source);
    if (wave != nullptr) by_constants_.Join(element.plus, element.minus, wave->value);
  }
}

std::optional<KnownQuantity> KnownVoltages::Between(Index plus, Index minus) const {
  if (by_all_.Of(plus).top != by_all_.Of(minus).top) return std::nullopt;
  const Joined::Place one = by_constants_.Of(plus), other = by_constants_.Of(minus);
  if (one.top != other.top) return KnownQuantity{};
  return KnownQuantity{one.volts - other.volts};
}

}  // namespace dlcs::client
