// SPDX-License-Identifier: Apache-2.0
// Expressions of SPICE decks.
//
// The formulas of the engine (core/problem/formula.h) have neither suffixes nor functions of the user, and here a value
// may be a linear function of voltages and currents; so this is a small grammar of its own:
//
//     choice     := or ("?" choice ":" choice)?
//     or         := and ("||" and)*          and := comparison ("&&" comparison)*
//     comparison := sum (("<" | "<=" | ">" | ">=" | "==" | "!=") sum)?
//     sum        := product (("+" | "-") product)*
//     product    := signed (("*" | "/") signed)*
//     signed     := ("+" | "-" | "!")* power
//     power      := primary ("**" signed)?
//     primary    := number | name | function "(" choice ("," choice)* ")" | "(" choice ")" | "{" choice "}"

#ifndef DLCS_CLIENT_NETLIST_SPICE_EXPRESSION_H_
#define DLCS_CLIENT_NETLIST_SPICE_EXPRESSION_H_

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/netlist/known_voltages.h"
#include "client/netlist/linear_value.h"
#include "core/circuits/circuit.h"

namespace dlcs::client {

// Makes a quantity that is `function` of `argument`, and returns its name.
using PiecewiseMaker = std::function<std::string(const LinearValue& argument, const PiecewiseLinear& function)>;

// What is known of a quantity as EvaluateLinear() names it; absent if sources alone do not determine it.
using QuantityKnower = std::function<std::optional<KnownQuantity>(const std::string& quantity)>;

// The parameters and functions that a part of a deck sees: its own, and those of the parts around it. Names are in
// small letters.
class ParameterScope {
 public:
  // `around` must outlive it; null for the outermost.
  explicit ParameterScope(ParameterScope* around = nullptr) : around_(around) {}

  // The value of a parameter is computed when it is needed, so that the order of definitions does not matter. Returns
  // whether the name is new here.
  bool Define(const std::string& name, std::string expression);
  bool DefineValue(const std::string& name, double value);
  bool DefineFunction(const std::string& name, std::vector<std::string> arguments, std::string body);
  bool Has(const std::string& name) const { return values_.contains(name); }

  // The value of `expression`. Errors: InvalidArgument with the column in it and the reason: a name that is not
  // defined, or by itself; a value that is not finite; more than 64 levels.
  absl::StatusOr<double> Evaluate(std::string_view expression);
  // The same where voltages V(a), V(a,b) and currents I(name) may occur: linearly; in the piecewise linear functions
  // max, min, abs, limit, table, pwl, uramp, u, stp, sgn; in comparisons, and in choices by them between what differs
  // by a number, or by a multiple of what is compared. Such functions become quantities by `maker`; without one they
  // are refused. With a maker `time` is allowed too, in all functions where no voltage or current is. Quantities that
  // are constant by `knower` are numbers where only numbers are allowed, as one factor of a product is.
  absl::StatusOr<LinearValue> EvaluateLinear(std::string_view expression, const PiecewiseMaker& maker = {},
                                             const QuantityKnower& knower = {});

 private:
  friend class ExpressionReader;
  struct Parameter {
    std::string expression;
    std::optional<double> value;
    bool is_open = false;  // it is being computed
  };
  struct Function {
    std::vector<std::string> arguments;
    std::string body;
  };

  // Adds to the letters of functions, and terms of long sums, that the whole deck has read. Returns whether these are
  // still not too many.
  bool Count(std::size_t letters);
  absl::StatusOr<double> ValueOf(const std::string& name, int depth);
  ParameterScope* Where(const std::string& name);
  ParameterScope* WhereFunction(const std::string& name);

  ParameterScope* around_;
  std::map<std::string, Parameter> values_;
  std::map<std::string, Function> functions_;
  std::size_t work_ = 0;  // of the outermost: the letters and terms that all expressions have read
};

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_NETLIST_SPICE_EXPRESSION_H_
