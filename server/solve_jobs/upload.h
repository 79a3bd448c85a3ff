// SPDX-License-Identifier: Apache-2.0
// A problem that is uploaded in pieces.

#ifndef DLCS_SERVER_SOLVE_JOBS_UPLOAD_H_
#define DLCS_SERVER_SOLVE_JOBS_UPLOAD_H_

#include <cstddef>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "dlcs/v1/problems.pb.h"
#include "server/solve_jobs/problem_library.h"

namespace dlcs {

// One upload without any RPC in it: Begin(), Take() for every piece, Store(). Holds the received pieces in memory;
// nothing is stored before all pieces are there and match the announced size and hash.
class Upload {
 public:
  // `library` must outlive it.
  Upload(const ProblemLibrary& library, std::string owner) : library_(library), owner_(std::move(owner)) {}

  // The response if the problem is in the store already; absent if the pieces must follow. Blocks on the store. Errors:
  // InvalidArgument for a first part that is not a valid `start`; ResourceExhausted naming the limit.
  absl::StatusOr<std::optional<v1::UploadProblemResponse>> Begin(const v1::UploadProblemRequest& first);
  // Adds a piece. Errors: InvalidArgument if it is not a piece, or exceeds the announced size.
  absl::Status Take(const v1::UploadProblemRequest& next);
  // Parses and stores the problem. Blocks on the store. Errors: InvalidArgument for bytes that do not match the
  // announced hash; those of ProblemLibrary::Add().
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
