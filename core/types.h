// SPDX-License-Identifier: Apache-2.0
// The types that every layer of the engine uses.

#ifndef DLCS_CORE_TYPES_H_
#define DLCS_CORE_TYPES_H_

#include <Eigen/Core>
#include <string>

namespace dlcs {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using Index = Eigen::Index;

// One rule of the input that was broken: `field` as the caller knows it, with an index if there is one ("M[2][0]",
// "f[1]", "horizon"), and `description` with the value and the rule.
struct Violation {
  std::string field;
  std::string description;
};

}  // namespace dlcs

#endif  // DLCS_CORE_TYPES_H_
