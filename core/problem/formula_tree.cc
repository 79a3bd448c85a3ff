// SPDX-License-Identifier: Apache-2.0
#include "core/problem/formula_tree.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace dlcs {
namespace {

using enum FormulaOperation;

bool Same(const FormulaStep& a, const FormulaStep& b) {
  return a.operation == b.operation && a.a == b.a && a.b == b.b && a.index == b.index &&
         std::bit_cast<std::uint64_t>(a.number) == std::bit_cast<std::uint64_t>(b.number);
}

std::size_t HashOf(const FormulaStep& step) {
  std::uint64_t hash = std::bit_cast<std::uint64_t>(step.number);
  for (const std::int64_t part : {std::int64_t{step.a}, std::int64_t{step.b}, std::int64_t{step.index},
                                  static_cast<std::int64_t>(step.operation)}) {
    hash = (hash ^ static_cast<std::uint64_t>(part)) * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 29;
  }
  return hash;
}

void AddOnce(std::vector<Index>& indices, Index i) {
  if (std::find(indices.begin(), indices.end(), i) == indices.end()) indices.push_back(i);
}

}  // namespace

int FormulaTreeBuilder::Number(double value) { return Append({.operation = kNumber, .number = value}); }

int FormulaTreeBuilder::Time() {
  tree_.depends_on_t = true;
  return Append({.operation = kTime, .of_time_alone = true});
}

int FormulaTreeBuilder::State(Index i) {
  AddOnce(tree_.states, i);
  return Append({.operation = kState, .index = i});
}

int FormulaTreeBuilder::Constraint(Index i) {
  AddOnce(tree_.constraints, i);
  return Append({.operation = kConstraint, .index = i});
}

int FormulaTreeBuilder::Operation(FormulaOperation operation, int a, int b) {
  const FormulaStep& first = tree_.steps[static_cast<std::size_t>(a)];
  const FormulaStep& second = tree_.steps[static_cast<std::size_t>(b < 0 ? a : b)];
  if (first.operation == kNumber && second.operation == kNumber) {
    return Number(ValueOf(operation, first.number, second.number));
  }
  const auto has_time_at_most = [](const FormulaStep& step) { return step.of_time_alone || step.operation == kNumber; };
  return Append(
      {.operation = operation, .a = a, .b = b, .of_time_alone = has_time_at_most(first) && has_time_at_most(second)});
}

FormulaTree FormulaTreeBuilder::Take(int root) && {
  if (root + 1 < static_cast<int>(tree_.steps.size())) {
    // Folded numbers may follow the value; nothing before it needs them.
    tree_.steps.resize(static_cast<std::size_t>(root) + 1);
  }
  return std::move(tree_);
}

int FormulaTreeBuilder::Append(const FormulaStep& step) {
  const std::size_t hash = HashOf(step);
  const auto [begin, end] = by_hash_.equal_range(hash);
  for (auto known = begin; known != end; ++known) {
    if (Same(tree_.steps[static_cast<std::size_t>(known->second)], step)) return known->second;
  }
  const int index = static_cast<int>(tree_.steps.size());
  tree_.steps.push_back(step);
  by_hash_.emplace(hash, index);
  return index;
}

}  // namespace dlcs
