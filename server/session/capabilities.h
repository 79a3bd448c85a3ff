// SPDX-License-Identifier: Apache-2.0
// The capabilities of every program of this version, a server or the command line.

#ifndef DLCS_SERVER_SESSION_CAPABILITIES_H_
#define DLCS_SERVER_SESSION_CAPABILITIES_H_

#include "dlcs/v1/solver.pb.h"

namespace dlcs {

// The version and the methods. The limits are 0, which means that there are none.
v1::GetCapabilitiesResponse CommonCapabilities();

}  // namespace dlcs

#endif  // DLCS_SERVER_SESSION_CAPABILITIES_H_
