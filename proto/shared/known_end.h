// SPDX-License-Identifier: Apache-2.0
// When a solve ends.

#ifndef DLCS_PROTO_SHARED_KNOWN_END_H_
#define DLCS_PROTO_SHARED_KNOWN_END_H_

#include <optional>

#include "dlcs/v1/solver.pb.h"

namespace dlcs {

// The end time of a solve: the period if one is given, otherwise the horizon. Absent if the period is to be found, or
// the horizon is invalid.
inline std::optional<double> KnownEnd(const v1::SolveOptions& options, double horizon) {
  if (options.period() < 0) return std::nullopt;
  const double end = options.period() > 0 ? options.period() : horizon;
  return end > 0 ? std::optional(end) : std::nullopt;
}

}  // namespace dlcs

#endif  // DLCS_PROTO_SHARED_KNOWN_END_H_
