// SPDX-License-Identifier: Apache-2.0
#include "core/models/input_output.h"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/format_number.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/norms.h"
#include "core/matrix_classes/m_matrix.h"
#include "core/problem/validate.h"
#include "core/problem/violation_list.h"

namespace dlcs {
namespace {

struct SumFacts {
  Fact at_most_one, all_strict, one_strict;
};

SumFacts JudgeSums(const Vector& sums, const std::string& what) {
  const double rounding = RoundingOf(64 * sums.size());
  Index largest = 0, smallest = 0;
  const double high = sums.maxCoeff(&largest), low = sums.minCoeff(&smallest);
  const auto fact = [&](bool holds, Index at, double value) {
    const std::string why = what + " " + std::to_string(at) + " of C sums to " + FormatNumber(value);
    Fact result{holds ? Answer::kYes : Answer::kNo, why};
    result.witness.indices = {at};
    result.witness.value = value;
    return result;
  };
  return {fact(high <= 1 + rounding, largest, high), fact(high < 1 - rounding, largest, high),
          fact(low < 1 - rounding, smallest, low)};
}

// The indices that 0 reaches along nonzero entries of `C`, itself included.
Index CountReached(const Matrix& C) {
  std::vector<bool> reached(C.rows(), false);
  std::vector<Index> open = {0};
  reached[0] = true;
  Index count = 0;
  for (; !open.empty(); ++count) {
    const Index i = open.back();
    open.pop_back();
    for (Index j = 0; j < C.cols(); ++j) {
      if (C(i, j) == 0 || reached[j]) continue;
      reached[j] = true;
      open.push_back(j);
    }
  }
  return count;
}

Fact JudgeIrreducible(const Matrix& C) {
  const bool yes = CountReached(C) == C.rows() && CountReached(C.transpose()) == C.rows();
  return {yes ? Answer::kYes : Answer::kNo, yes ? "every commodity needs every other, directly or through others"
                                                : "some commodity does not need some other, not even through others"};
}

Fact JudgeCondition(const InputOutputFacts& facts) {
  if (facts.columns_all_strict.yes()) return {Answer::kYes, "every column sum of C is less than 1"};
  if (facts.rows_all_strict.yes()) return {Answer::kYes, "every row sum of C is less than 1"};
  if (facts.irreducible.yes()) {
    if (facts.column_sums.yes() && facts.columns_one_strict.yes()) {
      return {Answer::kYes, "C is irreducible with column sums at most 1, one of them less"};
    }
    if (facts.row_sums.yes() && facts.rows_one_strict.yes()) {
      return {Answer::kYes, "C is irreducible with row sums at most 1, one of them less"};
    }
  }
  return {Answer::kNo, "neither (4.7) nor (4.8) holds strictly, or irreducibly with one strict inequality"};
}

Finding MakeFinding(const char* id, const char* title, const Fact& fact, const char* source) {
  return {id, title, fact, source};
}

}  // namespace

absl::StatusOr<Problem> MakeInputOutputProblem(const InputOutputModel& model) {
  const Index n = model.C.rows();
  if (n == 0 || model.C.cols() != n) {
    return InvalidField(
        "C", std::to_string(n) + "x" + std::to_string(model.C.cols()) + "; must be square with at least one row");
  }
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      if (std::isfinite(model.C(i, j)) && model.C(i, j) >= 0) continue;
      return InvalidField("C[" + std::to_string(i) + "][" + std::to_string(j) + "]",
                          NumberText(model.C(i, j)) + "; must be finite and at least 0");
    }
  }
  Problem problem;
  problem.A = model.A;
  problem.B = model.B;
  problem.N = -Matrix::Identity(n, n);
  problem.M = Matrix::Identity(n, n) - model.C;
  problem.f = model.f;
  problem.g = TimeFunction::Zero(n);
  problem.x0 = model.demand;
  problem.horizon = model.horizon;
  problem.rule = SolutionRule::kLeastElement;
  if (absl::Status status = CheckValid(problem, Options{}); !status.ok()) return status;
  return problem;
}

InputOutputFacts AnalyzeInputOutput(const InputOutputModel& model) {
  const Index n = model.C.rows();
  InputOutputFacts facts;
  const SumFacts columns = JudgeSums(model.C.colwise().sum().transpose(), "column");
  const SumFacts rows = JudgeSums(model.C.rowwise().sum(), "row");
  facts.column_sums = columns.at_most_one;
  facts.columns_all_strict = columns.all_strict;
  facts.columns_one_strict = columns.one_strict;
  facts.row_sums = rows.at_most_one;
  facts.rows_all_strict = rows.all_strict;
  facts.rows_one_strict = rows.one_strict;
  facts.irreducible = JudgeIrreducible(model.C);
  facts.condition = JudgeCondition(facts);

  const Matrix M = Matrix::Identity(n, n) - model.C;
  if (!IsNonsingularMMatrix(M)) {
    facts.m_matrix = {Answer::kNo, "elimination without row exchanges meets a pivot that is not positive"};
    return facts;
  }
  const Matrix inverse = M.inverse();
  facts.m_matrix = {Answer::kYes, "I - C is a Z-matrix whose inverse is nonnegative"};
  facts.m_matrix.witness.X = inverse;
  facts.kappa = InfinityNorm(model.A) + InfinityNorm(inverse) * InfinityNorm(model.B);
  facts.step_bound = *facts.kappa > 0 ? 1 / (3 * *facts.kappa) : std::numeric_limits<double>::infinity();
  return facts;
}

AnalysisSection InputOutputSection(const InputOutputModel& model) {
  const InputOutputFacts facts = AnalyzeInputOutput(model);
  constexpr const char* kSource = "section 4 of [Chen & Xiang]";
  AnalysisSection section;
  section.id = "input-output";
  section.title = "Input-output model";
  section.findings = {
      MakeFinding("column-sums", "Column sums of C at most 1", facts.column_sums, "(4.7) of [Chen & Xiang]"),
      MakeFinding("row-sums", "Row sums of C at most 1", facts.row_sums, "(4.8) of [Chen & Xiang]"),
      MakeFinding("irreducible", "C irreducible", facts.irreducible, kSource),
      MakeFinding("m-matrix-condition", "The paper's condition for an M-matrix", facts.condition, kSource),
      MakeFinding("m-matrix", "I - C is an M-matrix", facts.m_matrix, kSource)};
  const std::string why = facts.kappa ? "from (I - C)⁻¹" : "I - C is not a nonsingular M-matrix";
  section.constants = {{.id = "kappa",
                        .symbol = "κ",
                        .title = "Lipschitz constant of the right-hand side",
                        .value = facts.kappa,
                        .why = why,
                        .source = kSource},
                       {.id = "step-bound",
                        .symbol = "1/(3κ)",
                        .title = "with shorter steps Newton's method converges",
                        .value = facts.step_bound,
                        .why = why,
                        .source = kSource}};
  if (!facts.m_matrix.yes()) {
    section.warnings.push_back("I - C is not a nonsingular M-matrix: some demands cannot be supplied.");
  }
  return section;
}

}  // namespace dlcs
