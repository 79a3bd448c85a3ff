// SPDX-License-Identifier: Apache-2.0
// A problem that comes in pieces.

#ifndef DLCS_SERVER_SOLVE_JOBS_UPLOAD_H_
#define DLCS_SERVER_SOLVE_JOBS_UPLOAD_H_

#include <cstddef>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "dlcs/v1/problems.pb.h"
#include "server/solve_jobs/problem_library.h"

namespace dlcs {

// One upload without any RPC in it: Begin(), Take() for every piece, Store(). Holds in memory what has come; nothing
// reaches the store before all of it is there and is what was announced.
class Upload {
 public:
  // `library` must outlive it.
  Upload(const ProblemLibrary& library, std::string owner) : library_(library), owner_(std::move(owner)) {}

  // The answer where the problem is there already; else the pieces are to follow. Blocks on the store. Errors:
  // InvalidArgument for a first part that is no `start`, or an impossible one; ResourceExhausted naming the limit.
  absl::StatusOr<std::optional<v1::UploadProblemResponse>> Begin(const v1::UploadProblemRequest& first);
  // Errors: InvalidArgument for what is no piece, or goes beyond the size announced.
  absl::Status Take(const v1::UploadProblemRequest& next);
  // Blocks on the store; takes as long as reading the problem. Errors: InvalidArgument for bytes that are not those
  // announced; those of ProblemLibrary::Add().
  absl::StatusOr<v1::UploadProblemResponse> Store();

 private:
  const ProblemLibrary& library_;
  const std::string owner_;
  std::size_t bytes_ = 0;  // announced
  std::string sha256_;
  std::string data_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_SOLVE_JOBS_UPLOAD_H_
