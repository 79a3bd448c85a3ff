// SPDX-License-Identifier: Apache-2.0
// Opens a store by its address: a file, or a PostgreSQL database.

#ifndef DLCS_SERVER_STORE_OPEN_STORE_H_
#define DLCS_SERVER_STORE_OPEN_STORE_H_

#include <memory>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "server/store/store.h"
#include "server/store/store_timer.h"

namespace dlcs::jobs {

// Whether several servers may share the store: postgresql://... or postgres://..., as libpq takes it. Everything else
// is the path of an SQLite file.
bool IsShared(std::string_view address);

// Checks the form of the address only. Errors: INVALID_ARGUMENT for a PostgreSQL address that is invalid or ambiguous.
// The message does not repeat the address, which may contain a password.
absl::Status CheckStoreAddress(const std::string& address);

// The address for logs: without password and parameters.
std::string DescribeStore(const std::string& address);

// `address` has passed the check. `timer`, which may be empty, is called for every operation. Never fails: a store that
// cannot be opened is unhealthy.
std::unique_ptr<Store> OpenStore(const std::string& address, StoreTimer timer);

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_OPEN_STORE_H_
