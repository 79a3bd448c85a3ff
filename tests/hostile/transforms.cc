// SPDX-License-Identifier: Apache-2.0
#include "tests/hostile/transforms.h"

#include <cmath>

namespace dlcs::hostile {

using Eigen::MatrixXd;
using Eigen::VectorXd;

UnitChange NoUnitChange(const System& system) {
  return {VectorXd::Ones(system.num_states()), VectorXd::Ones(system.num_pairs()), VectorXd::Ones(system.num_pairs()),
          1};
}

System Rescaled(System system, const UnitChange& units) {
  const VectorXd& d = units.states;
  const VectorXd states_inverse = d.cwiseInverse(), y_inverse = units.y.cwiseInverse();
  system.A = d.asDiagonal() * system.A * states_inverse.asDiagonal();
  system.B = d.asDiagonal() * system.B * y_inverse.asDiagonal();
  system.N = units.w.asDiagonal() * system.N * states_inverse.asDiagonal();
  system.M = units.w.asDiagonal() * system.M * y_inverse.asDiagonal();
  system.x0 = d.asDiagonal() * system.x0;
  if (system.num_outputs() > 0) {  // in their own units still
    system.C *= states_inverse.asDiagonal();
    system.D *= y_inverse.asDiagonal();
  }
  for (MatrixXd& F : system.F) F = d.asDiagonal() * F;
  for (MatrixXd& G : system.G) G = units.w.asDiagonal() * G;
  const int m = system.num_states();
  for (KinkedTerm& kink : system.kinks) kink.factor *= kink.row < m ? d(kink.row) : units.w(kink.row - m);
  const double time = units.time;
  if (time == 1) return system;
  system.A /= time;
  system.B /= time;
  for (MatrixXd& F : system.F) F /= time;
  for (KinkedTerm& kink : system.kinks) {
    if (kink.row < m) kink.factor /= time;
    kink.when *= time;
  }
  for (size_t k = 0; k < system.functions.size(); ++k) {
    SourceFunction& function = system.functions[k];
    function.rate /= time;
    const double power = std::pow(time, function.power);
    for (MatrixXd& F : system.F) F.col(static_cast<Index>(k)) /= power;
    for (MatrixXd& G : system.G) G.col(static_cast<Index>(k)) /= power;
  }
  for (double& start : system.starts) start *= time;
  system.horizon *= time;
  return system;
}

VectorXd RandomUnits(Random& random, int count, double decades, bool powers_of_two) {
  VectorXd units(count);
  for (int i = 0; i < count; ++i) {
    const double exponent = random.Uniform(-decades, decades) * std::log2(10.0);
    units(i) = powers_of_two ? std::exp2(std::round(exponent)) : std::exp2(exponent);
  }
  return units;
}

System Permuted(const System& system, const std::vector<int>& states, const std::vector<int>& pairs) {
  System result = system;
  const int m = system.num_states(), n = system.num_pairs();
  std::vector<int> new_row(m + n);
  for (int i = 0; i < m; ++i) new_row[states[i]] = i;
  for (int i = 0; i < n; ++i) new_row[m + pairs[i]] = m + i;
  for (int i = 0; i < m; ++i) {
    for (int j = 0; j < m; ++j) result.A(i, j) = system.A(states[i], states[j]);
    for (int j = 0; j < n; ++j) {
      result.B(i, j) = system.B(states[i], pairs[j]);
      result.N(j, i) = system.N(pairs[j], states[i]);
    }
    result.x0(i) = system.x0(states[i]);
    for (size_t p = 0; p < system.F.size(); ++p) result.F[p].row(i) = system.F[p].row(states[i]);
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) result.M(i, j) = system.M(pairs[i], pairs[j]);
    for (size_t p = 0; p < system.G.size(); ++p) result.G[p].row(i) = system.G[p].row(pairs[i]);
  }
  if (system.num_outputs() > 0) {
    result.C = system.C(Eigen::all, states);
    result.D = system.D(Eigen::all, pairs);
  }
  for (KinkedTerm& kink : result.kinks) kink.row = new_row[kink.row];
  return result;
}

namespace {

// `system` with `count` states behind the others, which are as they were; the new parts are zero.
System WithMoreStates(System system, int count) {
  const int m = system.num_states();
  for (KinkedTerm& kink : system.kinks) {
    if (kink.row >= m) kink.row += count;
  }
  const auto add = [count](MatrixXd& matrix, int rows, int cols) {
    MatrixXd larger = MatrixXd::Zero(matrix.rows() + rows * count, matrix.cols() + cols * count);
    larger.topLeftCorner(matrix.rows(), matrix.cols()) = matrix;
    matrix = larger;
  };
  add(system.A, 1, 1);
  add(system.B, 1, 0);
  add(system.N, 0, 1);
  for (MatrixXd& F : system.F) add(F, 1, 0);
  if (system.num_outputs() > 0) add(system.C, 0, 1);
  VectorXd x0 = VectorXd::Zero(m + count);
  x0.head(m) = system.x0;
  system.x0 = x0;
  return system;
}

}  // namespace

System WithUnreachableStates(const System& system, int count, double size, Random& random) {
  System result = WithMoreStates(system, count);
  const int m = system.num_states();
  for (int k = m; k < m + count; ++k) {
    for (int j = m; j < m + count; ++j) result.A(k, j) = (random.Normal() - (k == j ? 3 : 0)) / system.horizon;
    for (int i = 0; i < m; ++i) result.A(i, k) = random.Normal() / (size * system.horizon);
    for (int i = 0; i < system.num_pairs(); ++i) result.N(i, k) = random.Normal() / size;
  }
  return result;
}

System WithUnobservableStates(const System& system, int count, double size, Random& random) {
  System result = WithMoreStates(system, count);
  const int m = system.num_states();
  for (int k = m; k < m + count; ++k) {
    for (int j = m; j < m + count; ++j) result.A(k, j) = (random.Normal() - (k == j ? 3 : 0)) / system.horizon;
    for (int j = 0; j < m; ++j) result.A(k, j) = size * random.Normal() / system.horizon;
    for (int j = 0; j < system.num_pairs(); ++j) result.B(k, j) = size * random.Normal() / system.horizon;
    result.x0(k) = size * random.Normal();
  }
  return result;
}

System Joined(const System& first, const System& second) {
  System result = first;
  const auto diagonal = [](const MatrixXd& a, const MatrixXd& b) {
    MatrixXd both = MatrixXd::Zero(a.rows() + b.rows(), a.cols() + b.cols());
    both.topLeftCorner(a.rows(), a.cols()) = a;
    both.bottomRightCorner(b.rows(), b.cols()) = b;
    return both;
  };
  result.A = diagonal(first.A, second.A);
  result.B = diagonal(first.B, second.B);
  result.N = diagonal(first.N, second.N);
  result.M = diagonal(first.M, second.M);
  result.F = {diagonal(first.F[0], second.F[0])};
  result.G = {diagonal(first.G[0], second.G[0])};
  // Empty ones have no columns.
  const auto with_columns = [](const MatrixXd& a, int columns) {
    return a.size() > 0 ? a : MatrixXd::Zero(0, columns);
  };
  result.C = diagonal(with_columns(first.C, first.num_states()), with_columns(second.C, second.num_states()));
  result.D = diagonal(with_columns(first.D, first.num_pairs()), with_columns(second.D, second.num_pairs()));
  result.x0 = VectorXd(first.num_states() + second.num_states());
  result.x0 << first.x0, second.x0;
  const int m = first.num_states();
  for (KinkedTerm& kink : result.kinks) {
    if (kink.row >= m) kink.row += second.num_states();
  }
  for (KinkedTerm kink : second.kinks) {
    kink.row += kink.row < second.num_states() ? m : m + first.num_pairs();
    kink.function += static_cast<int>(first.functions.size());
    result.kinks.push_back(kink);
  }
  result.functions.insert(result.functions.end(), second.functions.begin(), second.functions.end());
  result.traits = first.traits + " beside " + second.traits;
  return result;
}

}  // namespace dlcs::hostile
