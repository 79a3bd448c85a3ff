// SPDX-License-Identifier: Apache-2.0
// Requests that name an uploaded problem instead of holding one.

#ifndef DLCS_SERVER_SESSION_PROBLEM_REFERENCE_H_
#define DLCS_SERVER_SESSION_PROBLEM_REFERENCE_H_

#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "dlcs/v1/problems.pb.h"
#include "dlcs/v1/solver.pb.h"

namespace dlcs {

// The problem that was uploaded under a name. Blocks. Errors: InvalidArgument where the text is no name; NotFound;
// those of a store. Empty where nothing can be uploaded.
using ProblemResolver = std::function<absl::StatusOr<v1::ProblemBody>(const std::string& name)>;

bool NamesProblem(const v1::SolveRequest& request);
bool NamesProblem(const v1::SolveEnsembleRequest& request);
bool NamesProblem(const v1::AnalyzeProblemRequest& request);

// The request with the problem that it names, and what it has in place of that one's. Errors: those of `find`;
// InvalidArgument where the request holds a problem besides, the problem is of the wrong kind, or `find` is empty.
absl::StatusOr<v1::SolveRequest> ResolveProblem(const v1::SolveRequest& request, const ProblemResolver& find);
absl::StatusOr<v1::SolveEnsembleRequest> ResolveProblem(const v1::SolveEnsembleRequest& request,
                                                        const ProblemResolver& find);
absl::StatusOr<v1::AnalyzeProblemRequest> ResolveProblem(const v1::AnalyzeProblemRequest& request,
                                                         const ProblemResolver& find);

}  // namespace dlcs

#endif  // DLCS_SERVER_SESSION_PROBLEM_REFERENCE_H_
