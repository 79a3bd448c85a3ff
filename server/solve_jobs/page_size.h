// SPDX-License-Identifier: Apache-2.0
// How long the pages of lists are, of jobs as of problems.

#ifndef DLCS_SERVER_SOLVE_JOBS_PAGE_SIZE_H_
#define DLCS_SERVER_SOLVE_JOBS_PAGE_SIZE_H_

#include "absl/status/statusor.h"

namespace dlcs {

// What a list gives where `page_size` is asked for: 100 for 0, at most 1000. Errors: InvalidArgument naming page_size
// where it is negative.
absl::StatusOr<int> PageSize(int page_size);

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_PAGE_SIZE_H_
