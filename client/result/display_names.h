// SPDX-License-Identifier: Apache-2.0
// The names of states and pairs in tables and headers.

#ifndef DLCS_CLIENT_RESULT_DISPLAY_NAMES_H_
#define DLCS_CLIENT_RESULT_DISPLAY_NAMES_H_

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace dlcs::client {

struct DisplayNames {
  std::vector<std::string> states;        // from the problem; empty if it has none
  std::vector<std::string> pairs;         // likewise
  std::vector<std::string> outputs = {};  // of the outputs in a trajectory

  // The name of component i, from 0, of x, y or w: vC or x2; D1 or y1; w(D1) or w1.
  std::string OfX(std::size_t i) const { return i < states.size() ? states[i] : "x" + std::to_string(i + 1); }
  std::string OfY(std::size_t i) const { return i < pairs.size() ? pairs[i] : "y" + std::to_string(i + 1); }
  std::string OfW(std::size_t i) const {
    return i < pairs.size() ? "w(" + pairs[i] + ")" : "w" + std::to_string(i + 1);
  }
};

// The heading of the column of the component `name` beside the columns `others`: with its kind in front, as in
// "output:t", if one of them has its name.
inline std::string ColumnName(const std::string& kind, const std::string& name,
                              std::initializer_list<std::string_view> others = {"t"}) {
  return std::ranges::find(others, name) == others.end() ? name : kind + ":" + name;
}

// The names in a message that has the fields state_names, pair_names and output_names, or in a problem.
template <typename Message>
DisplayNames NamesIn(const Message& message) {
  DisplayNames names{{message.state_names().begin(), message.state_names().end()},
                     {message.pair_names().begin(), message.pair_names().end()}};
  if constexpr (requires { message.output_names(); }) {
    names.outputs.assign(message.output_names().begin(), message.output_names().end());
  } else {
    const auto& all = message.outputs().names();
    names.outputs.assign(all.begin(), all.begin() + std::clamp(all.size() - message.outputs().hidden(), 0, all.size()));
  }
  return names;
}

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_RESULT_DISPLAY_NAMES_H_
