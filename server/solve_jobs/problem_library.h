// SPDX-License-Identifier: Apache-2.0
// The uploaded problems of a server, as wire messages.

#ifndef DLCS_SERVER_SOLVE_JOBS_PROBLEM_LIBRARY_H_
#define DLCS_SERVER_SOLVE_JOBS_PROBLEM_LIBRARY_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "dlcs/v1/problems.pb.h"
#include "server/session/problem_reference.h"
#include "server/session/request_check.h"
#include "server/store/problem_store.h"

namespace dlcs {

struct UploadLimits {
  std::int64_t max_upload_bytes = std::int64_t{256} << 20;
  jobs::ProblemQuota quota;
  jobs::Duration keep_unused = std::chrono::hours(24 * 7);
};

// Safe from any thread; its functions block on the store.
class ProblemLibrary {
 public:
  // `store` must outlive it. `session` holds the limits of every problem.
  ProblemLibrary(jobs::ProblemStore& store, const UploadLimits& limits, const SessionLimits& session)
      : store_(store), limits_(limits), session_(session) {}

  // Looks up problems of `owner`. Must not outlive this object.
  ProblemResolver Of(std::string owner) const;

  // Call it before an upload of `bytes`: checks the limits, and returns the problem if it is stored already. Errors:
  // NotFound if it has to be uploaded; ResourceExhausted naming the limit.
  absl::StatusOr<v1::StoredProblem> Expect(const std::string& owner, const jobs::ProblemId& id,
                                           std::int64_t bytes) const;
  // Errors: InvalidArgument with every violation where `body` is no ProblemBody or its problem breaks a rule;
  // ResourceExhausted naming the limit.
  absl::StatusOr<v1::UploadProblemResponse> Add(const std::string& owner, const jobs::ProblemId& id,
                                                std::string body) const;

  // Expect() and Add() of the problem in `request`.
  absl::StatusOr<v1::StoredProblem> Create(const std::string& owner, const v1::CreateProblemRequest& request) const;

  absl::StatusOr<v1::StoredProblem> Get(const std::string& owner, const v1::GetProblemRequest& request) const;
  absl::StatusOr<v1::ListProblemsResponse> List(const std::string& owner, const v1::ListProblemsRequest& request) const;
  absl::Status Delete(const std::string& owner, const v1::DeleteProblemRequest& request) const;

 private:
  v1::StoredProblem ToProto(const jobs::StoredProblem& problem) const;

  jobs::ProblemStore& store_;
  const UploadLimits limits_;
  const SessionLimits session_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_PROBLEM_LIBRARY_H_
