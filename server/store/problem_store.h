// SPDX-License-Identifier: Apache-2.0
// The store of uploaded problems, in the same database as the jobs that use them.

#ifndef DLCS_SERVER_STORE_PROBLEM_STORE_H_
#define DLCS_SERVER_STORE_PROBLEM_STORE_H_

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/clock.h"

namespace dlcs::jobs {

// The SHA-256 of the body in 64 characters of 0-9a-f.
using ProblemId = std::string;
bool IsProblemId(std::string_view text);

struct NewProblem {
  std::string owner;
  ProblemId id;
  std::string about;  // a description, available without the body; opaque
  std::string body;   // opaque
};

struct StoredProblem {
  ProblemId id;
  std::string about;
  std::int64_t bytes = 0;  // of the body
  Time created;
  Time used;  // the last use; stored at most once an hour
};

struct ProblemPage {
  std::vector<StoredProblem> problems;  // newest first
  std::string next_page_token;          // empty at the end
};

// Of one user.
struct ProblemQuota {
  std::int64_t max_bytes = std::int64_t{2} << 30;
  int max_problems = 100;
};

// A problem belongs to the user who uploaded it, and other users cannot see it. If two users upload the same, each has
// a copy.
//
// JobStore::Expire() deletes a problem that was not used for Expiry::max_unused_problem_age, unless an unfinished job
// needs it (NewJob::problem). Durability, threads and further errors as JobStore.
class ProblemStore {
 public:
  struct Added {
    StoredProblem problem;
    bool existed = false;
  };

  virtual ~ProblemStore() = default;

  // Stores the problem in one transaction; if it exists already, only marks it as used. Errors: RESOURCE_EXHAUSTED with
  // RefusalOf(), by the quota's max_uploaded_bytes_per_user or max_uploaded_problems_per_user.
  virtual absl::StatusOr<Added> AddProblem(const NewProblem& problem, const ProblemQuota& quota) = 0;

  // Errors of all that follow: NOT_FOUND.
  virtual absl::StatusOr<StoredProblem> GetProblem(const std::string& owner, const ProblemId& id) = 0;
  // The body; marks the problem as used.
  virtual absl::StatusOr<std::string> ReadProblem(const std::string& owner, const ProblemId& id) = 0;
  // Errors: FAILED_PRECONDITION while a job needs it.
  virtual absl::Status DeleteProblem(const std::string& owner, const ProblemId& id) = 0;

  // `page_size` from 1. Errors: INVALID_ARGUMENT for an invalid token.
  virtual absl::StatusOr<ProblemPage> ListProblems(const std::string& owner, int page_size,
                                                   const std::string& page_token) = 0;
};

// The errors of all stores.
absl::Status NoSuchProblem(const ProblemId& id);
absl::Status ProblemIsHeld();
// OK if the id of a new problem is a ProblemId; otherwise INVALID_ARGUMENT.
absl::Status CheckProblemId(const ProblemId& id);

// OK if `quota` allows one more problem of `bytes` in addition to `problems` with `held` bytes; otherwise the refusal.
absl::Status CheckQuota(const ProblemQuota& quota, std::int64_t problems, std::int64_t held, std::int64_t bytes);

// The interval after which a use of a problem is stored again.
inline constexpr Duration kUseIsMarkedEvery = std::chrono::hours(1);

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_PROBLEM_STORE_H_
