// SPDX-License-Identifier: Apache-2.0
#include "server/wire/convert.h"

#include <algorithm>
#include <type_traits>
#include <utility>
#include <variant>

#include "core/problem/formula.h"
#include "fmt/format.h"
#include "proto/wire/matrix_shape.h"
#include "server/wire/component_names.h"
#include "server/wire/convert_dense.h"

namespace dlcs {
namespace {

Vector VectorFromProto(const Doubles& values) { return Eigen::Map<const Vector>(values.data(), values.size()); }

// A list of values as `size` rows, component fastest.
Matrix ColumnsFromProto(const Doubles& values, Index size, const std::string& field,
                        std::vector<Violation>& violations) {
  if (size == 0 ? !values.empty() : values.size() % size != 0) {
    violations.push_back(
        {field, fmt::format("{} values; must be a multiple of the {} components", values.size(), size)});
    return Matrix();
  }
  return Eigen::Map<const Matrix>(values.data(), size, size == 0 ? 0 : values.size() / size);
}

Index DeclaredRows(const v1::Matrix& matrix) { return std::max<Index>(0, ShapeOf(matrix).rows); }

// Each of `formulas` with names replaced as the engine expects.
std::vector<std::string> InNumbers(const google::protobuf::RepeatedPtrField<std::string>& formulas,
                                   const NamesInFormulas& names) {
  std::vector<std::string> result;
  result.reserve(static_cast<std::size_t>(formulas.size()));
  for (const std::string& formula : formulas) result.push_back(names.InNumbers(formula));
  return result;
}

TimePiece TimePieceFromProto(const v1::TimePiece& piece, Index size, const std::string& field,
                             std::vector<Violation>& violations, const NamesInFormulas& names) {
  switch (piece.kind_case()) {
    case v1::TimePiece::kConstant:
      return ConstantFunction{VectorFromProto(piece.constant().values())};
    case v1::TimePiece::kFormulas:
      return FormulaFunction{InNumbers(piece.formulas().formulas(), names)};
    case v1::TimePiece::kSamples: {
      const v1::SampledFunction& samples = piece.samples();
      return SampledFunction{{samples.times().begin(), samples.times().end()},
                             ColumnsFromProto(samples.values(), size, field + ".samples", violations)};
    }
    case v1::TimePiece::kPolynomial: {
      PiecewisePolynomial result;
      result.breaks.assign(piece.polynomial().breaks().begin(), piece.polynomial().breaks().end());
      for (int p = 0; p < piece.polynomial().coefficients_size(); ++p) {
        result.coefficients.push_back(ColumnsFromProto(piece.polynomial().coefficients(p).values(), size,
                                                       fmt::format("{}.polynomial.coefficients[{}]", field, p),
                                                       violations));
      }
      return result;
    }
    case v1::TimePiece::KIND_NOT_SET:
      break;
  }
  violations.push_back({field, "no function; set one of constant, formulas, samples, polynomial"});
  return ConstantFunction{Vector()};
}

v1::SolutionRule ToProto(SolutionRule rule) {
  switch (rule) {
    case SolutionRule::kAuto:
      return v1::SOLUTION_RULE_UNSPECIFIED;
    case SolutionRule::kUnique:
      return v1::SOLUTION_RULE_UNIQUE;
    case SolutionRule::kLeastElement:
      return v1::SOLUTION_RULE_LEAST_ELEMENT;
    case SolutionRule::kHiddenLeastElement:
      return v1::SOLUTION_RULE_HIDDEN_LEAST_ELEMENT;
    case SolutionRule::kLeastNorm:
      return v1::SOLUTION_RULE_LEAST_NORM;
    case SolutionRule::kMinimizer:
      return v1::SOLUTION_RULE_MINIMIZER;
    case SolutionRule::kSparsest:
      return v1::SOLUTION_RULE_SPARSEST;
    case SolutionRule::kHistory:
      return v1::SOLUTION_RULE_HISTORY;
  }
  return v1::SOLUTION_RULE_UNSPECIFIED;
}

bool HasFormulas(const v1::TimeFunction& function) {
  return std::any_of(function.pieces().begin(), function.pieces().end(),
                     [](const v1::TimePiece& piece) { return piece.has_formulas(); });
}

// Members share the matrices of their problem: no entry may change its value when the parameters change from `before`
// to `after`.
void CheckSharedMatrices(const v1::Problem& base, const FormulaParameters& before, const FormulaParameters& after,
                         const std::string& field, std::vector<Violation>& violations) {
  const NamesInFormulas names_before({}, before), names_after({}, after);
  const auto differs = [&](const auto& formulas) {
    for (const v1::EntryFormula& entry : formulas) {
      auto one = Formula::Parse(names_before.InNumbers(entry.formula()));
      auto other = Formula::Parse(names_after.InNumbers(entry.formula()));
      if (one.ok() && other.ok() && one->Evaluate(0) != other->Evaluate(0)) return true;
    }
    return false;
  };
  for (const auto& [name, matrix] : {std::pair("A", &base.a()),
                                     {"B", &base.b()},
                                     {"N", &base.n()},
                                     {"M", &base.m()},
                                     {"E", &base.e()},
                                     {"outputs.C", &base.outputs().c()},
                                     {"outputs.D", &base.outputs().d()}}) {
    if (!differs(matrix->dense().formulas()) && !differs(matrix->sparse().formulas())) continue;
    violations.push_back(
        {field, fmt::format("change {}, which all members of an ensemble share; solve them one by one", name)});
  }
}

}  // namespace

TimeFunction TimeFunctionFromProto(const v1::TimeFunction& function, Index size, const std::string& field,
                                   std::vector<Violation>& violations, const FormulaParameters& parameters) {
  TimeFunction result;
  const NamesInFormulas names({}, parameters);
  if (function.has_lift()) {
    result.lift = StructuredMatrixFromProto(function.lift(), field + ".lift", violations);
    size = std::max<Index>(0, ShapeOf(function.lift()).columns);
  }
  if (function.pieces().empty()) violations.push_back({field, "not set; at least one piece is required"});
  for (int p = 0; p < function.pieces_size(); ++p) {
    const v1::TimePiece& piece = function.pieces(p);
    result.pieces.push_back(
        {piece.start(), TimePieceFromProto(piece, size, fmt::format("{}.pieces[{}]", field, p), violations, names)});
  }
  return result;
}

SolutionRule RuleFromProto(v1::SolutionRule rule, std::vector<Violation>& violations) {
  switch (rule) {
    case v1::SOLUTION_RULE_UNSPECIFIED:
      return SolutionRule::kAuto;
    case v1::SOLUTION_RULE_UNIQUE:
      return SolutionRule::kUnique;
    case v1::SOLUTION_RULE_LEAST_ELEMENT:
      return SolutionRule::kLeastElement;
    case v1::SOLUTION_RULE_HIDDEN_LEAST_ELEMENT:
      return SolutionRule::kHiddenLeastElement;
    case v1::SOLUTION_RULE_LEAST_NORM:
      return SolutionRule::kLeastNorm;
    case v1::SOLUTION_RULE_MINIMIZER:
      return SolutionRule::kMinimizer;
    case v1::SOLUTION_RULE_SPARSEST:
      return SolutionRule::kSparsest;
    case v1::SOLUTION_RULE_HISTORY:
      return SolutionRule::kHistory;
    default:
      break;
  }
  violations.push_back(
      {"rule", fmt::format("{}; this server does not know this rule (0 automatic, 1 unique, "
                           "2 least element, 3 hidden least element, 4 least norm, 5 minimizer, 6 sparsest, 7 history)",
                           static_cast<int>(rule))});
  return SolutionRule::kAuto;
}

Selector SelectorFromProto(const v1::Selector& selector, Index n, std::vector<Violation>& violations) {
  // Before a matrix of an arbitrary declared shape is allocated.
  const WireShape shape = ShapeOf(selector.c());
  if (shape.rows != selector.b_size() || shape.columns != n) {
    violations.push_back(
        {"selector.C", fmt::format("{} x {}; must have a row for each of the {} entries of b and {} columns, "
                                   "one for each pair",
                                   shape.rows, shape.columns, selector.b_size(), n)});
    return {};
  }
  return {MatrixFromProto(selector.c(), "selector.C", violations), VectorFromProto(selector.b())};
}

Problem ProblemFromProto(const v1::Problem& problem, std::vector<Violation>& violations) {
  Problem result;
  const FormulaParameters parameters = ParametersFromProto(problem.parameters(), "parameters", violations);
  CheckNames(NamesOf(problem), parameters, DeclaredRows(problem.a()), DeclaredRows(problem.m()), violations);
  result.A = StructuredMatrixFromProto(problem.a(), "A", violations, &parameters);
  result.B = StructuredMatrixFromProto(problem.b(), "B", violations, &parameters);
  result.N = StructuredMatrixFromProto(problem.n(), "N", violations, &parameters);
  result.M = StructuredMatrixFromProto(problem.m(), "M", violations, &parameters);
  // Declared shapes, so that a matrix with a wrong number of values does not make the functions look wrong
  // too.
  result.f = TimeFunctionFromProto(problem.f(), DeclaredRows(problem.a()), "f", violations, parameters);
  result.g = TimeFunctionFromProto(problem.g(), DeclaredRows(problem.m()), "g", violations, parameters);
  result.x0 = VectorFromProto(problem.x0());
  result.horizon = problem.horizon();
  result.break_points.assign(problem.break_points().begin(), problem.break_points().end());
  result.rule = RuleFromProto(problem.rule(), violations);
  if (problem.y0_size() > 0) result.y0 = VectorFromProto(problem.y0());
  if (problem.has_e()) result.E = StructuredMatrixFromProto(problem.e(), "E", violations, &parameters);
  if (problem.has_selector())
    result.selector = SelectorFromProto(problem.selector(), DeclaredRows(problem.m()), violations);
  if (problem.has_outputs()) {
    result.outputs = OutputsFromProto(problem.outputs(), DeclaredRows(problem.a()), DeclaredRows(problem.m()),
                                      violations, parameters);
  }
  result.measurements = MeasurementsFromProto(problem.measurements(), violations);
  return result;
}

EnsembleMember MemberFromProto(const v1::EnsembleMember& member, const v1::Problem& base, const std::string& field,
                               std::vector<Violation>& violations) {
  EnsembleMember result;
  // As declared; negative numbers are refused with the problem.
  const Index m = DeclaredRows(base.a()), n = DeclaredRows(base.m());
  std::vector<Violation> of_base;  // reported with the problem
  FormulaParameters parameters = ParametersFromProto(base.parameters(), "parameters", of_base);
  if (!member.parameters().empty()) {
    const FormulaParameters before = parameters;
    ChangeParameters(member.parameters(), field + ".parameters", parameters, violations);
    CheckSharedMatrices(base, before, parameters, field + ".parameters", violations);
    if (HasFormulas(base.f())) result.f = TimeFunctionFromProto(base.f(), m, "f", of_base, parameters);
    if (HasFormulas(base.g())) result.g = TimeFunctionFromProto(base.g(), n, "g", of_base, parameters);
    if (HasFormulas(base.outputs().h())) {
      result.h =
          TimeFunctionFromProto(base.outputs().h(), base.outputs().names_size(), "outputs.h", of_base, parameters);
    }
  }
  if (!member.x0().empty()) result.x0 = VectorFromProto(member.x0());
  if (member.has_f()) result.f = TimeFunctionFromProto(member.f(), m, field + ".f", violations, parameters);
  if (member.has_g()) result.g = TimeFunctionFromProto(member.g(), n, field + ".g", violations, parameters);
  if (member.has_horizon()) result.horizon = member.horizon();
  if (member.has_break_points()) {
    const Doubles& times = member.break_points().times();
    result.break_points.emplace(times.begin(), times.end());
  }
  return result;
}

NonlinearProblem NonlinearProblemFromProto(const v1::NonlinearProblem& problem, std::vector<Violation>& violations) {
  NonlinearProblem result;
  const FormulaParameters parameters = ParametersFromProto(problem.parameters(), "parameters", violations);
  const ComponentNames names = NamesOf(problem);
  CheckNames(names, parameters, problem.x0_size(), problem.g_size(), violations);
  const NamesInFormulas in_formulas(names, parameters);
  result.f = InNumbers(problem.f(), in_formulas);
  result.g = InNumbers(problem.g(), in_formulas);
  result.x0 = VectorFromProto(problem.x0());
  result.horizon = problem.horizon();
  result.break_points.assign(problem.break_points().begin(), problem.break_points().end());
  if (problem.has_w()) result.W = MatrixFromProto(problem.w(), "W", violations, &parameters);
  return result;
}

v1::TimeFunction ToProto(const TimeFunction& function) {
  v1::TimeFunction result;
  if (function.is_lifted()) *result.mutable_lift() = ToProto(function.lift);
  for (const TimeFunction::Piece& piece : function.pieces) {
    v1::TimePiece& out = *result.add_pieces();
    out.set_start(piece.start);
    std::visit(
        [&out](const auto& kind) {
          using Kind = std::decay_t<decltype(kind)>;
          if constexpr (std::is_same_v<Kind, ConstantFunction>) {
            Append(kind.value, *out.mutable_constant()->mutable_values());
          } else if constexpr (std::is_same_v<Kind, FormulaFunction>) {
            out.mutable_formulas()->mutable_formulas()->Add(kind.formulas.begin(), kind.formulas.end());
          } else if constexpr (std::is_same_v<Kind, SampledFunction>) {
            out.mutable_samples()->mutable_times()->Add(kind.times.begin(), kind.times.end());
            Append(kind.values, *out.mutable_samples()->mutable_values());
          } else {
            static_assert(std::is_same_v<Kind, PiecewisePolynomial>);
            out.mutable_polynomial()->mutable_breaks()->Add(kind.breaks.begin(), kind.breaks.end());
            for (const Matrix& coefficients : kind.coefficients) {
              Append(coefficients, *out.mutable_polynomial()->add_coefficients()->mutable_values());
            }
          }
        },
        piece.function);
  }
  return result;
}

v1::Problem ToProto(const Problem& problem) {
  v1::Problem result;
  *result.mutable_a() = ToProto(problem.A);
  *result.mutable_b() = ToProto(problem.B);
  *result.mutable_n() = ToProto(problem.N);
  *result.mutable_m() = ToProto(problem.M);
  *result.mutable_f() = ToProto(problem.f);
  *result.mutable_g() = ToProto(problem.g);
  Append(problem.x0, *result.mutable_x0());
  result.set_horizon(problem.horizon);
  result.mutable_break_points()->Add(problem.break_points.begin(), problem.break_points.end());
  result.set_rule(ToProto(problem.rule));
  if (problem.selector) {
    *result.mutable_selector()->mutable_c() = ToProto(problem.selector->C);
    Append(problem.selector->b, *result.mutable_selector()->mutable_b());
  }
  if (problem.y0) Append(*problem.y0, *result.mutable_y0());
  if (problem.has_mass()) *result.mutable_e() = ToProto(problem.E);
  if (problem.outputs.size() > 0) *result.mutable_outputs() = ToProto(problem.outputs);
  for (const Measurement& measurement : problem.measurements) *result.add_measurements() = ToProto(measurement);
  return result;
}

}  // namespace dlcs
