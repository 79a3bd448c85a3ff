// SPDX-License-Identifier: Apache-2.0
#include "client/rpc/job_client.h"

#include <algorithm>
#include <utility>

#include "client/rpc/connection.h"
#include "proto/wire/trajectory_crc.h"

namespace dlcs::client {

absl::StatusOr<v1::SolveJob> JobClient::Submit(v1::CreateSolveJobRequest request, const CallLimits& limits) {
  if (request.request_id().empty()) request.set_request_id(NewRequestId());
  return retry_.Ask(*stub_, &v1::JobService::Stub::CreateSolveJob, request, limits);
}

absl::StatusOr<v1::SolveJob> JobClient::SubmitEnsemble(v1::CreateEnsembleJobRequest request, const CallLimits& limits) {
  if (request.request_id().empty()) request.set_request_id(NewRequestId());
  return retry_.Ask(*stub_, &v1::JobService::Stub::CreateEnsembleJob, request, limits);
}

absl::StatusOr<v1::SolveJob> JobClient::Get(const std::string& name, const CallLimits& limits) {
  v1::GetSolveJobRequest request;
  request.set_name(name);
  return retry_.Ask(*stub_, &v1::JobService::Stub::GetSolveJob, request, limits);
}

absl::StatusOr<std::vector<v1::SolveJob>> JobClient::List(const std::vector<v1::JobState>& states, std::size_t most,
                                                          const CallLimits& limits) {
  v1::ListSolveJobsRequest request;
  for (const v1::JobState state : states) request.add_states(state);
  std::vector<v1::SolveJob> jobs;
  do {
    request.set_page_size(static_cast<int>(std::min<std::size_t>(most - jobs.size(), 1000)));
    const auto page = retry_.Ask(*stub_, &v1::JobService::Stub::ListSolveJobs, request, limits);
    if (!page.ok()) return page.status();
    jobs.insert(jobs.end(), page->jobs().begin(), page->jobs().end());
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty() && jobs.size() < most);
  return jobs;
}

absl::StatusOr<v1::SolveJob> JobClient::Cancel(const std::string& name, const CallLimits& limits) {
  v1::CancelSolveJobRequest request;
  request.set_name(name);
  return retry_.Ask(*stub_, &v1::JobService::Stub::CancelSolveJob, request, limits);
}

absl::Status JobClient::Delete(const std::string& name, const CallLimits& limits) {
  v1::DeleteSolveJobRequest request;
  request.set_name(name);
  return retry_.Ask(*stub_, &v1::JobService::Stub::DeleteSolveJob, request, limits).status();
}

absl::Status JobClient::Watch(const v1::WatchSolveJobRequest& request,
                              const std::function<void(const v1::SolveEvent&)>& on_event, const CallLimits& limits) {
  v1::WatchSolveJobRequest rest = request;
  return retry_.UntilDeadline(limits, [&](const CallLimits& left, bool& made_progress) {
    Call call(retry_.connection(), left);
    const auto reader = stub_->WatchSolveJob(call.context(), rest);
    bool finished = false;
    for (v1::SolveEvent event; reader->Read(&event);) {
      made_progress = true;
      rest.set_after_sequence(event.sequence());
      finished = event.has_summary();
      on_event(event);
    }
    const grpc::Status status = reader->Finish();
    if (finished) return grpc::Status::OK;
    if (!status.ok()) return status;
    // There are no events after the last one.
    if (rest.after_sequence() > 0) return grpc::Status::OK;
    return grpc::Status(grpc::StatusCode::DATA_LOSS, "the events of the job ended before the job did");
  });
}

absl::Status JobClient::ReadTrajectory(const v1::ReadTrajectoryRequest& request,
                                       const std::function<void(const v1::TrajectoryPage&)>& on_page,
                                       const CallLimits& limits) {
  v1::ReadTrajectoryRequest rest = request;
  return retry_.UntilDeadline(limits, [&](const CallLimits& left, bool& made_progress) {
    Call call(retry_.connection(), left);
    const auto reader = stub_->ReadTrajectory(call.context(), rest);
    for (v1::TrajectoryPage page; reader->Read(&page);) {
      const bool w_arrived = page.chunk().w().empty() || page.w_crc32() == TrajectoryWCrc(page.chunk());
      const bool outputs_arrived =
          page.chunk().outputs().empty() || page.outputs_crc32() == TrajectoryOutputsCrc(page.chunk());
      if (page.crc32() != TrajectoryCrc(page.chunk()) || !w_arrived || !outputs_arrived) {
        call.context()->TryCancel();
        reader->Finish();
        return grpc::Status(grpc::StatusCode::UNAVAILABLE, "a page of the trajectory arrived damaged");
      }
      made_progress = true;
      rest.set_resume_token(page.resume_token());
      on_page(page);
    }
    return reader->Finish();
  });
}

absl::Status JobClient::ReadEnsemble(const v1::ReadEnsembleRequest& request,
                                     const std::function<void(const v1::EnsembleShard&)>& on_shard,
                                     const CallLimits& limits) {
  v1::ReadEnsembleRequest rest = request;
  return retry_.UntilDeadline(limits, [&](const CallLimits& left, bool& made_progress) {
    Call call(retry_.connection(), left);
    const auto reader = stub_->ReadEnsemble(call.context(), rest);
    bool complete = false;
    for (v1::EnsemblePage page; reader->Read(&page);) {
      made_progress = true;
      rest.set_resume_token(page.resume_token());
      complete = page.complete();
      if (page.has_shard()) on_shard(page.shard());
    }
    const grpc::Status status = reader->Finish();
    return complete ? grpc::Status::OK : status;
  });
}

}  // namespace dlcs::client
