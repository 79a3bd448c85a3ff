// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/first_branch.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <set>
#include <string>

#include "core/circuits/circuit_names.h"
#include "core/circuits/linear_network.h"
#include "core/format_number.h"
#include "core/lcp/basis/tolerance.h"

namespace dlcs {
namespace {

// Voltages are equal but for rounding.
bool AreSame(double one, double other) {
  return std::abs(one - other) <= kClearDifference * (kClearDifference + std::abs(one) + std::abs(other));
}

// All points between two solutions are solutions.
bool AreJoined(const BlockSolution& one, const BlockSolution& other) {
  return one.y.cwiseProduct(other.w).isZero(0) && other.y.cwiseProduct(one.w).isZero(0);
}

// Leaves those of `among` with the least value of `cost`.
template <typename Cost>
void KeepLeast(const Cost& cost, std::vector<Index>& among) {
  std::vector<double> costs;
  for (const Index k : among) costs.push_back(cost(k));
  const double least = *std::min_element(costs.begin(), costs.end());
  std::vector<Index> kept;
  for (std::size_t k = 0; k < among.size(); ++k) {
    if (costs[k] == least || AreSame(costs[k], least)) kept.push_back(among[k]);
  }
  among = std::move(kept);
}

}  // namespace

std::vector<Index> PossibleStarts(const std::vector<BlockSolution>& solutions, const BranchVoltages& voltages,
                                  const Circuit& circuit, const CircuitBranches& graph) {
  std::vector<Index> among(solutions.size());
  std::iota(among.begin(), among.end(), Index{0});
  if (among.size() < 2) return among;
  std::vector<Vector> values;
  for (const BlockSolution& solution : solutions) {
    values.emplace_back(voltages.constant + voltages.of_y * solution.y);
  }
  const auto clamps = static_cast<Index>(graph.clamps.size());
  const auto gate = [&](Index solution, Index clamp) { return values[AsSize(solution)][clamp]; };
  const auto count = [&](auto&& is_counted) {
    return [&, is_counted](Index solution) {
      int sum = 0;
      for (Index c = 0; c < clamps; ++c) {
        if (graph.clamps[AsSize(c)].is_gate && is_counted(solution, c)) ++sum;
      }
      return static_cast<double>(sum);
    };
  };
  KeepLeast([&](Index solution) { return solutions[AsSize(solution)].is_between ? 1.0 : 0.0; }, among);
  KeepLeast(count([&](Index solution, Index c) {
              return gate(solution, c) > kSameResult && gate(solution, c) < 1 - kSameResult;
            }),
            among);
  KeepLeast(
      [&](Index solution) {
        double distance = 0;
        for (std::size_t k = 0; k < circuit.node_voltages.size(); ++k) {
          distance +=
              std::abs(values[AsSize(solution)][clamps + static_cast<Index>(k)] - circuit.node_voltages[k].volts);
        }
        return distance;
      },
      among);
  KeepLeast(count([&](Index solution, Index c) {
              const Element& element = circuit.elements[AsSize(graph.clamps[AsSize(c)].element)];
              return (gate(solution, c) > 0.5) != element.switching.starts_closed;
            }),
            among);
  std::vector<Index> kept;
  for (const Index k : among) {
    const bool is_known = std::any_of(kept.begin(), kept.end(), [&](Index other) {
      const Vector &one = values[AsSize(k)], &two = values[AsSize(other)];
      const auto same = [&](Index v) { return one[v] == two[v] || AreSame(one[v], two[v]); };
      for (Index v = 0; v < one.size(); ++v) {
        if (!same(v)) return false;
      }
      return AreJoined(solutions[AsSize(k)], solutions[AsSize(other)]);
    });
    if (!is_known) kept.push_back(k);
  }
  return kept;
}

std::string ElementsThatDiffer(const std::vector<BlockSolution>& solutions, const std::vector<Index>& among,
                               const BranchVoltages& voltages, const Circuit& circuit, const CircuitBranches& graph) {
  std::set<Index> elements;
  for (const Index k : among) {
    const Vector change = voltages.of_y * (solutions[AsSize(k)].y - solutions[AsSize(among.front())].y);
    for (std::size_t c = 0; c < graph.clamps.size(); ++c) {
      if (std::abs(change[static_cast<Index>(c)]) > kSameResult) elements.insert(graph.clamps[c].element);
    }
  }
  std::vector<std::string> names;
  for (const Index element : elements) names.push_back(WithPlace(circuit.elements[AsSize(element)]));
  return names.empty() ? "diodes" : ListText(names);
}

std::string ElementsOfPairs(const std::vector<Index>& pairs, const Circuit& circuit, const CircuitBranches& graph) {
  std::vector<Index> branches;
  for (const Index pair : pairs) branches.push_back(graph.diodes[AsSize(pair)].branch);
  return ElementsOf(branches, graph, circuit);
}

}  // namespace dlcs
