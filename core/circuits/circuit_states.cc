// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/circuit_states.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/circuits/circuit_names.h"
#include "core/lcp/basis/tolerance.h"
#include "core/linalg/bounded_sum.h"

namespace dlcs {

using RowVector = Eigen::RowVectorXd;

absl::Status CircuitStates::Find() {
  states_.clear();
  excess_.clear();
  network_ = LinearNetwork::Create(graph_.nodes, graph_.branches);
  if (const auto* fault = std::get_if<NetworkFault>(&network_)) {
    return StatusOfFault(*fault, graph_, circuit_, /*at_start=*/false);
  }
  if (absl::Status status = SplitStorages(); !status.ok()) return status;
  sign_.resize(num_pairs());
  for (Index k = 0; k < num_pairs(); ++k) sign_[k] = network().InTree(graph_.diodes[AsSize(k)].branch) ? -1 : 1;
  MakeStorageMatrix();
  return FindDynamics();
}

// What is zero but for rounding is zero: an inductor in series with a diode that blocks has no reverse current, not the
// least. The values z are rounded by the ratio of resistances, as of an open switch and a closed one.
Vector CircuitStates::StartOf(const Vector& z) const {
  constexpr double kRounding = 1e-10;
  if (num_excess() == 0) return z;
  return BoundedProduct(state_from_storage_, z).WithoutRounding(kRounding);
}

std::vector<Index> CircuitStates::Storages() const {
  std::vector<Index> order = states_;
  order.insert(order.end(), excess_.begin(), excess_.end());
  return order;
}

// States first, then the storages that depend on them.
absl::Status CircuitStates::SplitStorages() {
  for (Index k = 0; k < static_cast<Index>(graph_.storages.size()); ++k) {
    const StorageBranch& storage = graph_.storages[AsSize(k)];
    (network().InTree(storage.branch) == storage.is_capacitor ? states_ : excess_).push_back(k);
  }
  for (const Index k : excess_) {
    const Index branch = graph_.storages[AsSize(k)].branch;
    const RowVector row = Own(k);
    std::vector<Index> others;
    for (const DiodeBranch& diode : graph_.diodes) {
      if (row[network().InputOf(diode.branch)] != 0) others.push_back(diode.branch);
    }
    for (const Index other : excess_) {
      if (row[network().InputOf(graph_.storages[AsSize(other)].branch)] != 0) {
        others.push_back(graph_.storages[AsSize(other)].branch);
      }
    }
    if (others.empty()) continue;
    const std::vector<Index> around = network().InTree(branch) ? network().Cutset(branch) : network().Loop(branch);
    return absl::InvalidArgumentError(WithPlace(ElementAt(graph_.storages[AsSize(k)].element)) +
                                      " depends through controlled sources on " + ElementsOf(others, graph_, circuit_) +
                                      " (" + ElementsOf(around, graph_, circuit_) +
                                      (network().InTree(branch) ? " meet at a node" : " form a loop") +
                                      "), which is not supported. Put a small resistance in " +
                                      (network().InTree(branch) ? "parallel" : "series") + " with it");
  }
  return absl::OkStatus();
}

// The voltage of a capacitor, the current of an inductor; and its derivative times the value.
RowVector CircuitStates::Own(Index storage) const {
  const StorageBranch& given = graph_.storages[AsSize(storage)];
  return given.is_capacitor ? network().Voltage(given.branch) : network().Current(given.branch);
}
RowVector CircuitStates::Drive(Index storage) const {
  const StorageBranch& given = graph_.storages[AsSize(storage)];
  return given.is_capacitor ? network().Current(given.branch) : network().Voltage(given.branch);
}

CircuitStates::Parts CircuitStates::PartsOf(const RowVector& row) const {
  Parts parts{RowVector(num_states()), RowVector(num_pairs()), RowVector(num_sources()), RowVector(num_excess())};
  const auto at = [&](Index branch) { return row[network().InputOf(branch)]; };
  for (Index k = 0; k < num_states(); ++k) parts.x[k] = at(graph_.storages[AsSize(states_[AsSize(k)])].branch);
  for (Index k = 0; k < num_pairs(); ++k) parts.y[k] = sign_[k] * at(graph_.diodes[AsSize(k)].branch);
  for (Index k = 0; k < num_sources(); ++k) {
    parts.s[k] = graph_.sources[AsSize(k)].scale * at(graph_.sources[AsSize(k)].branch);
  }
  for (Index k = 0; k < num_excess(); ++k) parts.e[k] = at(graph_.storages[AsSize(excess_[AsSize(k)])].branch);
  return parts;
}

// Capacitances and inductances, states first, in units that make the diagonal 1: D = unit * normal * unit.
void CircuitStates::MakeStorageMatrix() {
  const std::vector<Index> order = Storages();
  const auto count = static_cast<Index>(order.size());
  storage_ = Matrix::Zero(count, count);
  const auto place_of = [&](Index element) {
    for (Index k = 0; k < count; ++k) {
      if (graph_.storages[AsSize(order[AsSize(k)])].element == element) return k;
    }
    return Index{-1};
  };
  for (Index k = 0; k < count; ++k) storage_(k, k) = ElementAt(graph_.storages[AsSize(order[AsSize(k)])].element).value;
  for (const Coupling& coupling : circuit_.couplings) {
    const Index one = place_of(coupling.first), other = place_of(coupling.second);
    if (one < 0 || other < 0) continue;  // another winding of an inductor, which is coupled itself
    const double mutual = coupling.value * std::sqrt(storage_(one, one) * storage_(other, other));
    storage_(one, other) = storage_(other, one) = mutual;
  }
}

// x~' = A x~ + K y + S s.
absl::Status CircuitStates::FindDynamics() {
  const Index m = num_states(), e = num_excess();
  // The excess values as T x + Θ s, and what they drive the states with, Π.
  Matrix T(e, m), Theta(e, num_sources()), Pi(m, e);
  for (Index k = 0; k < e; ++k) {
    const Parts own = PartsOf(Own(excess_[AsSize(k)]));
    T.row(k) = own.x;
    Theta.row(k) = own.s;
  }
  Matrix H(m, m), K(m, num_pairs()), S(m, num_sources());
  for (Index k = 0; k < m; ++k) {
    const Parts drive = PartsOf(Drive(states_[AsSize(k)]));
    H.row(k) = drive.x;
    K.row(k) = drive.y;
    S.row(k) = drive.s;
    Pi.row(k) = -drive.e;
  }
  const Matrix driven = storage_.topRows(m) + Pi * storage_.bottomRows(e);
  const Matrix mass = driven.leftCols(m) + driven.rightCols(e) * T;
  const bool is_diagonal = mass.isDiagonal(0);
  // In units that make the diagonal 1 where it is not 0.
  Vector unit = storage_.diagonal().head(m).cwiseSqrt();
  for (Index k = 0; k < m; ++k) {
    if (mass(k, k) > 0) unit[k] = std::sqrt(mass(k, k));
  }
  const Matrix scaled = unit.cwiseInverse().asDiagonal() * mass * unit.cwiseInverse().asDiagonal();
  Eigen::FullPivLU<Matrix> factors;
  if (!is_diagonal) factors.compute(scaled);
  const Vector pivots = is_diagonal ? scaled.diagonal() : factors.matrixLU().diagonal();
  if (m > 0 && !(pivots.cwiseAbs().minCoeff() > RoundingOf(128 * m))) {
    return absl::InvalidArgumentError("the equations of " + NamesOfStorages() +
                                      " are dependent: their capacitances, inductances and couplings leave fewer "
                                      "states than there are elements, which is not supported");
  }
  const auto divided = [&](const Matrix& right) -> Matrix {
    if (is_diagonal) return mass.diagonal().cwiseInverse().asDiagonal() * right;
    return unit.cwiseInverse().asDiagonal() * factors.solve(Matrix(unit.cwiseInverse().asDiagonal() * right));
  };
  gamma_ = divided(driven.rightCols(e) * Theta);
  a_ = divided(H);
  b_ = divided(K);
  s_ = divided(S);
  if (!gamma_.isZero(0)) s_ -= a_ * gamma_;  // x = x~ - Γ s
  // e = D_e (T x' + Θ s'), with x' = x~' - Γ s'.
  const Matrix of_own = storage_.bottomRightCorner(e, e);
  const Matrix excess = storage_.bottomLeftCorner(e, m) + of_own * T;
  e_x_ = excess * a_;
  e_y_ = excess * b_;
  e_s_ = excess * s_;
  e_ds_ = of_own * Theta - excess * gamma_;
  const Matrix terms = of_own.cwiseAbs() * Theta.cwiseAbs() + excess.cwiseAbs() * gamma_.cwiseAbs();
  e_ds_ = BoundedSums<Matrix>{e_ds_, terms}.WithoutRounding(kLcpTolerance);     // what cancels is zero
  if (e > 0) state_from_storage_ = divided(driven);                             // else the states are the storages
  dependent_x_ = std::move(T);
  dependent_s_ = std::move(Theta);
  return absl::OkStatus();
}

std::string CircuitStates::NamesOfStorages() const {
  std::vector<Index> branches;
  for (const StorageBranch& storage : graph_.storages) branches.push_back(storage.branch);
  return ElementsOf(branches, graph_, circuit_);
}

// A row over the inputs of the network as a function of x~, y, the sources and their derivatives.
LinearForm CircuitStates::FormOf(const RowVector& row) const {
  const Parts parts = PartsOf(row);
  return {.x = parts.x + parts.e * e_x_,
          .y = parts.y + parts.e * e_y_,
          .s = parts.s - parts.x * gamma_ + parts.e * e_s_,
          .ds = parts.e * e_ds_};
}

RowVector CircuitStates::CurrentRow(Index element) const {
  RowVector row = RowVector::Zero(network().num_inputs());
  for (const CircuitBranches::Part& part : graph_.parts[AsSize(element)]) {
    row += part.sign * network().Current(part.branch);
  }
  return row;
}

LinearForm CircuitStates::SumOf(const std::vector<Control>& controls) const {
  RowVector row = RowVector::Zero(network().num_inputs());
  for (const Control& control : controls) {
    row += control.factor * (control.element >= 0
                                 ? CurrentRow(control.element)
                                 : RowVector(network().Potential(control.plus) - network().Potential(control.minus)));
  }
  return FormOf(row);
}

}  // namespace dlcs
