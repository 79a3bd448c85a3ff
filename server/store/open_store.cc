// SPDX-License-Identifier: Apache-2.0
#include "server/store/open_store.h"

#include <libpq-fe.h>

#include <utility>

#include "fmt/format.h"
#include "server/store/clock.h"
#include "server/store/postgres/postgres_job_store.h"
#include "server/store/sqlite/sqlite_job_store.h"

namespace dlcs::jobs {
namespace {

using Parameters = std::unique_ptr<PQconninfoOption, void (*)(PQconninfoOption*)>;

Parameters ParametersOf(const std::string& address) {
  char* error = nullptr;
  Parameters parameters(PQconninfoParse(address.c_str(), &error), PQconninfoFree);
  PQfreemem(error);  // it repeats parts of the address
  return parameters;
}

std::string ValueOf(const Parameters& parameters, std::string_view keyword) {
  for (const PQconninfoOption* option = parameters.get(); option->keyword != nullptr; ++option) {
    if (keyword == option->keyword && option->val != nullptr) return option->val;
  }
  return "";
}

}  // namespace

bool IsShared(std::string_view address) {
  return address.starts_with("postgresql://") || address.starts_with("postgres://");
}

absl::Status CheckStoreAddress(const std::string& address) {
  if (!IsShared(address)) return absl::OkStatus();
  // There must be no second @: libpq would mistake the rest of a password for a host or a database, and print it in
  // errors.
  const std::string_view place = std::string_view(address).substr(address.find("://") + 3);
  const std::size_t first = place.find_first_of("@/");
  const bool ambiguous = first != std::string_view::npos &&
                         place.substr(0, place.find('?', first)).find('@', first + 1) != std::string_view::npos;
  if (ambiguous || ParametersOf(address) == nullptr) {
    return absl::InvalidArgumentError(
        "not an address as postgresql://USER@HOST:PORT/NAME?KEY=VALUE; in a user name or a password write @ as %40, "
        "/ as %2F and % as %25");
  }
  return absl::OkStatus();
}

std::string DescribeStore(const std::string& address) {
  if (!IsShared(address)) return address;
  const Parameters parameters = ParametersOf(address);
  if (parameters == nullptr) return "postgresql://...";
  const auto part = [&](const char* before, const char* keyword) {
    const std::string value = ValueOf(parameters, keyword);
    return value.empty() ? "" : before + value;
  };
  const std::string user = ValueOf(parameters, "user");
  return fmt::format("postgresql://{}{}{}{}{}", user, user.empty() ? "" : "@", part("", "host"), part(":", "port"),
                     part("/", "dbname"));
}

std::unique_ptr<Store> OpenStore(const std::string& address, StoreTimer timer) {
  if (IsShared(address)) {
    return std::make_unique<PostgresJobStore>(PostgresDatabaseOptions{.address = address, .timer = std::move(timer)});
  }
  return std::make_unique<SqliteJobStore>(SqliteDatabaseOptions{.path = address, .timer = std::move(timer)},
                                          SystemClock());
}

}  // namespace dlcs::jobs
