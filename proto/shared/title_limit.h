// SPDX-License-Identifier: Apache-2.0
// The longest title of a job or an uploaded problem.

#ifndef DLCS_PROTO_SHARED_TITLE_LIMIT_H_
#define DLCS_PROTO_SHARED_TITLE_LIMIT_H_

#include <cstddef>

namespace dlcs {

// As in the comments of SolveRequest.title, CreateSolveJobRequest.title and ProblemBody.title.
inline constexpr std::size_t kMaxTitleBytes = 256;

}  // namespace dlcs

#endif  // DLCS_PROTO_SHARED_TITLE_LIMIT_H_
