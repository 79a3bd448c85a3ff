// SPDX-License-Identifier: Apache-2.0
// Whether there can be a store of jobs at a place, found out without touching it.

#ifndef DLCS_SERVER_STORE_STORE_LOCATION_H_
#define DLCS_SERVER_STORE_STORE_LOCATION_H_

#include <string>

#include "absl/status/status.h"

namespace dlcs {

// `store` as in ServerConfig. A file must be one that this user may read and write, or its folder must be there and let
// one be made; nothing is opened, made or locked. The address of a database is taken as it is. Errors: InvalidArgument
// naming --store, the path and the rule.
absl::Status CheckStoreLocation(const std::string& store);

}  // namespace dlcs

#endif  // DLCS_SERVER_STORE_STORE_LOCATION_H_
