// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/upload.h"

#include <utility>

#include "absl/strings/escaping.h"
#include "fmt/format.h"
#include "proto/wire/content_hash.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

std::string Hex(const std::string& bytes) { return std::string(absl::BytesToHexString(bytes)); }

}  // namespace

absl::StatusOr<std::optional<v1::UploadProblemResponse>> Upload::Begin(const v1::UploadProblemRequest& first) {
  if (!first.has_start()) return InvalidRequest({{"part", "the first must be `start`"}});
  const v1::UploadStart& start = first.start();
  std::vector<Violation> violations;
  if (start.bytes() < 1) violations.push_back({"start.bytes", fmt::format("{}; must be at least 1", start.bytes())});
  if (start.sha256().size() != ContentHash("").size()) {
    violations.push_back(
        {"start.sha256", fmt::format("has {} bytes; must be the 32 of a SHA-256", start.sha256().size())});
  }
  if (!violations.empty()) return InvalidRequest(violations);
  absl::StatusOr<v1::StoredProblem> there = library_.Expect(owner_, Hex(start.sha256()), start.bytes());
  if (there.ok()) {
    v1::UploadProblemResponse response;
    *response.mutable_problem() = *std::move(there);
    response.set_existed(true);
    return std::optional(std::move(response));
  }
  if (!absl::IsNotFound(there.status())) return there.status();
  bytes_ = static_cast<std::size_t>(start.bytes());
  sha256_ = start.sha256();
  return std::optional<v1::UploadProblemResponse>();
}

absl::Status Upload::Take(const v1::UploadProblemRequest& next) {
  if (next.part_case() != v1::UploadProblemRequest::kData) {
    return InvalidRequest({{"part", "after `start` only `data` may follow"}});
  }
  if (next.data().size() > bytes_ - data_.size()) {
    return InvalidRequest({{"data", fmt::format("goes beyond the {} bytes that `start` announced", bytes_)}});
  }
  data_ += next.data();
  return absl::OkStatus();
}

absl::StatusOr<v1::UploadProblemResponse> Upload::Store() {
  if (data_.size() != bytes_) {
    return InvalidRequest({{"data", fmt::format("ended after {} of {} bytes", data_.size(), bytes_)}});
  }
  if (const std::string found = ContentHash(data_); found != sha256_) {
    return InvalidRequest(
        {{"data", fmt::format("has the SHA-256 {}, and `start` announced {}", Hex(found), Hex(sha256_))}});
  }
  return library_.Add(owner_, Hex(sha256_), std::move(data_));
}

}  // namespace dlcs
