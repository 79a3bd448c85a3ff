// SPDX-License-Identifier: Apache-2.0
// Turns exceptions into a status.

#ifndef DLCS_SERVER_JOBS_CATCH_EXCEPTIONS_H_
#define DLCS_SERVER_JOBS_CATCH_EXCEPTIONS_H_

#include <exception>
#include <string>

#include "absl/status/status.h"
#include "spdlog/spdlog.h"

namespace dlcs {

// The result of `work`, an absl::StatusOr or absl::Status. If it throws (std::bad_alloc, an exception of a library),
// the details are logged under `id`, and the returned Internal error holds only `id`.
template <typename Work>
auto CatchExceptions(const std::string& id, Work&& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::exception& error) {
    spdlog::error("{}: exception: {}", id, error.what());
  } catch (...) {
    spdlog::error("{}: exception that is not a std::exception", id);
  }
  return absl::InternalError("The server failed on this request. Its log says more under " + id + ".");
}

}  // namespace dlcs

#endif  // DLCS_SERVER_JOBS_CATCH_EXCEPTIONS_H_
