// SPDX-License-Identifier: Apache-2.0
#include "client/rpc/problem_client.h"

#include <algorithm>
#include <utility>

#include "proto/wire/content_hash.h"

namespace dlcs::client {
namespace {

constexpr std::size_t kPieceBytes = 512 << 10;

// Sends `bytes` until the end, or until the server stops reading.
void Send(const std::string& bytes, const std::string& sha256, grpc::ClientWriter<v1::UploadProblemRequest>& writer) {
  v1::UploadProblemRequest part;
  part.mutable_start()->set_bytes(static_cast<std::int64_t>(bytes.size()));
  part.mutable_start()->set_sha256(sha256);
  if (!writer.Write(part)) return;
  for (std::size_t sent = 0; sent < bytes.size(); sent += kPieceBytes) {
    part.set_data(bytes.substr(sent, kPieceBytes));
    if (!writer.Write(part)) return;
  }
  writer.WritesDone();
}

}  // namespace

absl::StatusOr<v1::UploadProblemResponse> ProblemClient::Upload(const v1::ProblemBody& body, const CallLimits& limits) {
  const std::string bytes = body.SerializeAsString();
  const std::string sha256 = ContentHash(bytes);
  v1::UploadProblemResponse response;
  const absl::Status status = retry_.UntilDeadline(limits, [&](const CallLimits& left, bool&) {
    Call call(retry_.connection(), left);
    const auto writer = stub_->UploadProblem(call.context(), &response);
    Send(bytes, sha256, *writer);
    return writer->Finish();
  });
  if (!status.ok()) return status;
  return response;
}

absl::StatusOr<v1::StoredProblem> ProblemClient::Get(const std::string& name, const CallLimits& limits) {
  v1::GetProblemRequest request;
  request.set_name(name);
  return retry_.Ask(*stub_, &v1::ProblemService::Stub::GetProblem, request, limits);
}

absl::StatusOr<std::vector<v1::StoredProblem>> ProblemClient::List(const CallLimits& limits) {
  v1::ListProblemsRequest request;
  std::vector<v1::StoredProblem> problems;
  do {
    const auto page = retry_.Ask(*stub_, &v1::ProblemService::Stub::ListProblems, request, limits);
    if (!page.ok()) return page.status();
    problems.insert(problems.end(), page->problems().begin(), page->problems().end());
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty());
  return problems;
}

absl::Status ProblemClient::Delete(const std::string& name, const CallLimits& limits) {
  v1::DeleteProblemRequest request;
  request.set_name(name);
  return retry_.Ask(*stub_, &v1::ProblemService::Stub::DeleteProblem, request, limits).status();
}

}  // namespace dlcs::client
