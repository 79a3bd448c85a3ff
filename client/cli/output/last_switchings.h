// SPDX-License-Identifier: Apache-2.0
// Which pairs a solve ended at.

#ifndef DLCS_CLIENT_CLI_OUTPUT_LAST_SWITCHINGS_H_
#define DLCS_CLIENT_CLI_OUTPUT_LAST_SWITCHINGS_H_

#include <string>

#include "client/result/display_names.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// A sentence with the names of the pairs that switched last, for a solve that made no progress: those that switch again
// and again without a break point between, faster and faster or as often as before; or those of its last switching.
// Empty for others, and where the last switching times are not listed.
std::string AboutLastSwitchings(const v1::Summary& summary, const DisplayNames& names);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_CLI_OUTPUT_LAST_SWITCHINGS_H_
