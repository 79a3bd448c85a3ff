// SPDX-License-Identifier: Apache-2.0
// Heat in a body of any shape, whose surface touches a wall on one side only.

#ifndef DLCS_CORE_MODELS_HEAT_H_
#define DLCS_CORE_MODELS_HEAT_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/models/mesh.h"
#include "core/problem/problem.h"

namespace dlcs {

// u_t = c Δu + load(t) in the body, u(0) = 0; its surface is insulated, except that u = 0 on the groups `fixed`, and
//     0 <= u ⟂ ∂u/∂n >= 0    on the groups `contact`
// (Signorini): heat flows in there as far as it takes to keep u from falling below zero.
struct HeatModel {
  Mesh mesh;
  // Physical groups of the surface, by name or number; `contact` at least one.
  std::vector<std::string> contact = {}, fixed = {};
  double coefficient = 1;             // c > 0
  double horizon = 1;                 // T
  std::string load = "-sin(2*pi*t)";  // a formula in t
};

struct HeatProblem {
  Problem problem;
  std::vector<std::int64_t> nodes;  // of the states, by their numbers in the mesh
};

// Linear finite elements: E x' = -c K x + B y + load(t) ∫φ, with the mass matrix E, at the nodes that are not fixed. A
// pair for each node of `contact`: B has the share of the surface that belongs to it times c, N is one there, and y is
// the inward flux ∂u/∂n. M = 0. Errors: InvalidArgument, one line per broken rule.
absl::StatusOr<HeatProblem> MakeHeatProblem(const HeatModel& model);

}  // namespace dlcs

#endif  // DLCS_CORE_MODELS_HEAT_H_
