// SPDX-License-Identifier: Apache-2.0
#include "core/formula.h"

#include <muParser.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <optional>
#include <string_view>
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

// Reads the number at the head of `text` for muParser. Its own reader copies the rest of the text into a
// stream at every token, quadratic in the length of the formula.
int ReadNumber(const char* text, int* position, double* value) {
  if (*text != '.' && (*text < '0' || *text > '9')) return 0;
  constexpr std::size_t kLongestNumber = 32;  // NumberText() writes at most 24 characters
  const auto [end, error] = std::from_chars(text, text + strnlen(text, kLongestNumber), *value);
  if (error != std::errc()) return 0;
  *position += static_cast<int>(end - text);
  return 1;
}

// muParser with our language instead of its own: the variables and the functions that `syntax` needs. (To
// define all of them costs more than the rest of the translation.)
class Parser final : public mu::ParserBase {
 public:
  // `variables` holds t, then the states and the constraints that occur in `syntax`.
  Parser(const FormulaSyntax& syntax, double* variables) {
    DefineNameChars("0123456789abcdefghijklmnopqrstuvwxyz");
    DefineOprtChars("+-*^/<>=!");
    DefineInfixOprtChars("-");
    DefineInfixOprt("-", [](double v) { return -v; });
    // The optimizer reorders sums and products, (t + 1e16) - 1e16 to t, which Python does not; it saves 5 ns.
    EnableOptimizer(false);
    AddValIdent(ReadNumber);
    for (const std::string_view function : syntax.functions) {
      if (const ManyArguments many = FunctionOfMany(function)) {
        DefineFun(std::string(function), many);
      } else {
        DefineFun(std::string(function), FunctionOfOne(function));
      }
    }
    DefineVar("t", variables++);
    for (const Index i : syntax.states) DefineVar("x" + std::to_string(i + 1), variables++);
    for (const Index i : syntax.constraints) DefineVar("y" + std::to_string(i + 1), variables++);
    SetExpr(syntax.muparser_text);
  }

 private:
  void InitCharSets() override {}
  void InitFun() override {}
  void InitConst() override {}
  void InitOprt() override {}
};

}  // namespace

struct Formula::Impl {
  std::vector<double> variables;  // t, then the states and the constraints that occur
  bool depends_on_t = false;
  std::vector<Index> states;
  std::vector<Index> constraints;
  double constant = kNaN;        // the value where there is no parser
  std::optional<Parser> parser;  // holds addresses in `variables`; only where the formula depends on one
};

absl::StatusOr<Formula> Formula::Parse(const std::string& text, FormulaVariables variables) {
  const absl::StatusOr<FormulaSyntax> syntax = ReadFormula(text, variables);
  if (!syntax.ok()) return syntax.status();
  auto impl = std::make_unique<Impl>();
  try {
    impl->depends_on_t = syntax->depends_on_t;
    impl->states = syntax->states;
    impl->constraints = syntax->constraints;
    impl->variables.assign(1 + impl->states.size() + impl->constraints.size(), 0);
    impl->parser.emplace(*syntax, impl->variables.data());
    impl->constant = impl->parser->Eval();  // muParser translates at the first evaluation
  } catch (const mu::ParserError& error) {
    return absl::InternalError("muParser refused '" + syntax->muparser_text + "': " + error.GetMsg());
  }
  if (!impl->depends_on_t && impl->variables.size() == 1) impl->parser.reset();
  return Formula(std::move(impl));
}

Formula::Formula(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Formula::Formula(Formula&&) noexcept = default;
Formula& Formula::operator=(Formula&&) noexcept = default;
Formula::~Formula() = default;

bool Formula::DependsOnTime() const { return impl_->depends_on_t; }
const std::vector<Index>& Formula::states() const { return impl_->states; }
const std::vector<Index>& Formula::constraints() const { return impl_->constraints; }

double Formula::Evaluate(double t) {
  if (!impl_->parser) return impl_->constant;
  impl_->variables[0] = t;
  return impl_->parser->Eval();
}

double Formula::Evaluate(double t, const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y) {
  if (!impl_->parser) return impl_->constant;
  double* variable = impl_->variables.data();
  *variable++ = t;
  for (const Index i : impl_->states) *variable++ = x[i];
  for (const Index i : impl_->constraints) *variable++ = y[i];
  return impl_->parser->Eval();
}

}  // namespace dlcs
