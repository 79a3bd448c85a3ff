// SPDX-License-Identifier: Apache-2.0
// Names that a problem gives to its states and pairs: validation, and use in formulas and messages.

#ifndef DLCS_SERVER_WIRE_COMPONENT_NAMES_H_
#define DLCS_SERVER_WIRE_COMPONENT_NAMES_H_

#include <algorithm>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/problem/solution.h"
#include "core/types.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs {

// The named numbers in the formulas of a problem.
using FormulaParameters = std::map<std::string, double, std::less<>>;

struct ComponentNames {
  std::vector<std::string> states;        // of all, or none
  std::vector<std::string> pairs;         // likewise
  std::vector<std::string> outputs = {};  // of those that are not hidden

  bool empty() const { return states.empty() && pairs.empty(); }
};

// For the v1::Problem or v1::NonlinearProblem that has them.
template <typename System>
ComponentNames NamesOf(const System& system) {
  ComponentNames names{{system.state_names().begin(), system.state_names().end()},
                       {system.pair_names().begin(), system.pair_names().end()}};
  if constexpr (requires { system.outputs(); }) {
    const auto& all = system.outputs().names();
    const int shown = std::clamp(all.size() - system.outputs().hidden(), 0, all.size());
    names.outputs.assign(all.begin(), all.begin() + shown);
  }
  return names;
}
// Sets the fields state_names and pair_names of `message`, and output_names if it has them.
template <typename Message>
void SetNames(const ComponentNames& names, Message& message) {
  message.mutable_state_names()->Add(names.states.begin(), names.states.end());
  message.mutable_pair_names()->Add(names.pairs.begin(), names.pairs.end());
  if constexpr (requires { message.mutable_output_names(); }) {
    message.mutable_output_names()->Add(names.outputs.begin(), names.outputs.end());
  }
}

// The parameters by their names. Appends to `violations`, as parameters.NAME, invalid and duplicate names, and values
// that are not finite.
FormulaParameters ParametersFromProto(const google::protobuf::RepeatedPtrField<v1::Parameter>& parameters,
                                      const std::string& field, std::vector<Violation>& violations);

// Replaces the values of the parameters named in `changes`; an unknown name is a violation, field.NAME.
void ChangeParameters(const google::protobuf::RepeatedPtrField<v1::Parameter>& changes, const std::string& field,
                      FormulaParameters& parameters, std::vector<Violation>& violations);

// Checks the names of a problem with m states and n pairs. Appends to `violations`, as states[1] and pairs[0]: a wrong
// number of names, names that formulas reserve, and duplicates.
void CheckNames(const ComponentNames& names, const FormulaParameters& parameters, Index m, Index n,
                std::vector<Violation>& violations);

// Formulas as the engine reads them.
class NamesInFormulas {
 public:
  NamesInFormulas(const ComponentNames& names, const FormulaParameters& parameters);

  // `formula` with names replaced: x2 for the name of the second state, y1 for that of the first pair, values for
  // parameters. A shorter replacement is padded with blanks, so that positions in messages stay correct if possible.
  std::string InNumbers(const std::string& formula) const;

 private:
  std::map<std::string, std::string, std::less<>> numbers_;
};

// `text` with a name added to each index in it: x[1] (vC), x0[1] (vC), f[1] (vC), and y[0] (D1), g[0] (D1), (N x +
// g)[0] (D1), w[0] (D1). Cost: the length of `text`.
std::string WithNames(const std::string& text, const ComponentNames& names);
// The same in the fields of violations: of matrices the names of row and column, A[1][0] (vC, iL).
void AddNames(const ComponentNames& names, std::vector<Violation>& violations);
// The same in message and warnings of a solution, and the names of the components that its accuracy lists.
void AddNames(const ComponentNames& names, Solution& solution);

// "vC", "D1", "w(D1)", "v(out)"; without names x1, y1, w1.
std::string DisplayName(const Component& component, const ComponentNames& names);
// The component of a system with m states and n pairs that has this display name, or x1, y1, w1; absent where there is
// none.
std::optional<Component> ComponentNamed(const std::string& name, const ComponentNames& names, Index m, Index n);
// Why there is none: "\"vc\"; is no state, pair or output of the problem, which has vC, iL and 3 more; did you mean
// vC?"
std::string NoComponentNamed(const std::string& name, const ComponentNames& names, Index m, Index n);

}  // namespace dlcs

#endif  // DLCS_SERVER_WIRE_COMPONENT_NAMES_H_
