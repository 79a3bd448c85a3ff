// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/linear_network.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "core/circuits/components.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/strong_components.h"

namespace dlcs {
namespace {

using RowVector = Eigen::RowVectorXd;

// Sums that cancel to less than the rounding of so many operations on their terms are zero.
constexpr Index kOperations = 512;

bool IsSolvedFor(BranchRole role) {
  return role == BranchRole::kResistor || role == BranchRole::kControlledVoltage ||
         role == BranchRole::kControlledCurrent;
}

}  // namespace

std::vector<Index> LinearNetwork::Unreached(Index nodes) const {
  Components components(nodes);
  for (const Branch& branch : branches_) components.Join(branch.plus, branch.minus);
  std::vector<Index> unreached;
  for (Index node = 1; node < nodes; ++node) {
    if (components.Find(node) != components.Find(0)) unreached.push_back(node);
  }
  return unreached;
}

void LinearNetwork::ChooseTree(Index nodes) {
  std::vector<Index> sorted(branches_.size());
  std::iota(sorted.begin(), sorted.end(), Index{0});
  std::stable_sort(sorted.begin(), sorted.end(), [this](Index one, Index other) {
    const Branch &a = branches_[AsSize(one)], &b = branches_[AsSize(other)];
    return a.order != b.order ? a.order < b.order : a.resistance < b.resistance;
  });
  in_tree_.assign(branches_.size(), false);
  Components components(nodes);
  for (const Index index : sorted) {
    in_tree_[AsSize(index)] = components.Join(branches_[AsSize(index)].plus, branches_[AsSize(index)].minus);
  }
}

// From node 0 outwards along the tree.
void LinearNetwork::FindPaths(Index nodes) {
  const auto count = static_cast<Index>(branches_.size());
  std::vector<std::vector<Index>> at_node(AsSize(nodes));
  for (Index b = 0; b < count; ++b) {
    if (!InTree(b)) continue;
    at_node[AsSize(branches_[AsSize(b)].plus)].push_back(b);
    at_node[AsSize(branches_[AsSize(b)].minus)].push_back(b);
  }
  potential_ = RowMajor::Zero(nodes, count);
  std::vector<bool> reached(AsSize(nodes), false);
  std::vector<Index> open = {0};
  reached[0] = true;
  while (!open.empty()) {
    const Index node = open.back();
    open.pop_back();
    for (const Index b : at_node[AsSize(node)]) {
      const bool from_minus = branches_[AsSize(b)].minus == node;
      const Index next = from_minus ? branches_[AsSize(b)].plus : branches_[AsSize(b)].minus;
      if (reached[AsSize(next)]) continue;
      reached[AsSize(next)] = true;
      potential_.row(next) = potential_.row(node);
      potential_(next, b) = from_minus ? 1 : -1;
      open.push_back(next);
    }
  }
  loops_ = Matrix::Zero(count, count);
  for (Index b = 0; b < count; ++b) {
    if (!InTree(b))
      loops_.row(b) = potential_.row(branches_[AsSize(b)].plus) - potential_.row(branches_[AsSize(b)].minus);
  }
}

RowVector LinearNetwork::PrimaryVoltage(Index branch) const {
  if (!InTree(branch)) return loops_.row(branch);
  return RowVector::Unit(loops_.cols(), branch);
}

RowVector LinearNetwork::PrimaryCurrent(Index branch) const {
  if (InTree(branch)) return -loops_.col(branch).transpose();
  return RowVector::Unit(loops_.cols(), branch);
}

std::vector<Index> LinearNetwork::Loop(Index branch) const {
  std::vector<Index> loop = {branch};
  for (Index b = 0; b < loops_.cols(); ++b) {
    if (loops_(branch, b) != 0) loop.push_back(b);
  }
  return loop;
}

std::vector<Index> LinearNetwork::Cutset(Index branch) const {
  std::vector<Index> cutset = {branch};
  for (Index b = 0; b < loops_.rows(); ++b) {
    if (loops_(b, branch) != 0) cutset.push_back(b);
  }
  return cutset;
}

// Solves for what is not given, in units of √R.
bool LinearNetwork::Solve(NetworkFault& fault) {
  const auto count = static_cast<Index>(branches_.size());
  std::vector<Index> unknowns, inputs;
  input_of_.assign(branches_.size(), -1);
  for (Index b = 0; b < count; ++b) {
    if (IsSolvedFor(branches_[AsSize(b)].role)) {
      unknowns.push_back(b);
    } else {
      input_of_[AsSize(b)] = static_cast<Index>(inputs.size());
      inputs.push_back(b);
    }
  }
  num_inputs_ = static_cast<Index>(inputs.size());
  const auto size = static_cast<Index>(unknowns.size());

  Vector unit(size);
  RowMajor equations(size, size), given(size, num_inputs_);
  for (Index k = 0; k < size; ++k) {
    const Branch& branch = branches_[AsSize(unknowns[AsSize(k)])];
    RowVector row;
    unit[k] = 1;
    if (branch.role == BranchRole::kResistor) {
      const bool in_tree = InTree(unknowns[AsSize(k)]);
      const double root = std::sqrt(branch.resistance);
      unit[k] = in_tree ? root : 1 / root;
      row = in_tree ? RowVector(branch.resistance * PrimaryCurrent(unknowns[AsSize(k)]))
                    : RowVector(PrimaryVoltage(unknowns[AsSize(k)]) / branch.resistance);
    } else {
      row = RowVector::Zero(count);
      for (const BranchControl& control : branch.controls) {
        row += control.factor * (control.branch >= 0
                                     ? PrimaryCurrent(control.branch)
                                     : RowVector(potential_.row(control.plus) - potential_.row(control.minus)));
      }
    }
    for (Index j = 0; j < size; ++j) equations(k, j) = (j == k ? 1 : 0) - row[unknowns[AsSize(j)]];
    for (Index j = 0; j < num_inputs_; ++j) given(k, j) = row[inputs[AsSize(j)]];
  }
  const Matrix scaled = unit.cwiseInverse().asDiagonal() * equations * unit.asDiagonal();

  primary_ = RowMajor::Zero(count, num_inputs_);
  bound_ = RowMajor::Zero(count, num_inputs_);
  for (Index j = 0; j < num_inputs_; ++j) primary_(inputs[AsSize(j)], j) = bound_(inputs[AsSize(j)], j) = 1;
  RowMajor solved = RowMajor::Zero(size, num_inputs_), terms = solved;
  // A block depends on later ones. What it does not depend on has factors of exactly 0, which one large inverse would
  // leave as rounding.
  const std::vector<std::vector<Index>> blocks = StronglyConnected(scaled);
  for (auto block = blocks.rbegin(); block != blocks.rend(); ++block) {
    const auto width = static_cast<Index>(block->size());
    const Eigen::FullPivLU<Matrix> factors(Matrix(scaled(*block, *block)));
    // Gains of 1e9 are common, and so are their squares; a network that is singular has a pivot of the size of
    // rounding.
    const double smallest = factors.matrixLU().diagonal().cwiseAbs().minCoeff();
    if (!(smallest > RoundingOf(32 * width))) {
      fault.kind = NetworkFault::Kind::kSingular;
      Eigen::FullPivLU<Matrix> ranked(Matrix(scaled(*block, *block)));
      ranked.setThreshold(1e-12);
      const Matrix kernel = ranked.kernel();
      for (Index k = 0; k < width; ++k) {
        if (width == 1 || std::abs(kernel(k, 0)) > 1e-6 * kernel.col(0).cwiseAbs().maxCoeff()) {
          fault.branches.push_back(unknowns[AsSize((*block)[AsSize(k)])]);
        }
      }
      return false;
    }
    const Vector own_unit = unit(*block);
    const Matrix inverse = own_unit.asDiagonal() * factors.inverse() * own_unit.cwiseInverse().asDiagonal();
    Matrix right = given(*block, Eigen::all);
    Matrix size_of_right = right.cwiseAbs();
    for (Index k = 0; k < width; ++k) {
      for (Index j = 0; j < size; ++j) {  // of blocks that are not solved yet: zero, times zero
        const double factor = equations((*block)[AsSize(k)], j);
        if (factor == 0) continue;
        right.row(k) -= factor * solved.row(j);
        size_of_right.row(k) += std::abs(factor) * terms.row(j);
      }
    }
    solved(*block, Eigen::all) = inverse * right;
    terms(*block, Eigen::all) = inverse.cwiseAbs() * size_of_right;
    for (const Index k : *block) {
      for (Index j = 0; j < num_inputs_; ++j) {
        if (std::abs(solved(k, j)) <= RoundingOf(kOperations) * terms(k, j)) solved(k, j) = 0;
      }
    }
  }
  primary_(unknowns, Eigen::all) = solved;
  bound_(unknowns, Eigen::all) = terms;
  return true;
}

// Most entries of a row are zero: a path through the tree is short.
RowVector LinearNetwork::InInputs(const RowVector& primary) const {
  RowVector row = RowVector::Zero(num_inputs_), terms = row;
  for (Index b = 0; b < primary.size(); ++b) {
    if (primary[b] == 0) continue;
    row += primary[b] * primary_.row(b);
    terms += std::abs(primary[b]) * bound_.row(b);
  }
  for (Index j = 0; j < row.size(); ++j) {
    if (std::abs(row[j]) <= RoundingOf(kOperations) * terms[j]) row[j] = 0;
  }
  return row;
}

RowVector LinearNetwork::Voltage(Index branch) const { return InInputs(PrimaryVoltage(branch)); }
RowVector LinearNetwork::Current(Index branch) const { return InInputs(PrimaryCurrent(branch)); }
RowVector LinearNetwork::Potential(Index node) const { return InInputs(potential_.row(node)); }

std::variant<LinearNetwork, NetworkFault> LinearNetwork::Create(Index nodes, std::vector<Branch> branches) {
  LinearNetwork network;
  network.branches_ = std::move(branches);
  NetworkFault fault;
  if (fault.nodes = network.Unreached(nodes); !fault.nodes.empty()) {
    fault.kind = NetworkFault::Kind::kFloating;
    return fault;
  }
  network.ChooseTree(nodes);
  network.FindPaths(nodes);
  for (Index b = 0; b < static_cast<Index>(network.branches_.size()); ++b) {
    const BranchRole role = network.branches_[AsSize(b)].role;
    if ((role == BranchRole::kVoltage || role == BranchRole::kControlledVoltage) && !network.InTree(b)) {
      fault.kind = NetworkFault::Kind::kVoltageLoop;
      fault.branches = network.Loop(b);
      return fault;
    }
    if ((role == BranchRole::kCurrent || role == BranchRole::kControlledCurrent) && network.InTree(b)) {
      fault.kind = NetworkFault::Kind::kCurrentCutset;
      fault.branches = network.Cutset(b);
      return fault;
    }
  }
  if (!network.Solve(fault)) return fault;
  return network;
}

}  // namespace dlcs
