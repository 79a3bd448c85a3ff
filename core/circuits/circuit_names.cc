// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/circuit_names.h"

#include <algorithm>
#include <cstddef>

#include "core/format_number.h"

namespace dlcs {
namespace {

// The nodes that hang together by branches other than `cut`, and do not reach node 0 by them.
std::string CutOff(const std::vector<Index>& cut, const CircuitBranches& graph, const Circuit& circuit) {
  std::vector<bool> reached(AsSize(graph.nodes), false);
  reached[0] = true;
  for (bool grows = true; grows;) {
    grows = false;
    for (std::size_t b = 0; b < graph.branches.size(); ++b) {
      if (std::find(cut.begin(), cut.end(), static_cast<Index>(b)) != cut.end()) continue;
      const auto plus = AsSize(graph.branches[b].plus), minus = AsSize(graph.branches[b].minus);
      if (reached[plus] == reached[minus]) continue;
      reached[plus] = reached[minus] = grows = true;
    }
  }
  std::vector<std::string> names;
  for (std::size_t node = 0; node < circuit.nodes.size(); ++node) {
    if (!reached[node]) names.push_back(circuit.nodes[node]);
  }
  return names.empty() ? "a node inside of one of them" : (names.size() == 1 ? "node " : "nodes ") + ListText(names);
}

constexpr std::size_t kMostNamed = 3;

// Some of those with a node in `nodes`.
std::string ElementsAt(const std::vector<Index>& nodes, const Circuit& circuit) {
  std::vector<std::string> names;
  for (const Element& element : circuit.elements) {
    const auto has = [&nodes](Index node) { return std::find(nodes.begin(), nodes.end(), node) != nodes.end(); };
    if (names.size() < kMostNamed && (has(element.plus) || has(element.minus))) names.push_back(WithPlace(element));
  }
  return ListText(names);
}

// Some of those whose controls have the voltage of a node in `nodes`.
std::string ElementsControlledBy(const std::vector<Index>& nodes, const Circuit& circuit) {
  std::vector<std::string> names;
  for (const Element& element : circuit.elements) {
    const bool is_one = std::any_of(element.controls.begin(), element.controls.end(), [&](const Control& control) {
      const auto is = [&control](Index node) { return node == control.plus || node == control.minus; };
      return control.element < 0 && std::any_of(nodes.begin(), nodes.end(), is);
    });
    if (names.size() < kMostNamed && is_one) names.push_back(WithPlace(element));
  }
  return ListText(names);
}

}  // namespace

std::string WithPlace(const Element& element) {
  return element.place.empty() ? element.name : element.name + " (" + element.place + ")";
}

std::string ElementsOf(const std::vector<Index>& branches, const CircuitBranches& graph, const Circuit& circuit) {
  std::vector<Index> elements;
  for (const Index branch : branches) elements.push_back(graph.element_of[AsSize(branch)]);
  std::sort(elements.begin(), elements.end());
  elements.erase(std::unique(elements.begin(), elements.end()), elements.end());
  std::vector<std::string> names;
  for (const Index element : elements) names.push_back(WithPlace(circuit.elements[AsSize(element)]));
  return ListText(names);
}

absl::Status StatusOfFault(const NetworkFault& fault, const CircuitBranches& graph, const Circuit& circuit,
                           bool at_start) {
  const std::string elements = ElementsOf(fault.branches, graph, circuit);
  const std::string start = "there is no operating point at 0 to start from: ";
  const std::string advice = "; give the start with IC= and UIC instead";
  switch (fault.kind) {
    case NetworkFault::Kind::kFloating: {
      std::vector<std::string> names;
      for (const Index node : fault.nodes) {
        if (node < static_cast<Index>(circuit.nodes.size())) names.push_back(circuit.nodes[AsSize(node)]);
      }
      const std::string elements_there = ElementsAt(fault.nodes, circuit);
      if (elements_there.empty()) {
        return absl::InvalidArgumentError(
            "no element has " + ((names.size() == 1 ? "the node " : "the nodes ") + ListText(names)) +
            ", of whose voltage " + ElementsControlledBy(fault.nodes, circuit) + " is a function; check the name");
      }
      return absl::InvalidArgumentError(
          (names.size() == 1 ? "node " : "nodes ") + ListText(names) + (names.size() == 1 ? " is" : " are") +
          " connected to ground by no element, see " + elements_there + "; every node must be. Ground is the node 0");
    }
    case NetworkFault::Kind::kVoltageLoop:
      if (at_start) {
        return absl::InvalidArgumentError(start + elements +
                                          " form a loop of voltage sources and inductors, whose current at rest is not "
                                          "determined" +
                                          advice);
      }
      if (fault.branches.size() == 1) {
        return absl::InvalidArgumentError(elements + " has both ends at one node: its current is not determined");
      }
      return absl::InvalidArgumentError(elements +
                                        " form a loop of voltage sources; their currents are not determined. Put a "
                                        "resistance into it");
    case NetworkFault::Kind::kCurrentCutset:
      if (at_start) {
        return absl::InvalidArgumentError(start + "no current reaches " + CutOff(fault.branches, graph, circuit) +
                                          ", connected by " + elements +
                                          " alone, at rest, so that the voltage is not determined" + advice);
      }
      return absl::InvalidArgumentError("only current sources connect " + CutOff(fault.branches, graph, circuit) +
                                        ": " + elements +
                                        "; the voltage is not determined. Put a resistance across one of them");
    case NetworkFault::Kind::kSingular:
      return absl::InvalidArgumentError((at_start ? start : "") + "the equations of " + elements +
                                        " do not determine their voltages and currents: the gains of controlled "
                                        "sources make them dependent" +
                                        (at_start ? advice : ""));
  }
  return absl::InternalError("an unknown fault");
}

}  // namespace dlcs
