// SPDX-License-Identifier: Apache-2.0
// When a solve ends.

#ifndef DLCS_PROTO_SHARED_KNOWN_END_H_
#define DLCS_PROTO_SHARED_KNOWN_END_H_

#include <optional>

#include "dlcs/v1/solver.pb.h"

namespace dlcs {

// The end of a solve of a problem with this horizon: its period where it has one. Absent for a period that is to be
// found, and for a horizon that is none.
inline std::optional<double> KnownEnd(const v1::SolveOptions& options, double horizon) {
  if (options.period() < 0) return std::nullopt;
  const double end = options.period() > 0 ? options.period() : horizon;
  return end > 0 ? std::optional(end) : std::nullopt;
}

}  // namespace dlcs

#endif  // DLCS_PROTO_SHARED_KNOWN_END_H_
