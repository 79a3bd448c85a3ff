// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/index_one_section.h"

#include <algorithm>
#include <string>
#include <utility>
#include <variant>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/analysis/index_one.h"
#include "core/matrix_classes/semicopositive.h"
#include "core/matrix_classes/semicopositive_types.h"

namespace dlcs {
namespace {

constexpr char kOfShenPang[] = " of [Shen & Pang 2007]";

std::string In(const char* statement) { return absl::StrCat(statement, kOfShenPang); }

struct IsZero {
  bool operator()(const ConstantFunction& f) const { return f.value.isZero(0); }
  bool operator()(const SampledFunction& f) const { return f.values.isZero(0); }
  bool operator()(const FormulaFunction& f) const {
    return std::all_of(f.formulas.begin(), f.formulas.end(), [](const std::string& formula) {
      double value = 1;
      return absl::SimpleAtod(formula, &value) && value == 0;
    });
  }
  bool operator()(const PiecewisePolynomial& f) const {
    return std::all_of(f.coefficients.begin(), f.coefficients.end(), [](const Matrix& c) { return c.isZero(0); });
  }
};

// All data from which the findings are derived.
struct Evidence {
  const Problem& problem;
  IndexOneSystem system;
  Matrix NB;
  bool autonomous;  // f = g = 0
  Fact strictly, type_one;
  SteppingBounds stepping;
  ShortTimeBounds short_time;
  Semiobservability start;
  double free_until;
};

Fact TypeOne(const Matrix& NB, const LowerBound& sigma) {
  Fact fact = TestSemicopositiveTypeI(NB);
  if (fact.answer != Answer::kUnknown || !(sigma.value > 0)) return fact;
  return {Answer::kYes, absl::StrCat("the integral in the definition is at least ", sigma.value, " ‖v(t)‖²")};
}

Evidence Collect(const Problem& problem, const std::stop_token& stop) {
  Evidence e{.problem = problem,
             .system = {problem.A, problem.B, problem.N},
             .NB = problem.N * problem.B,
             .autonomous = IsZeroByItsData(problem.f) && IsZeroByItsData(problem.g),
             .strictly = {},
             .type_one = {},
             .stepping = {},
             .short_time = {},
             .start = {},
             .free_until = 0};
  e.stepping = ComputeSteppingBounds(e.system);
  e.short_time = ComputeShortTimeBounds(e.system, problem.horizon, stop);
  e.strictly = TestStrictlySemicopositive(e.NB);
  e.type_one = TypeOne(e.NB, e.short_time.sigma);
  e.start = TestSemiobservability(problem.N, problem.A, problem.x0);
  e.free_until = FreeMotionTime(e.system, problem.x0, e.start, problem.horizon, stop);
  return e;
}

Fact Unknown(std::string why) { return {Answer::kUnknown, std::move(why)}; }

constexpr char kNotAutonomous[] = "stated for f = g = 0 only";

// Theorem 7: existence.
Fact Existence(const Evidence& e) {
  if (!e.autonomous) return Unknown(kNotAutonomous);
  if (!e.strictly.yes()) return Unknown("NB is not known to be strictly semicopositive");
  if ((e.problem.N * e.problem.x0).minCoeff() < 0) return Unknown("N x0 >= 0 does not hold");
  return {Answer::kYes, "NB is strictly semicopositive and N x0 >= 0"};
}

// Theorem 9(b), and (c) where the type is not known.
Fact Uniqueness(const Evidence& e) {
  if (!e.autonomous) return Unknown(kNotAutonomous);
  if (!e.type_one.yes()) return Unknown("NB is not known to be of type I");
  if (!e.start.in_cone.yes()) {
    return Unknown(absl::StrCat("x0 is not known to lie in the semiobservability cone: ", e.start.in_cone.why));
  }
  return {Answer::kYes, absl::StrCat("NB is of type I and N e^{At} x0 >= 0 for t <= ", e.free_until,
                                     ": until then x = e^{At} x0 and y = 0 is the only solution")};
}

Fact FreeForever(const Evidence& e) {
  if (!e.autonomous) return Unknown(kNotAutonomous);
  if (!e.type_one.yes()) return Unknown("NB is not known to be of type I");
  if (!e.start.in_unobservable_space.yes()) return Unknown(e.start.in_unobservable_space.why);
  return {Answer::kYes, "N e^{At} x0 = 0 for all t: x = e^{At} x0 and y = 0 is the only solution on [0, T]"};
}

Fact ScalarMatrix(const Evidence& e) {
  if (!e.autonomous) return Unknown(kNotAutonomous);
  const Matrix& A = e.problem.A;
  if (A != A(0, 0) * Matrix::Identity(A.rows(), A.cols())) return Unknown("A is not a multiple of the identity");
  if (!e.strictly.yes()) return Unknown("NB is not known to be strictly semicopositive");
  for (const LexicographicRow& row : e.start.rows) {
    if (row.sign == LexicographicRow::Sign::kNegative || row.sign == LexicographicRow::Sign::kUndecided)
      return Unknown("N x0 >= 0 does not hold, or only up to rounding");
  }
  return {Answer::kYes,
          absl::StrCat("A = ", A(0, 0), " I: x = e^{", A(0, 0), " t} x0 and y = 0 is the only solution on [0, ∞)")};
}

Constant Bound(std::string id, std::string symbol, std::string title, double value, ConstantKind kind,
               const LowerBound& sigma, std::string why, std::string source) {
  Constant constant{std::move(id), std::move(symbol), std::move(title), {}, kind, std::move(why), std::move(source)};
  if (sigma.value > 0)
    constant.value = value;
  else
    constant.why = sigma.why;
  return constant;
}

// Without its value where it bounds a system that moves by itself only.
Constant OfAutonomous(Constant constant, const Evidence& e) {
  if (e.autonomous) return constant;
  constant.value.reset();
  constant.why = kNotAutonomous;
  return constant;
}

void AddConstants(const Evidence& e, AnalysisSection& section) {
  using enum ConstantKind;
  const LowerBound& sigma = e.stepping.sigma;
  const LowerBound& type_one = e.short_time.sigma;
  section.constants = {
      Bound("sigma", "σ", "how strictly NB is semicopositive", sigma.value, kLowerBound, sigma, sigma.why, In("(3)")),
      Bound("step-bound", "h̄", "steps up to this have a solution", e.stepping.step, kLowerBound, sigma,
            "keeps half of σ for N(I - hA)⁻¹B", In("Theorem 7(a)")),
      OfAutonomous(Bound("rho-u", "ρ_u", "‖y‖ of a step <= ρ_u ‖x‖ before it, h <= h̄", e.stepping.rho_u, kUpperBound,
                         sigma, "from half of σ", In("(10)")),
                   e),
      OfAutonomous(Bound("psi-x", "ψ_x", "a step moves x by at most h ψ_x ‖x‖, h <= h̄", e.stepping.psi_x, kUpperBound,
                         sigma, "from ρ_u", In("(11)")),
                   e),
      Bound("sigma-type-one", "σ_I", "σ of type I, for all times", type_one.value, kLowerBound, type_one, type_one.why,
            In("Proposition 3")),
      OfAutonomous(Bound("epsilon-1", "ε_1", "until when σ_1 and σ_2 hold", e.short_time.epsilon1, kLowerBound,
                         type_one, "the bound of Φ in Lemma 8 is at most half of σ_I until then", In("Theorem 9(a)")),
                   e),
      OfAutonomous(Bound("sigma-1", "σ_1", "‖x(t)‖ <= σ_1 ‖x0‖ until ε_1", e.short_time.sigma1, kUpperBound, type_one,
                         "from σ_2", In("Theorem 9(a)")),
                   e),
      OfAutonomous(Bound("sigma-2", "σ_2", "‖∫y‖ <= σ_2 ‖x0‖ until ε_1", e.short_time.sigma2, kUpperBound, type_one,
                         "from half of σ_I", In("Theorem 9(a)")),
                   e)};
  Constant free_until{"free-until",
                      "ε_2",
                      "N e^{At} x0 >= 0 is proven until then",
                      {},
                      kLowerBound,
                      "Taylor bounds from point to point; depends on x0, unlike the printed ε_2",
                      In("Theorem 9(b)")};
  if (e.start.in_cone.yes())
    free_until.value = e.free_until;
  else
    free_until.why = "x0 is not known to lie in the semiobservability cone";
  section.constants.push_back(OfAutonomous(std::move(free_until), e));
}

constexpr Index kMaxDescribedRows = 4;

std::string DescribeRows(const Semiobservability& start) {
  std::string text;
  const Index rows = static_cast<Index>(start.rows.size()), shown = std::min(rows, kMaxDescribedRows);
  for (Index i = 0; i < shown; ++i) {
    absl::StrAppend(&text, text.empty() ? "" : "; ", DescribeRow(start.rows[i], i));
  }
  if (shown < rows) absl::StrAppend(&text, "; … ", rows, " rows in all");
  return text;
}

void AddWarnings(const Evidence& e, AnalysisSection& section) {
  if (!e.autonomous || !e.strictly.yes()) return;
  if (e.start.in_cone.no()) {
    section.warnings.push_back(absl::StrCat("x0 is outside the semiobservability cone (", e.start.in_cone.why,
                                            "): the solution may not be unique, even for NB a P-matrix (Example 10",
                                            kOfShenPang, ")."));
  } else if (!e.type_one.yes()) {
    section.warnings.push_back("NB is not known to be of type I: uniqueness near t = 0 is not guaranteed.");
  }
}

}  // namespace

bool IsZeroByItsData(const TimeFunction& function) {
  return std::all_of(function.pieces.begin(), function.pieces.end(),
                     [](const TimeFunction::Piece& piece) { return std::visit(IsZero{}, piece.function); });
}

AnalysisSection IndexOneSection(const Problem& problem, std::stop_token stop) {
  const Evidence e = Collect(problem, stop);
  AnalysisSection section{"index-one", "Index one: M = 0", {}, {}, {}};
  section.findings = {
      {"nb-strictly-semicopositive", "NB strictly semicopositive: index one", e.strictly, In("(1)")},
      {"nb-type-one", "NB strictly semicopositive of type I", e.type_one, In("section 4")},
      {"solution-exists", "A solution exists on [0, T]", Existence(e), In("Theorem 7")},
      {"semiobservable", "x0 in the semiobservability cone", e.start.in_cone, In("section 5.2")},
      {"unobservable", "x0 in the unobservable subspace", e.start.in_unobservable_space, In("section 5.2")},
      {"short-time-unique", "Free and unique at first", Uniqueness(e), In("Theorem 9(b)")},
      {"free-on-horizon", "Free and unique on [0, T]", FreeForever(e), In("Theorem 9(b)")},
      {"scalar-a", "Free and unique for all times, A = λI", ScalarMatrix(e), In("Corollary 2")}};
  if (e.start.in_cone.yes()) section.findings[3].fact.why = DescribeRows(e.start);
  AddConstants(e, section);
  AddWarnings(e, section);
  return section;
}

}  // namespace dlcs
