// SPDX-License-Identifier: Apache-2.0
// Checks whether a job store can be opened at a location, without changing anything there.

#ifndef DLCS_SERVER_STORE_STORE_LOCATION_H_
#define DLCS_SERVER_STORE_STORE_LOCATION_H_

#include <string>

#include "absl/status/status.h"

namespace dlcs {

// `store` as in ServerConfig. A file must be readable and writable for this user, and empty or an SQLite database; if
// it does not exist, its folder must exist and be writable. Nothing is created, changed or locked. The address of a
// database is not checked. Errors: InvalidArgument naming --store, the path and the rule.
absl::Status CheckStoreLocation(const std::string& store);

}  // namespace dlcs

#endif  // DLCS_SERVER_STORE_STORE_LOCATION_H_
