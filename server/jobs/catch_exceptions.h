// SPDX-License-Identifier: Apache-2.0
// The one place where exceptions end.

#ifndef DLCS_SERVER_JOBS_CATCH_EXCEPTIONS_H_
#define DLCS_SERVER_JOBS_CATCH_EXCEPTIONS_H_

#include <exception>
#include <string>

#include "absl/status/status.h"
#include "spdlog/spdlog.h"

namespace dlcs {

// The result of `work`, an absl::StatusOr or absl::Status. What it throws (memory that ran out, a library's
// own) goes to the log under `id`; the caller of the service learns only that, since the details are not
// theirs to know.
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
