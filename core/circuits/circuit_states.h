// SPDX-License-Identifier: Apache-2.0
// The states of a circuit, and all its voltages and currents as linear functions of states, pairs and sources.

#ifndef DLCS_CORE_CIRCUITS_CIRCUIT_STATES_H_
#define DLCS_CORE_CIRCUITS_CIRCUIT_STATES_H_

#include <string>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "core/circuits/circuit.h"
#include "core/circuits/circuit_branches.h"
#include "core/circuits/linear_network.h"
#include "core/types.h"

namespace dlcs {

// A linear function of x~, y, the sources and their derivatives.
struct LinearForm {
  Eigen::RowVectorXd x, y, s, ds;
};

// x~' = A x~ + B y + S s, as MakeCircuitProblem() describes it (circuit_problem.h).
class CircuitStates {
 public:
  // `circuit` and `graph` must outlive it.
  CircuitStates(const Circuit& circuit, const CircuitBranches& graph) : circuit_(circuit), graph_(graph) {}

  // Errors: InvalidArgument with the elements: faults of the network, controls that act on dependent capacitors and
  // inductors, couplings that belong to no coils.
  absl::Status Find();

  Index num_states() const { return static_cast<Index>(states_.size()); }
  Index num_pairs() const { return static_cast<Index>(graph_.diodes.size()); }
  Index num_sources() const { return static_cast<Index>(graph_.sources.size()); }
  Index num_excess() const { return static_cast<Index>(excess_.size()); }
  const LinearNetwork& network() const { return std::get<LinearNetwork>(network_); }

  const Matrix& A() const { return a_; }
  const Matrix& B() const { return b_; }
  const Matrix& S() const { return s_; }
  const Matrix& Gamma() const { return gamma_; }  // x = x~ - Γ s
  // Of each pair: 1 where y is the current, -1 where it is the reverse voltage.
  const Vector& sign() const { return sign_; }

  // Capacitors and inductors, of `graph.storages`: those that are states, then those that depend on them.
  std::vector<Index> Storages() const;
  // x~ at the start, where these have the values z; and what dependent ones are for given x~ and s.
  Vector StartOf(const Vector& z) const;
  Vector Dependent(const Vector& x, const Vector& s) const {
    return dependent_x_ * (x - gamma_ * s) + dependent_s_ * s;
  }

  // A row over the inputs of the network.
  LinearForm FormOf(const Eigen::RowVectorXd& row) const;
  LinearForm PotentialOf(Index node) const { return FormOf(network().Potential(node)); }
  LinearForm CurrentOf(Index element) const { return FormOf(CurrentRow(element)); }
  LinearForm SumOf(const std::vector<Control>& controls) const;

 private:
  // Over states, pairs, sources and what drives the dependent storages.
  struct Parts {
    Eigen::RowVectorXd x, y, s, e;
  };

  const Element& ElementAt(Index index) const { return circuit_.elements[AsSize(index)]; }
  Eigen::RowVectorXd CurrentRow(Index element) const;
  Eigen::RowVectorXd Own(Index storage) const;
  Eigen::RowVectorXd Drive(Index storage) const;
  Parts PartsOf(const Eigen::RowVectorXd& row) const;
  std::string NamesOfStorages() const;

  absl::Status SplitStorages();
  void MakeStorageMatrix();
  absl::Status FindDynamics();

  const Circuit& circuit_;
  const CircuitBranches& graph_;
  std::variant<LinearNetwork, NetworkFault> network_ = NetworkFault();
  std::vector<Index> states_, excess_;  // of graph_.storages
  Vector sign_;
  Matrix storage_;
  Matrix gamma_, a_, b_, s_;
  Matrix e_x_, e_y_, e_s_, e_ds_;
  Matrix state_from_storage_, dependent_x_, dependent_s_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_CIRCUIT_STATES_H_
