// SPDX-License-Identifier: Apache-2.0
// The ranges of the numbers in SolveOptions, as the engine of this program has them.

#ifndef DLCS_CLIENT_LOCAL_OPTION_RANGE_H_
#define DLCS_CLIENT_LOCAL_OPTION_RANGE_H_

#include <string_view>

namespace dlcs::client {

// Both ends are included. For some fields a 0 outside of the range means the default.
struct SolveOptionRange {
  const char* words;  // "between 1 and 64"
  double least, most;
};

// The range of the field at the path `field`, "contour.nodes", which must have one. Threads: any.
SolveOptionRange RangeOf(std::string_view field);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_LOCAL_OPTION_RANGE_H_
