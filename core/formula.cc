// SPDX-License-Identifier: Apache-2.0
#include "core/formula.h"

#include <muParser.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "absl/status/status.h"
#include "core/formula_syntax.h"

namespace dlcs {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double Sign(double v) { return std::isnan(v) ? v : (v > 0) - (v < 0); }

// std::min and std::max drop a NaN, depending on its place; a formula without a value must not look like one
// with.
template <typename Better>
double Best(const double* values, int count) {
  double best = values[0];
  for (int i = 1; i < count; ++i) {
    if (std::isnan(values[i]) || Better{}(values[i], best)) best = values[i];
    if (std::isnan(best)) break;
  }
  return best;
}

bool Holds(double a, Comparison comparison, double b) {
  switch (comparison) {
    case Comparison::kLess:
      return a < b;
    case Comparison::kLessEqual:
      return a <= b;
    case Comparison::kGreater:
      return a > b;
    case Comparison::kGreaterEqual:
      return a >= b;
    case Comparison::kEqual:
      return a == b;
    case Comparison::kNotEqual:
      return a != b;
  }
  return false;
}

// a, comparison, b, comparison, c, ...: whether all hold.
double Chain(const double* values, int count) {
  bool holds = true;
  for (int i = 0; i + 2 < count; i += 2) {
    holds =
        holds && Holds(values[i], static_cast<Comparison>(static_cast<int>(values[i + 1])), values[i + 2]);
  }
  return holds;
}

using OneArgument = double (*)(double);
using ManyArguments = double (*)(const double*, int);

OneArgument FunctionOfOne(std::string_view name) {
  static constexpr std::pair<std::string_view, OneArgument> kTable[] = {
      {"sin", [](double v) { return std::sin(v); }},
      {"cos", [](double v) { return std::cos(v); }},
      {"tan", [](double v) { return std::tan(v); }},
      {"asin", [](double v) { return std::asin(v); }},
      {"acos", [](double v) { return std::acos(v); }},
      {"atan", [](double v) { return std::atan(v); }},
      {"sinh", [](double v) { return std::sinh(v); }},
      {"cosh", [](double v) { return std::cosh(v); }},
      {"tanh", [](double v) { return std::tanh(v); }},
      {"exp", [](double v) { return std::exp(v); }},
      {"log", [](double v) { return std::log(v); }},
      {"log10", [](double v) { return std::log10(v); }},
      {"sqrt", [](double v) { return std::sqrt(v); }},
      {"abs", [](double v) { return std::fabs(v); }},
      {"floor", [](double v) { return std::floor(v); }},
      {"ceil", [](double v) { return std::ceil(v); }},
      {"sign", Sign},
  };
  const auto entry =
      std::find_if(std::begin(kTable), std::end(kTable), [&](const auto& e) { return e.first == name; });
  return entry == std::end(kTable) ? nullptr : entry->second;
}

ManyArguments FunctionOfMany(std::string_view name) {
  if (name == "min") return Best<std::less<>>;
  if (name == "max") return Best<std::greater<>>;
  if (name == kChainFunction) return Chain;
  return nullptr;
}

// muParser with our functions instead of its own.
void DefineLanguage(mu::Parser& parser, double* t) {
  // The optimizer reorders sums and products, (t + 1e16) - 1e16 to t, which Python does not; it saves 5 ns.
  parser.EnableOptimizer(false);
  parser.ClearFun();
  parser.ClearConst();
  for (const FormulaName& function : kFormulaFunctions) {
    const std::string name(function.name);
    if (function.takes_many) {
      parser.DefineFun(name, FunctionOfMany(name));
    } else {
      parser.DefineFun(name, FunctionOfOne(name));
    }
  }
  parser.DefineFun(std::string(kChainFunction), FunctionOfMany(kChainFunction));
  parser.DefineVar("t", t);
}

}  // namespace

struct Formula::Impl {
  double t = 0;
  bool depends_on_t = false;
  double constant = kNaN;  // the value where it does not depend on t
  mu::Parser parser;       // holds the address of `t`
};

absl::StatusOr<Formula> Formula::Parse(const std::string& text) {
  absl::StatusOr<FormulaSyntax> syntax = ReadFormula(text);
  if (!syntax.ok()) return syntax.status();
  auto impl = std::make_unique<Impl>();
  impl->depends_on_t = syntax->depends_on_t;
  try {
    DefineLanguage(impl->parser, &impl->t);
    impl->parser.SetExpr(syntax->muparser_text);
    impl->constant = impl->parser.Eval();  // muParser translates at the first evaluation
    if (impl->parser.GetNumResults() != 1)
      return absl::InternalError("muParser found several values in " + text);
  } catch (const mu::ParserError& error) {
    return absl::InternalError("muParser refused '" + syntax->muparser_text + "': " + error.GetMsg());
  }
  return Formula(std::move(impl));
}

Formula::Formula(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Formula::Formula(Formula&&) noexcept = default;
Formula& Formula::operator=(Formula&&) noexcept = default;
Formula::~Formula() = default;

bool Formula::DependsOnTime() const { return impl_->depends_on_t; }

double Formula::Evaluate(double t) {
  if (!impl_->depends_on_t) return impl_->constant;
  impl_->t = t;
  return impl_->parser.Eval();
}

}  // namespace dlcs
