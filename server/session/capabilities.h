// SPDX-License-Identifier: Apache-2.0
// What every program of this version can do, a server or the command line in its own process.

#ifndef DLCS_SERVER_SESSION_CAPABILITIES_H_
#define DLCS_SERVER_SESSION_CAPABILITIES_H_

#include "dlcs/v1/solver.pb.h"

namespace dlcs {

// The version and the methods. The limits are left at 0, which says that there are none.
v1::GetCapabilitiesResponse CommonCapabilities();

}  // namespace dlcs

#endif  // DLCS_SERVER_SESSION_CAPABILITIES_H_
