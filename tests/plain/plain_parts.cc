// SPDX-License-Identifier: Apache-2.0
#include "tests/plain/plain_parts.h"

#include <cmath>

#include "tests/hostile/transforms.h"

namespace dlcs::plain {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using hostile::SourceFunction;

double LogUniform(Random& random, double low, double high) {
  return std::exp(random.Uniform(std::log(low), std::log(high)));
}

PlainSystem LinearSystem(const MatrixXd& A, const VectorXd& x0, const VectorXd& constant, double horizon,
                         const VectorXd& beside) {
  const auto m = A.rows();
  PlainSystem result{{}, {}, beside};
  System& system = result.system;
  system.A = A;
  system.B = MatrixXd::Zero(m, 1);
  system.N = MatrixXd::Zero(1, m);
  system.M = MatrixXd::Ones(1, 1);
  system.x0 = x0;
  system.horizon = horizon;
  system.functions = {{}};
  system.starts = {0};
  system.F = {constant};
  system.G = {MatrixXd::Ones(1, 1)};
  system.C = MatrixXd::Zero(0, m);
  system.D = MatrixXd::Zero(0, 1);
  system.is_lipschitz = true;
  return result;
}

void AddWave(System& system, int row, double amplitude, double rate, double phase) {
  const auto at = static_cast<Index>(system.functions.size());
  system.functions.push_back({SourceFunction::Kind::kSine, 0, rate, phase});
  system.functions.push_back({SourceFunction::Kind::kCosine, 0, rate, phase});
  for (MatrixXd* factors : {&system.F[0], &system.G[0]}) {
    factors->conservativeResize(Eigen::NoChange, at + 2);
    factors->rightCols(2).setZero();
  }
  const int m = system.num_states();
  (row < m ? system.F[0](row, at) : system.G[0](row - m, at)) = amplitude;
}

void AddOutput(System& system, const VectorXd& of_x) {
  const auto p = system.C.rows();
  system.C.conservativeResize(p + 1, Eigen::NoChange);
  system.D.conservativeResize(p + 1, Eigen::NoChange);
  system.C.row(p) = of_x.transpose();
  system.D.row(p).setZero();
}

PlainSystem Beside(const PlainSystem& first, const PlainSystem& second, const MatrixXd& gains) {
  PlainSystem result;
  System& system = result.system;
  system = hostile::Joined(first.system, second.system);
  system.A.bottomLeftCorner(gains.rows(), gains.cols()) = gains;
  system.is_lipschitz = first.system.is_lipschitz && second.system.is_lipschitz;
  system.rank_matters = first.system.rank_matters || second.system.rank_matters;
  result.beside = VectorXd(first.beside.size() + second.beside.size());
  result.beside << first.beside, second.beside;
  return result;
}

}  // namespace dlcs::plain
