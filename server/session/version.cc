// SPDX-License-Identifier: Apache-2.0
#include "server/session/version.h"

namespace dlcs {

const BuildInfo kBuild = {DLCS_REVISION, DLCS_COMPILER, DLCS_BUILD_TYPE};

std::string BuildText() { return std::string(kBuild.revision) + ", " + kBuild.compiler + ", " + kBuild.type; }

}  // namespace dlcs
