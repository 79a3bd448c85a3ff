// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/solution_section.h"

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/lcp/basis/solution_function.h"
#include "core/lcp/dense/basic_solutions.h"
#include "core/lcp/lcp.h"
#include "core/matrix_classes/lipschitz.h"
#include "core/problem/time_function.h"

namespace dlcs {
namespace {

constexpr const char* kChenXiang = "[Chen & Xiang]";

Constant ToConstant(std::string id, std::string symbol, std::string title, const LipschitzBound& bound,
                    std::string source) {
  return {.id = std::move(id),
          .symbol = std::move(symbol),
          .title = std::move(title),
          .value = bound.value,
          .kind = bound.kind,
          .why = bound.why,
          .source = std::move(source)};
}

std::string SetText(const std::vector<Index>& set) { return absl::StrCat("{", absl::StrJoin(set, ", "), "}"); }

void AddConstants(const Matrix& M, const MatrixClass& matrix_class, Selection selection, AnalysisSection& section) {
  const LipschitzBound lipschitz = BoundLipschitz(M);
  section.constants.push_back(ToConstant("lipschitz", "𝓛", "largest norm of an inverse of a principal submatrix",
                                         lipschitz, absl::StrCat("(2.3), (2.12) of ", kChenXiang)));
  LipschitzBound cube = lipschitz;
  if (matrix_class.p.yes()) {
    if (cube.value) cube.why = "attained where D is zero or one: equal to 𝓛";
  } else {
    cube = {std::nullopt, ConstantKind::kExact, "M is not known to be a P-matrix: I - D + D M may be singular"};
  }
  section.constants.push_back(ToConstant("cube-bound", "max ‖(I - D + D M)⁻¹ D‖",
                                         "the earlier bound over all D in [0, 1]ⁿ", cube,
                                         absl::StrCat("(2.6) of ", kChenXiang)));
  section.constants.push_back(ToConstant("mangasarian-shiau", "v_∞", "constant of Mangasarian and Shiau, never below 𝓛",
                                         MangasarianShiauConstant(M),
                                         absl::StrCat("(2.14), Proposition 2.1 of ", kChenXiang)));
  if (!IsAlwaysLipschitz(selection) && selection != Selection::kAny) {
    const std::optional<double> slope = LargestSlope(M);
    section.constants.push_back(
        {.id = "slope",
         .symbol = "max ‖M_SS⁺‖",
         .title = "largest slope of the selected solution where it does not jump",
         .value = slope,
         .kind = ConstantKind::kUpperBound,
         .why = slope ? "the largest norm of a pseudo-inverse of a principal submatrix" : "n is beyond enumeration",
         .source = "Remark 3.1 of [Wu & Chen]"});
  }
}

// The facts about one solution at q.
void AddSolution(const Matrix& M, const LcpResult& result, AnalysisSection& section) {
  const IndexSets& sets = result.sets;
  Fact degenerate{sets.degenerate() ? Answer::kYes : Answer::kNo,
                  absl::StrCat("J = ", SetText(sets.J), " (y > 0), I = ", SetText(sets.I),
                               " (w > 0), K = ", SetText(sets.K), " (y = w = 0)")};
  degenerate.witness.indices = sets.K;
  section.findings.push_back(
      {"degenerate", "the solution at t = 0 is degenerate", degenerate, absl::StrCat("section 2 of ", kChenXiang)});
  Fact differentiable = TestDifferentiable(M, sets);
  if (!IsAlwaysLipschitz(result.selection) && differentiable.yes()) {
    differentiable.why += "; if the selected solution is continuous near q";
  }
  section.findings.push_back({"differentiable", "y is differentiable at q = N x0 + g(0)", differentiable,
                              absl::StrCat("Lemma 2.1 of ", kChenXiang)});
}

// How many solutions there are.
void AddUniqueness(const Matrix& M, const Vector& q, const MatrixClass& matrix_class, Selection selection,
                   const std::stop_token& stop, AnalysisSection& section) {
  const std::string title = "the solution at t = 0 is the only one";
  if (matrix_class.p.yes()) {
    section.findings.push_back({"unique", title, {Answer::kYes, "M is a P-matrix"}, ""});
    return;
  }
  if (M.rows() > kMaxSolutionEnumeration) {
    section.findings.push_back(
        {"unique", title, {Answer::kUnknown, absl::StrCat("n = ", M.rows(), " is beyond enumeration")}, ""});
    return;
  }
  const BasicSolutions all = AllBasicSolutions(M, q, stop);
  const double count = static_cast<double>(all.solutions.size());
  const bool continuum = !all.faces.empty();
  const std::string found = absl::StrCat(all.solutions.size(), " basic solution", all.solutions.size() == 1 ? "" : "s",
                                         continuum ? ", and more on faces of singular bases" : "");
  Fact unique{all.unique() ? Answer::kYes : Answer::kNo, found};
  if (!all.complete && !unique.yes() && count <= 1) unique.answer = Answer::kUnknown;
  section.findings.push_back({"unique", title, unique, ""});
  section.constants.push_back(
      {.id = "basic-solutions",
       .symbol = "",
       .title = "basic solutions at t = 0",
       .value = count,
       .kind = all.complete ? ConstantKind::kExact : ConstantKind::kLowerBound,
       .why = all.complete ? "all complementary bases were enumerated" : "not all complementary bases were decided",
       .source = ""});
  if (unique.no() && !all.empty() && selection == Selection::kAny) {
    section.warnings.push_back(
        absl::StrCat("LCP(N x0 + g(0), M) has several solutions (", found,
                     "), and no rule says which is meant: each step takes the solution of its coupled LCP."));
  }
}

}  // namespace

AnalysisSection SolutionSection(const Problem& problem, const MatrixClass& matrix_class, Selection selection,
                                const std::stop_token& stop) {
  AnalysisSection section;
  section.id = "solution";
  section.title = "Solution of the complementarity problem";
  const Matrix& M = problem.M;
  AddConstants(M, matrix_class, selection, section);

  auto g = TimeFunctionEvaluator::Create(problem.g, problem.num_constraints(), AxisOf(problem));
  if (!g.ok()) return section;  // does not happen for a valid problem
  Vector q(problem.num_constraints());
  g->Evaluate(0, Side::kRight, q);
  q += problem.N * problem.x0;

  const LcpResult result = SolveClassifiedLcp(M, q, matrix_class, {selection, problem.selector, matrix_class});
  const bool solved = result.verdict == LcpStatus::kSolved;
  Fact solvable{solved ? Answer::kYes : Answer::kUnknown, solved ? "solved by " + result.method : result.message};
  if (result.verdict == LcpStatus::kInfeasible) solvable.answer = Answer::kNo;
  if (solved) solvable.witness.z = result.y;
  section.findings.push_back({"solvable", "LCP(N x0 + g(0), M) has a solution", solvable, ""});
  if (solved) {
    AddSolution(M, result, section);
    AddUniqueness(M, q, matrix_class, selection, stop, section);
    if (!result.only_choice) {
      section.warnings.push_back(absl::StrCat("At t = 0 several solutions tie for ", SelectionName(selection),
                                              "; of these the least in norm is taken, and y may jump there."));
    }
  }
  section.findings.push_back({"interior-point", "some v > 0 has N x0 + g(0) + M v > 0", TestInteriorPoint(M, q),
                              absl::StrCat("(4.1), Remark 2.1 (ii) of ", kChenXiang)});
  if (selection == Selection::kHiddenLeastElement) {
    section.warnings.push_back(
        "The least element in the order of pos X depends on X, which M does not determine: it is that of the X found.");
  }
  if (selection == Selection::kLeastNorm || selection == Selection::kMinimizer || selection == Selection::kSparsest) {
    section.warnings.push_back(absl::StrCat(SelectionName(selection),
                                            " need not be a continuous function of x for this M (Remark 2.1 of ",
                                            kChenXiang, ")."));
  }
  return section;
}

}  // namespace dlcs
