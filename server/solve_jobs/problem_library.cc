// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/problem_library.h"

#include <utility>
#include <variant>

#include "absl/strings/escaping.h"
#include "fmt/format.h"
#include "proto/shared/title_limit.h"
#include "proto/wire/content_hash.h"
#include "server/solve_jobs/convert_job.h"
#include "server/solve_jobs/job_refusal.h"
#include "server/solve_jobs/page_size.h"
#include "server/solve_jobs/resource_names.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

// The description of a problem without its matrices.
v1::StoredProblem About(const ValidSystem& sound, const std::string& title) {
  v1::StoredProblem about;
  about.set_title(title);
  std::visit(
      [&about](const auto& problem) {
        about.set_states(static_cast<int>(problem.num_states()));
        about.set_constraints(static_cast<int>(problem.num_constraints()));
        about.set_horizon(problem.horizon);
      },
      sound.system);
  about.set_nonlinear(std::holds_alternative<NonlinearProblem>(sound.system));
  return about;
}

absl::StatusOr<ValidSystem> ReadBody(const v1::ProblemBody& body, const SessionLimits& limits) {
  if (body.title().size() > kMaxTitleBytes) {
    return InvalidRequest({{"title", fmt::format("has {} bytes; at most {}", body.title().size(), kMaxTitleBytes)}});
  }
  switch (body.system_case()) {
    case v1::ProblemBody::kProblem:
      return ParseAndValidate(body.problem(), v1::SolveOptions(), limits);
    case v1::ProblemBody::kNonlinear:
      return ParseAndValidate(body.nonlinear(), v1::SolveOptions(), limits);
    case v1::ProblemBody::SYSTEM_NOT_SET:
      break;
  }
  return InvalidRequest({{"system", "must be set: problem or nonlinear"}});
}

}  // namespace

ProblemResolver ProblemLibrary::Of(std::string owner) const {
  return [this, owner = std::move(owner)](const std::string& name) -> absl::StatusOr<v1::ProblemBody> {
    const absl::StatusOr<jobs::ProblemId> id = ProblemIdOf(name, "problem_name");
    if (!id.ok()) return id.status();
    const absl::StatusOr<std::string> stored = store_.ReadProblem(owner, *id);
    if (!stored.ok()) return stored.status();
    v1::ProblemBody body;
    if (!body.ParseFromString(*stored))
      return absl::DataLossError("The stored problem cannot be read: upload it again.");
    return body;
  };
}

absl::StatusOr<v1::StoredProblem> ProblemLibrary::Expect(const std::string& owner, const jobs::ProblemId& id,
                                                         std::int64_t bytes) const {
  if (absl::Status limit = CheckLimit("max_upload_bytes", static_cast<double>(bytes), limits_.max_upload_bytes);
      !limit.ok()) {
    return limit;
  }
  const absl::StatusOr<jobs::StoredProblem> there = store_.GetProblem(owner, id);
  if (!there.ok()) return there.status();
  return ToProto(*there);
}

absl::StatusOr<v1::UploadProblemResponse> ProblemLibrary::Add(const std::string& owner, const jobs::ProblemId& id,
                                                              std::string bytes) const {
  jobs::NewProblem problem{.owner = owner, .id = id, .about = "", .body = std::move(bytes)};
  {
    v1::ProblemBody body;
    if (!body.ParseFromString(problem.body)) {
      return InvalidRequest({{"data", "the bytes are not a dlcs.v1.ProblemBody"}});
    }
    const absl::StatusOr<ValidSystem> sound = ReadBody(body, session_);
    if (!sound.ok()) return sound.status();
    problem.about = About(*sound, body.title()).SerializeAsString();
  }
  const absl::StatusOr<jobs::ProblemStore::Added> added = store_.AddProblem(problem, limits_.quota);
  if (!added.ok()) return WithDetails(added.status());
  v1::UploadProblemResponse response;
  *response.mutable_problem() = ToProto(added->problem);
  response.set_existed(added->existed);
  return response;
}

absl::StatusOr<v1::StoredProblem> ProblemLibrary::Create(const std::string& owner,
                                                         const v1::CreateProblemRequest& request) const {
  std::string body = request.SerializeAsString();  // that of a ProblemBody
  const jobs::ProblemId id = absl::BytesToHexString(ContentHash(body));
  absl::StatusOr<v1::StoredProblem> there = Expect(owner, id, static_cast<std::int64_t>(body.size()));
  if (there.ok() || !absl::IsNotFound(there.status())) return there;
  absl::StatusOr<v1::UploadProblemResponse> added = Add(owner, id, std::move(body));
  if (!added.ok()) return added.status();
  return std::move(*added->mutable_problem());
}

absl::StatusOr<v1::StoredProblem> ProblemLibrary::Get(const std::string& owner,
                                                      const v1::GetProblemRequest& request) const {
  const absl::StatusOr<jobs::ProblemId> id = ProblemIdOf(request.name());
  if (!id.ok()) return id.status();
  const absl::StatusOr<jobs::StoredProblem> problem = store_.GetProblem(owner, *id);
  if (!problem.ok()) return problem.status();
  return ToProto(*problem);
}

absl::StatusOr<v1::ListProblemsResponse> ProblemLibrary::List(const std::string& owner,
                                                              const v1::ListProblemsRequest& request) const {
  const absl::StatusOr<int> size = PageSize(request.page_size());
  if (!size.ok()) return size.status();
  const absl::StatusOr<jobs::ProblemPage> page = store_.ListProblems(owner, *size, request.page_token());
  if (!page.ok()) return page.status();
  v1::ListProblemsResponse response;
  for (const jobs::StoredProblem& problem : page->problems) *response.add_problems() = ToProto(problem);
  response.set_next_page_token(page->next_page_token);
  return response;
}

absl::Status ProblemLibrary::Delete(const std::string& owner, const v1::DeleteProblemRequest& request) const {
  const absl::StatusOr<jobs::ProblemId> id = ProblemIdOf(request.name());
  if (!id.ok()) return id.status();
  return store_.DeleteProblem(owner, *id);
}

v1::StoredProblem ProblemLibrary::ToProto(const jobs::StoredProblem& problem) const {
  v1::StoredProblem result;
  result.ParseFromString(problem.about);
  result.set_name(ProblemName(problem.id));
  result.set_bytes(problem.bytes);
  *result.mutable_create_time() = dlcs::ToProto(problem.created);
  *result.mutable_expire_time() = dlcs::ToProto(problem.used + limits_.keep_unused);
  return result;
}

}  // namespace dlcs
