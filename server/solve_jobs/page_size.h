// SPDX-License-Identifier: Apache-2.0
// The page size of lists of jobs and of problems.

#ifndef DLCS_SERVER_SOLVE_JOBS_PAGE_SIZE_H_
#define DLCS_SERVER_SOLVE_JOBS_PAGE_SIZE_H_

#include "absl/status/statusor.h"

namespace dlcs {

// The page size for the requested `page_size`: 100 for 0, at most 1000. Errors: InvalidArgument naming page_size where
// it is negative.
absl::StatusOr<int> PageSize(int page_size);

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_PAGE_SIZE_H_
