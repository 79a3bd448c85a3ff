// SPDX-License-Identifier: Apache-2.0
#include "core/linalg/linear_program.h"

#include <ClpEventHandler.hpp>
#include <ClpSimplex.hpp>
#include <CoinPackedMatrix.hpp>
#include <vector>

#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// CLP does not accept infinities, so they become COIN_DBL_MAX.
Vector ForClp(const Vector& bounds) { return bounds.cwiseMax(-COIN_DBL_MAX).cwiseMin(COIN_DBL_MAX); }

CoinPackedMatrix Packed(const Matrix& rows) {
  std::vector<int> row_of;
  std::vector<double> values;
  std::vector<CoinBigIndex> starts = {0};  // of the columns
  for (Index j = 0; j < rows.cols(); ++j) {
    for (Index i = 0; i < rows.rows(); ++i) {
      if (rows(i, j) == 0) continue;
      row_of.push_back(static_cast<int>(i));
      values.push_back(rows(i, j));
    }
    starts.push_back(static_cast<CoinBigIndex>(values.size()));
  }
  return CoinPackedMatrix(/*colordered=*/true, static_cast<int>(rows.rows()), static_cast<int>(rows.cols()),
                          starts.back(), values.data(), row_of.data(), starts.data(), /*lengths=*/nullptr);
}

// Ends the simplex method, between two of its iterations, when a stop is requested. No exception may pass through CLP.
class EndWhenStopped final : public ClpEventHandler {
 public:
  int event(Event) override {
    constexpr int kEnd = 0, kGoOn = -1;
    const std::stop_token* const stop = StopScope::Current();
    return stop && stop->stop_requested() ? kEnd : kGoOn;
  }
  ClpEventHandler* clone() const override { return new EndWhenStopped(*this); }
};

}  // namespace

LinearProgram MakeLinearProgram(Index rows, Index variables) {
  return {.cost = Vector::Zero(variables),
          .rows = Matrix::Zero(rows, variables),
          .row_lower = Vector::Constant(rows, -kUnbounded),
          .row_upper = Vector::Constant(rows, kUnbounded),
          .lower = Vector::Zero(variables),
          .upper = Vector::Constant(variables, kUnbounded)};
}

LinearProgramSolution SolveLinearProgram(const LinearProgram& program) {
  const Vector lower = ForClp(program.lower), upper = ForClp(program.upper);
  const Vector row_lower = ForClp(program.row_lower), row_upper = ForClp(program.row_upper);
  ClpSimplex simplex;
  simplex.setLogLevel(0);
  simplex.setPrimalTolerance(kProgramTolerance);
  simplex.setDualTolerance(kProgramTolerance);
  simplex.loadProblem(Packed(program.rows), lower.data(), upper.data(), program.cost.data(), row_lower.data(),
                      row_upper.data());
  const EndWhenStopped end_when_stopped;
  simplex.passInEventHandler(&end_when_stopped);
  LookForStop();
  simplex.dual();
  LookForStop();
  LinearProgramSolution solution;
  if (simplex.isProvenPrimalInfeasible()) {
    solution.verdict = LinearProgramVerdict::kInfeasible;
  } else if (simplex.isProvenDualInfeasible()) {
    solution.verdict = LinearProgramVerdict::kUnboundedBelow;
  } else if (simplex.isProvenOptimal()) {
    solution.verdict = LinearProgramVerdict::kOptimal;
    solution.z = Eigen::Map<const Vector>(simplex.getColSolution(), program.cost.size());
    solution.row_duals = Eigen::Map<const Vector>(simplex.getRowPrice(), program.rows.rows());
    solution.objective = program.cost.dot(solution.z);
  }
  return solution;
}

}  // namespace dlcs
