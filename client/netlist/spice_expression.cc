// SPDX-License-Identifier: Apache-2.0
#include "client/netlist/spice_expression.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <set>
#include <utility>

#include "client/netlist/deck_lines.h"
#include "client/netlist/spice_functions.h"
#include "client/netlist/spice_number.h"

namespace dlcs::client {
namespace {

constexpr int kMaxLevels = 64;
constexpr double kRounding = 1e-14;

// Letters of functions of the user that one expression reads, and that all of a deck read, there with the terms of long
// sums that are multiplied: some tenths of a second.
constexpr std::size_t kMaxWork = 100'000;
constexpr std::size_t kMaxWorkOfDeck = 2'000'000;

}  // namespace

// Reads and evaluates at once.
class ExpressionReader {
 public:
  using Bindings = std::map<std::string, LinearValue>;

  ExpressionReader(std::string_view text, ParameterScope& scope, const Bindings& bindings, const PiecewiseMaker* maker,
                   const QuantityKnower* knower, int depth, std::size_t& work)
      : text_(text), scope_(scope), bindings_(bindings), maker_(maker), knower_(knower), depth_(depth), work_(work) {}

  absl::StatusOr<LinearValue> Read() {
    if (depth_ > kMaxLevels)
      return absl::InvalidArgumentError(fmt::format("is nested deeper than {} levels", kMaxLevels));
    LinearValue value = Choice();
    if (error_.ok() && Peek() != '\0') Fail(fmt::format("\"{}\" is not expected here", Rest()));
    if (!error_.ok()) return error_;
    return value;
  }

 private:
  char Peek() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) ++at_;
    return at_ < text_.size() ? text_[at_] : '\0';
  }
  bool Take(std::string_view sign) {
    Peek();
    if (!text_.substr(at_).starts_with(sign)) return false;
    at_ += sign.size();
    return true;
  }
  std::string Rest() const { return std::string(text_.substr(at_, 12)); }

  LinearValue Fail(const std::string& what) {
    if (error_.ok())
      error_ = absl::InvalidArgumentError(fmt::format("at column {} of \"{}\": {}", at_ + 1, text_, what));
    at_ = text_.size();
    return {};
  }
  double Constant(const LinearValue& given, const char* where) {
    const LinearValue value = WithConstants(given);
    if (!value.factors.empty()) FailNotLinear(value, where);
    if (!value.of_time.empty()) Fail(fmt::format("{} a function of time is not supported here", where));
    return value.constant;
  }

  std::optional<KnownQuantity> Known(const std::string& quantity) const {
    return knower_ != nullptr && *knower_ ? (*knower_)(quantity) : std::nullopt;
  }
  // With quantities that are constant as numbers. Not where a linear function will do: as controls they show in the
  // circuit.
  LinearValue WithConstants(LinearValue value) {
    if (!CountTerms(value)) return {};
    std::erase_if(value.factors, [&](const auto& factor) {
      const auto known = Known(factor.first);
      if (!known || !known->constant) return false;
      value.constant += factor.second * *known->constant;
      return true;
    });
    return value;
  }
  LinearValue FailNotLinear(const LinearValue& value, const char* where) {
    for (const auto& [quantity, factor] : value.factors) {
      if (!Known(quantity)) continue;
      return Fail(
          fmt::format("{} {}: sources alone determine it, but it changes with time, and the matrices are constant; "
                      "voltages of DC sources are allowed here",
                      where, quantity));
    }
    return Fail(fmt::format("{} a voltage or current is not linear", where));
  }

  // What is done with sums that are longer than anybody writes counts as work of the deck.
  bool CountTerms(const LinearValue& value) {
    constexpr std::size_t kMaxTerms = 64;
    if (value.factors.size() <= kMaxTerms || scope_.Count(value.factors.size())) return true;
    Fail("too much is done with long sums");
    return false;
  }

  // A function of time, as a formula in the language of the engine.
  LinearValue OfTime(std::string text) { return Short({.of_time = std::move(text)}); }
  // Functions and sums write their arguments at least once: the text may double with every call of a function.
  LinearValue Short(LinearValue value) {
    constexpr std::size_t kMaxText = 20000;
    if (value.of_time.size() > kMaxText) return Fail("the function of time is too long");
    return value;
  }

  LinearValue Choice() { return Settled(OpenChoice()); }
  // It may be a comparison that is no quantity yet.
  LinearValue OpenChoice() {
    if (++nesting_ > kMaxLevels) return Fail(fmt::format("nested deeper than {} levels", kMaxLevels));
    LinearValue value = Or();
    if (Take("?")) {
      const LinearValue yes = Choice();
      if (!Take(":")) return Fail("\":\" of a choice is missing");
      value = Chosen(value, yes, Choice());
    }
    --nesting_;
    return value;
  }
  LinearValue Or() {
    LinearValue value = And();
    while (Take("||")) {
      const LinearValue left = Truth(value, "|| of");
      value = Step(Minus(Sum(left, Truth(And(), "|| of")), {0.5}));
    }
    return value;
  }
  LinearValue And() {
    LinearValue value = Comparison();
    while (Take("&&")) {
      const LinearValue left = Truth(value, "&& of");
      value = Step(Minus(Sum(left, Truth(Comparison(), "&& of")), {1.5}));
    }
    return value;
  }

  // 0 or 1.
  LinearValue Truth(const LinearValue& value, const char* where) {
    if (value.is_truth) return Settled(value);
    if (IsOfTime(value)) return OfTime("(" + TextOf(value) + " != 0)");
    return {Constant(value, where) != 0 ? 1.0 : 0.0};
  }
  LinearValue Settled(LinearValue value) {
    if (value.compared) return Step(*value.compared);
    return value;
  }
  LinearValue Chosen(LinearValue condition, LinearValue yes, LinearValue no) {
    if (!condition.is_truth) condition = WithConstants(std::move(condition));
    if (IsOfTime(condition)) {
      if (yes.factors != no.factors) {
        yes = WithConstants(std::move(yes));
        no = WithConstants(std::move(no));
      }
      if (yes.factors != no.factors) return Fail("a choice by time between voltages or currents is not linear");
      LinearValue value =
          OfTime(fmt::format("({0} != 0)*{1} + ({0} == 0)*{2}", TextOf(condition),
                             TextOf({yes.constant, {}, yes.of_time}), TextOf({no.constant, {}, no.of_time})));
      value.factors = yes.factors;
      return value;
    }
    if (condition.factors.empty() && !condition.compared) return condition.constant != 0 ? yes : no;
    if (!condition.is_truth) return Fail("a choice by a voltage or current needs a comparison, as in V(a) > 1 ? 5 : 0");
    // yes - no = slope compared + jump, where both products with the condition are known: the first is a ramp, and
    // those with other truths are truths.
    LinearValue jump = Minus(yes, no);
    if (yes.of_time == no.of_time) jump.of_time.clear();
    double slope = 0;
    if (condition.compared) {
      // Of what changes, if anything does.
      const auto& factors = condition.compared->factors;
      const LinearValue changing = WithConstants(*condition.compared);
      const auto& [name, factor] = *(changing.factors.empty() ? factors : changing.factors).begin();
      const auto found = jump.factors.find(name);
      if (found != jump.factors.end() && factor != 0) slope = found->second / factor;
      if (slope != 0) jump = Sum(jump, *condition.compared, -slope);
    }
    jump = WithConstants(std::move(jump));
    if (!jump.of_time.empty()) return Fail("a choice by a voltage or current between functions of time is not linear");
    double size = std::abs(WithConstants(yes).constant) + std::abs(WithConstants(no).constant);
    if (slope != 0) size += std::abs(slope * WithConstants(*condition.compared).constant);
    LinearValue value = no;
    value.is_truth = false;
    for (const auto& [name, factor] : jump.factors) {
      const auto of = [&name = name](const LinearValue& choice) {
        const auto found = choice.factors.find(name);
        return found == choice.factors.end() ? 0 : std::abs(found->second);
      };
      if (std::abs(factor) <= kRounding * (of(yes) + of(no)) || truths_.contains(name)) continue;
      if (const auto part = WherePositive(condition, name)) {
        // In one function, for they often differ by no jump.
        value = Sum(value, Piecewise(*condition.compared, Combined(*part, factor, slope, jump.constant, size)));
        slope = jump.constant = 0;
        continue;
      }
      return Fail(
          "a choice by a voltage or current is supported between numbers, and between what differs by a multiple of "
          "what is compared; max, min and limit join functions");
    }
    if (slope != 0) value = Sum(value, Times(Ramp(*condition.compared), slope));
    const bool jumps = std::abs(jump.constant) > kRounding * size;
    const bool is_nested = std::any_of(jump.factors.begin(), jump.factors.end(),
                                       [this](const auto& factor) { return truths_.contains(factor.first); });
    if (!jumps && !is_nested) return value;
    const LinearValue truth = Settled(condition);
    if (jumps) value = Sum(value, Times(truth, jump.constant));
    for (const auto& [name, factor] : jump.factors) {
      if (!truths_.contains(name)) continue;
      value = Sum(value, Times(Step(Minus(Sum(truth, {0, {{name, 1}}}), {1.5})), factor));
    }
    return value;
  }

  // factor part(x) + slope x + jump for x > 0, and 0 for others. A jump that `size` makes rounding is none.
  static PiecewiseLinear Combined(PiecewiseLinear part, double factor, double slope, double jump, double size) {
    size += std::abs(factor * part.y[1]);
    for (std::size_t k = 1; k < part.x.size(); ++k) part.y[k] = factor * part.y[k] + slope * part.x[k] + jump;
    part.slope_after = factor * part.slope_after + slope;
    if (std::abs(part.y[1]) <= kRounding * size) {
      part.x.erase(part.x.begin());
      part.y.erase(part.y.begin() + 1);
    }
    return part;
  }
  // The quantity `name` times the comparison, if both are functions of the same value: as a function of what is
  // compared.
  std::optional<PiecewiseLinear> WherePositive(const LinearValue& condition, const std::string& name) const {
    const auto found = made_.find(name);
    if (found == made_.end() || !condition.compared) return std::nullopt;
    const LinearValue &argument = found->second.first, &compared = *condition.compared;
    const auto first = compared.factors.find(argument.factors.begin()->first);
    if (first == compared.factors.end() || first->second == 0) return std::nullopt;
    const double slope = argument.factors.begin()->second / first->second;
    const LinearValue rest = Sum(argument, compared, -slope);
    if (slope == 0 || !argument.of_time.empty() || !compared.of_time.empty()) return std::nullopt;
    for (const auto& [of, factor] : rest.factors) {
      const auto given = argument.factors.find(of);
      if (given == argument.factors.end() || std::abs(factor) > kRounding * std::abs(given->second))
        return std::nullopt;
    }
    return PartAboveZero(found->second.second, slope, rest.constant);
  }

  // function(argument), as a new quantity where the argument is none that is known.
  LinearValue Piecewise(const LinearValue& argument, const PiecewiseLinear& function) {
    if (IsOfTime(argument)) return OfTime(TextOf(function, TextOf(argument)));
    if (argument.factors.empty()) return {ValueAt(function, argument.constant)};
    if (!error_.ok() || maker_ == nullptr) return {};
    if (!*maker_) return Fail("only linear functions of voltages and currents are allowed here; define a B element");
    const std::string name = (*maker_)(argument, function);
    made_.emplace(name, std::pair(argument, function));
    return {0, {{name, 1}}};
  }
  // 1 where the argument is positive, else 0.
  LinearValue Step(const LinearValue& argument) {
    LinearValue value = Piecewise(argument, {.x = {0, 0}, .y = {0, 1}});
    value.is_truth = true;
    for (const auto& [name, factor] : value.factors) truths_.insert(name);
    return value;
  }
  LinearValue Ramp(const LinearValue& argument) { return Piecewise(argument, {.x = {0}, .y = {0}, .slope_after = 1}); }
  LinearValue Comparison() {
    LinearValue value = Terms();
    for (const char* sign : {"<=", ">=", "==", "!=", "<", ">"}) {
      if (!Take(sign)) continue;
      const std::string_view op = sign;
      value = Settled(value);
      const LinearValue right = Settled(Terms());
      if (!value.factors.empty() || !right.factors.empty()) {
        if (op == "==" || op == "!=") return Fail("whether voltages or currents are equal is not supported");
        LinearValue truth = {.is_truth = true};
        truth.compared = std::make_shared<const LinearValue>(op[0] == '<' ? Minus(right, value) : Minus(value, right));
        return truth.compared->factors.empty() ? Step(*truth.compared) : truth;
      }
      if (IsOfTime(value) || IsOfTime(right))
        return OfTime(fmt::format("({} {} {})", TextOf(value), sign, TextOf(right)));
      const double one = value.constant, other = right.constant;
      const bool holds = op == "<="   ? one <= other
                         : op == ">=" ? one >= other
                         : op == "==" ? one == other
                         : op == "!=" ? one != other
                         : op == "<"  ? one < other
                                      : one > other;
      return {holds ? 1.0 : 0.0};
    }
    return value;
  }
  LinearValue Terms() {
    LinearValue value = Product();
    for (;;) {
      const char sign = Peek();
      if (sign != '+' && sign != '-') return value;
      ++at_;
      const LinearValue next = Settled(Product());
      // Moved, since a sum may have thousands of terms.
      value = Short(Sum(Settled(std::move(value)), next, sign == '+' ? 1 : -1));
    }
  }
  LinearValue Product() {
    LinearValue value = Signed();
    for (;;) {
      const char sign = Peek();
      if (sign == '*' && text_.substr(at_).starts_with("**")) return value;
      if (sign != '*' && sign != '/') return value;
      ++at_;
      value = Settled(std::move(value));
      LinearValue other = Settled(Signed());
      if (!CountTerms(value) || !CountTerms(other)) return {};
      if (sign == '*' && !value.factors.empty() && !other.factors.empty()) {
        if (LinearValue number = WithConstants(value); number.factors.empty()) {
          value = std::move(number);
        } else if (number = WithConstants(other); number.factors.empty()) {
          other = std::move(number);
        } else {
          // Of both the one that sources determine, if one is, has the reason.
          const bool is_value = std::any_of(value.factors.begin(), value.factors.end(),
                                            [&](const auto& factor) { return Known(factor.first).has_value(); });
          return FailNotLinear(WithConstants(is_value ? value : other), "a product of voltages and currents:");
        }
      }
      if (sign == '/') other = WithConstants(std::move(other));
      if (value.factors.empty() && other.factors.empty() && (IsOfTime(value) || IsOfTime(other))) {
        value = OfTime(TextOf(value) + sign + TextOf(other));
      } else if (sign == '/') {
        value = Times(value, 1 / Constant(other, "division by"));
      } else if (other.factors.empty()) {
        value = Times(value, Constant(other, "a product of voltages and currents:"));
      } else {
        value = Times(other, Constant(value, "a product of voltages and currents:"));
      }
    }
  }
  LinearValue Signed() {
    if (++nesting_ > kMaxLevels) return Fail(fmt::format("nested deeper than {} levels", kMaxLevels));
    LinearValue value;
    if (Take("-")) {
      value = Times(Settled(Signed()), -1);
    } else if (Take("+")) {
      value = Settled(Signed());
    } else if (Peek() == '!' && !text_.substr(at_).starts_with("!=")) {
      ++at_;
      value = Minus({1}, Truth(Signed(), "! of"));
      value.is_truth = true;
    } else {
      value = Power();
    }
    --nesting_;
    return value;
  }
  LinearValue Power() {
    const bool is_exponent = std::exchange(is_exponent_, false);
    LinearValue value = Primary();
    if (Peek() == '^') {
      return Fail("^ is a power in ngspice and an exclusive or in LTspice; write ** for a power");
    }
    if (!Take("**")) return value;
    value = Settled(value);
    if (is_exponent) return Fail("powers of powers are not read in one order everywhere; write parentheses");
    is_exponent_ = true;
    const LinearValue raised = Settled(Signed());
    is_exponent_ = false;
    if (IsOfTime(value) || IsOfTime(raised)) {
      if (value.factors.empty() && raised.factors.empty()) return OfTime(TextOf(value) + "**" + TextOf(raised));
    }
    const double base = Constant(value, "a power of"), exponent = Constant(raised, "a power of");
    return {std::pow(base, exponent)};
  }

  LinearValue Primary() {
    const char first = Peek();
    if (first == '(' || first == '{') {
      ++at_;
      const LinearValue value = OpenChoice();
      const char* close = first == '(' ? ")" : "}";
      if (!Take(close)) return Fail(fmt::format("\"{}\" is missing", close));
      return value;
    }
    if (IsSpiceDigit(first) || first == '.') {
      const auto [value, length] = LeadingSpiceNumber(text_.substr(at_));
      if (length == 0) return Fail(fmt::format("\"{}\" is not a number", Rest()));
      at_ += length;
      return {value};
    }
    if (first == '\0') return Fail("ends too early");
    if (!IsSpiceLetter(first)) return Fail(fmt::format("\"{}\" is not expected here", Rest()));
    const std::size_t begin = at_;
    while (at_ < text_.size() && (IsSpiceLetter(text_[at_]) || IsSpiceDigit(text_[at_]) || text_[at_] == '.')) ++at_;
    const std::string name = Lower(text_.substr(begin, at_ - begin));
    if (Peek() == '(') return Call(name);
    return Named(name);
  }

  LinearValue Named(const std::string& name) {
    if (const auto found = bindings_.find(name); found != bindings_.end()) {
      return CountTerms(found->second) ? found->second : LinearValue{};
    }
    if (scope_.Where(name) != nullptr) {
      const auto value = scope_.ValueOf(name, depth_ + 1);
      if (!value.ok()) {
        if (error_.ok()) error_ = value.status();
        at_ = text_.size();
        return {};
      }
      return {*value};
    }
    if (name == "pi") return {std::numbers::pi};
    if (name == "e") return {std::numbers::e};
    if (name == "time") {
      if (maker_ != nullptr && *maker_) return OfTime("t");
      return Fail(
          "time is allowed in the expressions of B, E and G elements only, and not in their parameters; sources have "
          "SIN, PULSE, PWL, EXP and SFFM");
    }
    const std::string shown(text_.substr(at_ - name.size(), name.size()));
    at_ -= name.size();
    return Fail(fmt::format("\"{0}\" is not a parameter; define it with .param {0}=VALUE", shown));
  }

  // V(a), V(a,b) or I(name), as it is written.
  LinearValue Quantity(const std::string& kind) {
    const std::size_t close = text_.find(')', at_);
    if (close == std::string_view::npos) return Fail("\")\" is missing");
    std::string inside;
    for (const char letter : text_.substr(at_ + 1, close - at_ - 1)) {
      if (letter != ' ' && letter != '\t') inside += letter;
    }
    at_ = close + 1;
    return {0, {{kind + "(" + Lower(inside) + ")", 1}}};
  }

  LinearValue Call(const std::string& name) {
    ParameterScope* home = scope_.WhereFunction(name);
    if (home == nullptr && (name == "v" || name == "i")) {
      if (maker_ != nullptr) return Quantity(name);
      return Fail(fmt::format("{}(...) is allowed in B, E and G elements, .print and .meas only", name));
    }
    const std::size_t begin = at_;
    ++at_;
    std::vector<LinearValue> arguments;
    if (Peek() == ')') {
      ++at_;
    } else {
      for (;;) {
        arguments.push_back(name == "if" && arguments.empty() ? Or() : Choice());
        if (!error_.ok()) return {};
        if (Take(")")) break;
        if (!Take(",")) return Fail("\",\" or \")\" is missing");
      }
    }
    if (home != nullptr) return CallOwn(*home, name, arguments);
    const std::size_t end = std::exchange(at_, begin);
    const LinearValue value = CallBuiltIn(name, arguments);
    if (error_.ok()) at_ = end;
    return value;
  }

  LinearValue CallOwn(ParameterScope& home, const std::string& name, const std::vector<LinearValue>& arguments) {
    const ParameterScope::Function& function = home.functions_.at(name);
    if (arguments.size() != function.arguments.size()) {
      return Fail(fmt::format("{} takes {} arguments, not {}", name, function.arguments.size(), arguments.size()));
    }
    Bindings bound;
    for (std::size_t k = 0; k < arguments.size(); ++k) bound[function.arguments[k]] = arguments[k];
    work_ += function.body.size();
    if (!home.Count(function.body.size()) || work_ > kMaxWork) return Fail("calls too many functions");
    auto value = ExpressionReader(function.body, home, bound, maker_, knower_, depth_ + 1, work_).Read();
    if (value.ok()) return *value;
    if (error_.ok()) error_ = value.status();
    at_ = text_.size();
    return {};
  }

  LinearValue CallBuiltIn(const std::string& name, const std::vector<LinearValue>& arguments) {
    if (const auto value = CallPiecewise(name, arguments)) return *value;
    if (std::any_of(arguments.begin(), arguments.end(), IsOfTime)) {
      if (const auto text = FormulaOfCall(name, arguments)) return OfTime(*text);
    }
    const SpiceFunction* const function = FindSpiceFunction(name);
    if (name == "ddt" || name == "idt" || name == "sdt") {
      return Fail(
          fmt::format("{} is not supported; the current of a capacitor is a derivative, and its voltage an "
                      "integral",
                      name));
    }
    if (function == nullptr) return Fail(fmt::format("\"{}\" is not a function", name));
    if (arguments.size() < function->least || arguments.size() > function->most) {
      return Fail(fmt::format("{} takes {} argument{}, not {}", name, function->least, function->least == 1 ? "" : "s",
                              arguments.size()));
    }
    std::vector<double> values;
    for (const LinearValue& argument : arguments) values.push_back(Constant(argument, (name + " of").c_str()));
    const double value = function->of(values);
    if (error_.ok() && !std::isfinite(value)) return Fail(fmt::format("{} has no finite value here", name));
    return {value};
  }

  // Functions that are piecewise linear, where that is meant; empty for others.
  std::optional<LinearValue> CallPiecewise(const std::string& name, const std::vector<LinearValue>& arguments) {
    const std::size_t count = arguments.size();
    const bool has_quantity = std::any_of(arguments.begin(), arguments.end(),
                                          [](const LinearValue& argument) { return !argument.factors.empty(); });
    if (name == "table" || name == "pwl") return CallTable(name, arguments);
    if (count == 1 && (name == "u" || name == "stp")) return Step(arguments[0]);
    if (count == 1 && name == "uramp") return Ramp(arguments[0]);
    if (count == 3 && name == "if" && (arguments[0].is_truth || IsOfTime(arguments[0]))) {
      return Chosen(arguments[0], arguments[1], arguments[2]);
    }
    if (!has_quantity) return std::nullopt;
    if (count == 1 && name == "sgn") return Piecewise(arguments[0], {.x = {0, 0}, .y = {-1, 1}});
    if (count == 1 && name == "abs") {
      return Piecewise(arguments[0], {.x = {0}, .y = {0}, .slope_before = -1, .slope_after = 1});
    }
    if (count == 3 && name == "if") return Chosen(arguments[0], arguments[1], arguments[2]);
    if (count == 3 && name == "limit") return Middle(arguments);
    if (count == 0 || (name != "max" && name != "min")) return std::nullopt;
    LinearValue value = arguments[0];
    for (std::size_t k = 1; k < count; ++k) {
      value = name == "max" ? Larger(value, arguments[k]) : Smaller(value, arguments[k]);
    }
    return value;
  }
  // max(a, b) = b + max(0, a - b), min(a, b) = a - max(0, a - b)
  LinearValue Larger(const LinearValue& one, const LinearValue& other) { return Sum(other, Ramp(Minus(one, other))); }
  LinearValue Smaller(const LinearValue& one, const LinearValue& other) { return Minus(one, Ramp(Minus(one, other))); }
  // The middle one of three values, in whatever order they are.
  LinearValue Middle(std::vector<LinearValue> values) {
    const auto is_number = [](const LinearValue& value) { return value.factors.empty() && value.of_time.empty(); };
    std::stable_partition(values.begin(), values.end(), [&](const LinearValue& value) { return !is_number(value); });
    if (!is_number(values[1])) {
      return Larger(Smaller(values[1], values[2]), Smaller(values[0], Larger(values[1], values[2])));
    }
    const auto [low, high] = std::minmax(values[1].constant, values[2].constant);
    if (low == high) return {low};
    return Piecewise(values[0], {.x = {low, high}, .y = {low, high}});
  }

  // Lines through points: beyond the ends constant for `table`, straight on for `pwl`, as LTspice and ngspice have it.
  LinearValue CallTable(const std::string& name, const std::vector<LinearValue>& arguments) {
    if (arguments.size() < 3 || arguments.size() % 2 != 1) {
      return Fail(fmt::format("{} takes a value and then pairs of numbers", name));
    }
    PiecewiseLinear function;
    for (std::size_t k = 1; k < arguments.size(); k += 2) {
      function.x.push_back(Constant(arguments[k], "a point of"));
      function.y.push_back(Constant(arguments[k + 1], "a point of"));
    }
    if (!std::is_sorted(function.x.begin(), function.x.end())) return Fail("the points must be in increasing order");
    const std::size_t last = function.x.size() - 1;
    if (name == "pwl" && last > 0) {
      const auto slope = [&](std::size_t k) {
        return (function.y[k + 1] - function.y[k]) / (function.x[k + 1] - function.x[k]);
      };
      function.slope_before = slope(0);
      function.slope_after = slope(last - 1);
      if (!std::isfinite(function.slope_before) || !std::isfinite(function.slope_after)) {
        return Fail("pwl must not begin or end with a jump");
      }
    }
    return Piecewise(arguments[0], function);
  }

  const std::string_view text_;
  ParameterScope& scope_;
  const Bindings& bindings_;
  const PiecewiseMaker* maker_;   // null if voltages and currents are not allowed
  const QuantityKnower* knower_;  // likewise
  const int depth_;
  std::size_t& work_;
  std::size_t at_ = 0;
  int nesting_ = 0;
  bool is_exponent_ = false;
  std::set<std::string> truths_;                                         // quantities that are 0 or 1
  std::map<std::string, std::pair<LinearValue, PiecewiseLinear>> made_;  // quantities: arguments and functions
  absl::Status error_;
};

bool ParameterScope::Define(const std::string& name, std::string expression) {
  return values_.try_emplace(name, Parameter{std::move(expression), std::nullopt, false}).second;
}

bool ParameterScope::DefineValue(const std::string& name, double value) {
  return values_.try_emplace(name, Parameter{"", value, false}).second;
}

bool ParameterScope::DefineFunction(const std::string& name, std::vector<std::string> arguments, std::string body) {
  return functions_.try_emplace(name, Function{std::move(arguments), std::move(body)}).second;
}

bool ParameterScope::Count(std::size_t letters) {
  ParameterScope* outermost = this;
  while (outermost->around_ != nullptr) outermost = outermost->around_;
  outermost->work_ += letters;
  return outermost->work_ <= kMaxWorkOfDeck;
}

ParameterScope* ParameterScope::Where(const std::string& name) {
  for (ParameterScope* scope = this; scope != nullptr; scope = scope->around_) {
    if (scope->values_.contains(name)) return scope;
  }
  return nullptr;
}

ParameterScope* ParameterScope::WhereFunction(const std::string& name) {
  for (ParameterScope* scope = this; scope != nullptr; scope = scope->around_) {
    if (scope->functions_.contains(name)) return scope;
  }
  return nullptr;
}

absl::StatusOr<double> ParameterScope::ValueOf(const std::string& name, int depth) {
  ParameterScope* home = Where(name);
  Parameter& parameter = home->values_.at(name);
  if (parameter.value) return *parameter.value;
  if (parameter.is_open) {
    return absl::InvalidArgumentError(fmt::format("parameter {} is defined by itself", name));
  }
  parameter.is_open = true;
  const ExpressionReader::Bindings none;
  std::size_t work = 0;
  const auto value = ExpressionReader(parameter.expression, *home, none, nullptr, nullptr, depth, work).Read();
  parameter.is_open = false;
  if (!value.ok()) {
    return absl::InvalidArgumentError(fmt::format("parameter {}: {}", name, std::string(value.status().message())));
  }
  if (!std::isfinite(value->constant)) {
    return absl::InvalidArgumentError(fmt::format("parameter {} = {} is not finite", name, parameter.expression));
  }
  parameter.value = value->constant;
  return value->constant;
}

absl::StatusOr<LinearValue> ParameterScope::EvaluateLinear(std::string_view expression, const PiecewiseMaker& maker,
                                                           const QuantityKnower& knower) {
  const ExpressionReader::Bindings none;
  std::size_t work = 0;
  auto value = ExpressionReader(expression, *this, none, &maker, &knower, 0, work).Read();
  if (!value.ok()) return value.status();
  bool finite = std::isfinite(value->constant);
  for (const auto& [name, factor] : value->factors) finite = finite && std::isfinite(factor);
  if (!finite) return absl::InvalidArgumentError(fmt::format("\"{}\" is not finite", expression));
  return value;
}

absl::StatusOr<double> ParameterScope::Evaluate(std::string_view expression) {
  const ExpressionReader::Bindings none;
  std::size_t work = 0;
  const auto value = ExpressionReader(expression, *this, none, nullptr, nullptr, 0, work).Read();
  if (!value.ok()) return value.status();
  if (!std::isfinite(value->constant)) {
    return absl::InvalidArgumentError(fmt::format("\"{}\" is not finite", expression));
  }
  return value->constant;
}

}  // namespace dlcs::client
