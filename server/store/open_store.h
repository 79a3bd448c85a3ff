// SPDX-License-Identifier: Apache-2.0
// What the address of a store means: a file, or a PostgreSQL database.

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

// Errors: INVALID_ARGUMENT for a PostgreSQL address that cannot be read, or not in one way only. The text does not
// repeat the address, which may hold a password. Touches nothing.
absl::Status CheckStoreAddress(const std::string& address);

// For logs and people: without password and parameters.
std::string DescribeStore(const std::string& address);

// `address` has passed the check. `timer`, which may be empty, is told of every operation. Never fails: see the stores.
std::unique_ptr<Store> OpenStore(const std::string& address, StoreTimer timer);

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_OPEN_STORE_H_
