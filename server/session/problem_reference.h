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

// Returns the uploaded problem with the given name. Blocks. Errors: InvalidArgument if the text is not a name;
// NotFound; those of the store. Empty if there are no uploads.
using ProblemResolver = std::function<absl::StatusOr<v1::ProblemBody>(const std::string& name)>;

bool NamesProblem(const v1::SolveRequest& request);
bool NamesProblem(const v1::SolveEnsembleRequest& request);
bool NamesProblem(const v1::AnalyzeProblemRequest& request);

// The request with the problem that it names, whose fields are replaced by those that the request overrides. Errors:
// those of `find`; InvalidArgument if the request also holds a problem, if the problem is of the wrong kind, or if
// `find` is empty.
absl::StatusOr<v1::SolveRequest> ResolveProblem(const v1::SolveRequest& request, const ProblemResolver& find);
absl::StatusOr<v1::SolveEnsembleRequest> ResolveProblem(const v1::SolveEnsembleRequest& request,
                                                        const ProblemResolver& find);
absl::StatusOr<v1::AnalyzeProblemRequest> ResolveProblem(const v1::AnalyzeProblemRequest& request,
                                                         const ProblemResolver& find);

}  // namespace dlcs

#endif  // DLCS_SERVER_SESSION_PROBLEM_REFERENCE_H_
