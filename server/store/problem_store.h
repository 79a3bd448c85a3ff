// SPDX-License-Identifier: Apache-2.0
// Where uploaded problems are: a second interface of the database that holds the jobs, which name them.

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

// The SHA-256 of the body in 64 characters of 0-9a-f: nobody finds two bodies with the same one.
using ProblemId = std::string;
bool IsProblemId(std::string_view text);

struct NewProblem {
  std::string owner;
  ProblemId id;
  std::string about;  // what is told of it without its body; opaque
  std::string body;   // opaque
};

struct StoredProblem {
  ProblemId id;
  std::string about;
  std::int64_t bytes = 0;  // of the body
  Time created;
  Time used;  // last; written down at most once an hour
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

// A problem belongs to the user who uploaded it, and is there for nobody else; two users who upload the same have one
// each.
//
// One that nobody has used for Expiry::max_unused_problem_age goes with JobStore::Expire(), unless a job that has not
// ended names it (NewJob::problem): such a job holds it. Durability, threads and further errors as JobStore.
class ProblemStore {
 public:
  struct Added {
    StoredProblem problem;
    bool existed = false;
  };

  virtual ~ProblemStore() = default;

  // Stores it whole or not at all; one that is there is used, and costs nothing. Errors: RESOURCE_EXHAUSTED with
  // RefusalOf(), by the quota's max_uploaded_bytes_per_user or max_uploaded_problems_per_user.
  virtual absl::StatusOr<Added> AddProblem(const NewProblem& problem, const ProblemQuota& quota) = 0;

  // Errors of all that follow: NOT_FOUND.
  virtual absl::StatusOr<StoredProblem> GetProblem(const std::string& owner, const ProblemId& id) = 0;
  // The body, which is used by this.
  virtual absl::StatusOr<std::string> ReadProblem(const std::string& owner, const ProblemId& id) = 0;
  // Errors: FAILED_PRECONDITION while a job holds it.
  virtual absl::Status DeleteProblem(const std::string& owner, const ProblemId& id) = 0;

  // `page_size` from 1. Errors: INVALID_ARGUMENT for a token that no page gave.
  virtual absl::StatusOr<ProblemPage> ListProblems(const std::string& owner, int page_size,
                                                   const std::string& page_token) = 0;
};

// What all stores say in these cases.
absl::Status NoSuchProblem(const ProblemId& id);
absl::Status ProblemIsHeld();
// OK, or INVALID_ARGUMENT for what is no ProblemId where a new problem has it.
absl::Status CheckProblemId(const ProblemId& id);

// Nothing where `quota` has room for one more of `bytes` beside `problems` that hold `held` bytes; else the refusal.
absl::Status CheckQuota(const ProblemQuota& quota, std::int64_t problems, std::int64_t held, std::int64_t bytes);

// How long after its last use a problem need not be marked as used again.
inline constexpr Duration kUseIsMarkedEvery = std::chrono::hours(1);

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_PROBLEM_STORE_H_
