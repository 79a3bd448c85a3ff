// SPDX-License-Identifier: Apache-2.0
// Currents and voltages of a network of resistors and controlled sources, as linear functions of what is given.

#ifndef DLCS_CORE_CIRCUITS_LINEAR_NETWORK_H_
#define DLCS_CORE_CIRCUITS_LINEAR_NETWORK_H_

#include <cstddef>
#include <variant>
#include <vector>

#include "core/types.h"

namespace dlcs {

// An index into an array of the standard library.
inline std::size_t AsSize(Index index) { return static_cast<std::size_t>(index); }

enum class BranchRole {
  kVoltage,            // its voltage is given: must be in the tree
  kCurrent,            // its current is given: must not be in the tree
  kEither,             // its voltage is given if it is in the tree, otherwise its current
  kResistor,           // v = resistance i
  kControlledVoltage,  // its voltage is the sum of its controls: must be in the tree
  kControlledCurrent,  // its current is the sum of its controls: must not be in the tree
};

// factor times the voltage between two nodes; or times the current of a branch, if it is one.
struct BranchControl {
  double factor = 1;
  Index plus = 0, minus = 0;
  Index branch = -1;
};

struct Branch {
  Index plus = 0, minus = 0;  // nodes; the current flows from plus through the branch to minus
  BranchRole role = BranchRole::kEither;
  int order = 0;          // the tree takes lower ones first; of equal ones those of lower resistance
  double resistance = 0;  // ohms, > 0
  std::vector<BranchControl> controls = {};
};

// Why a network has no solution.
struct NetworkFault {
  enum class Kind {
    kFloating,       // `nodes` are connected to node 0 by nothing
    kVoltageLoop,    // `branches` form a loop, and all their voltages are given
    kCurrentCutset,  // all currents of `branches`, which alone connect some nodes to the others, are given
    kSingular,       // controlled sources: the equations of `branches` are dependent
  };
  Kind kind = Kind::kSingular;
  std::vector<Index> branches = {};
  std::vector<Index> nodes = {};
};

// With a spanning tree of the graph, all voltages follow from those of the tree (Kirchhoff's voltage law) and all
// currents from those off the tree (Kirchhoff's current law), with factors 1, 0 and -1. What is not given of these are
// the voltages of resistors in the tree, the currents of the other resistors, and controlled sources. They solve
//
//     ζ = Q ζ + Q' (what is given).
//
// The tree takes low resistances first. So for resistors alone, in units of √R volts and 1/√R amperes, I - Q is the
// identity plus a skew matrix of entries at most 1 in size: well conditioned, whatever the resistances. Where no
// resistor and no control is between two quantities, the factor is exactly 1, 0 or -1. What rounding leaves of a sum
// that cancels becomes exactly 0.
//
// Source: L. O. Chua, P.-M. Lin. Computer-aided analysis of electronic circuits. Prentice-Hall 1975, chapters 6 and 8
// (the normal tree).
class LinearNetwork {
 public:
  // Node 0 is the reference. Cost: O(b²) for b branches, and O(r³) for r resistors and controlled sources.
  static std::variant<LinearNetwork, NetworkFault> Create(Index nodes, std::vector<Branch> branches);

  const std::vector<Branch>& branches() const { return branches_; }
  bool InTree(Index branch) const { return in_tree_[static_cast<std::size_t>(branch)]; }
  // The given quantities in the order of their branches, and the place of a branch among them, -1 if it has none.
  Index num_inputs() const { return num_inputs_; }
  Index InputOf(Index branch) const { return input_of_[static_cast<std::size_t>(branch)]; }

  // As rows over the given quantities.
  Eigen::RowVectorXd Voltage(Index branch) const;
  Eigen::RowVectorXd Current(Index branch) const;
  Eigen::RowVectorXd Potential(Index node) const;

  // The branches that close a loop with `branch`, which is not in the tree; itself first.
  std::vector<Index> Loop(Index branch) const;
  // The branches that connect the two sides of `branch`, which is in the tree, besides it; itself first.
  std::vector<Index> Cutset(Index branch) const;

 private:
  LinearNetwork() = default;

  std::vector<Index> Unreached(Index nodes) const;
  void ChooseTree(Index nodes);
  void FindPaths(Index nodes);
  Eigen::RowVectorXd PrimaryVoltage(Index branch) const;
  Eigen::RowVectorXd PrimaryCurrent(Index branch) const;
  Eigen::RowVectorXd InInputs(const Eigen::RowVectorXd& primary) const;
  bool Solve(NetworkFault& fault);

  std::vector<Branch> branches_;
  std::vector<bool> in_tree_;
  std::vector<Index> input_of_;
  Index num_inputs_ = 0;
  // Over primary quantities: of each branch its voltage if it is in the tree, otherwise its current.
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  RowMajor potential_;  // nodes × branches
  Matrix loops_;        // F: the voltage of a branch off the tree from those of the tree, branches × branches
  RowMajor primary_;    // branches × inputs
  RowMajor bound_;      // the size of the terms that made `primary_`
};

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_LINEAR_NETWORK_H_
