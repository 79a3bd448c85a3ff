// SPDX-License-Identifier: Apache-2.0
#include "client/job_client.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <random>
#include <utility>

#include "client/connection.h"
#include "client/rpc_error.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "proto/trajectory_crc.h"

namespace dlcs::client {
namespace {

using Seconds = std::chrono::duration<double>;
using std::chrono::steady_clock;

constexpr Seconds kFirstPause{0.1};
constexpr Seconds kLongestPause{5};

// Between half and all of `pause`: so that clients that were cut at the same moment do not come back at the same
// moment.
Seconds Jittered(Seconds pause) {
  thread_local std::minstd_rand random{std::random_device{}()};
  return pause * std::uniform_real_distribution<double>(0.5, 1)(random);
}

std::string NewRequestId() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}{:08x}{:08x}", random(), random(), random(), random());
}

// When the server said that it is worth to come back.
std::optional<Seconds> RetryDelay(const grpc::Status& status) {
  google::rpc::Status details;
  if (!details.ParseFromString(status.error_details())) return std::nullopt;
  for (const auto& detail : details.details()) {
    google::rpc::RetryInfo retry;
    if (!detail.UnpackTo(&retry)) continue;
    return Seconds(static_cast<double>(retry.retry_delay().seconds()) + 1e-9 * retry.retry_delay().nanos());
  }
  return std::nullopt;
}

// Whether another attempt may succeed. A stream that is cut in the middle ends as UNKNOWN or INTERNAL as well.
bool MayPass(const grpc::Status& status) {
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      return true;
    case grpc::StatusCode::RESOURCE_EXHAUSTED:
      return RetryDelay(status).has_value();
    case grpc::StatusCode::UNKNOWN:
    case grpc::StatusCode::INTERNAL:
      return status.error_details().empty() && status.error_message().find("RST_STREAM") != std::string::npos;
    default:
      return false;
  }
}

// Returns early when `stop` is requested.
void Pause(Seconds duration, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any changed;
  std::unique_lock lock(mutex);
  changed.wait_for(lock, stop, duration, [&] { return stop.stop_requested(); });
}

}  // namespace

absl::StatusOr<std::unique_ptr<JobClient>> JobClient::Connect(const std::string& address, Notice notice) {
  const absl::StatusOr<std::shared_ptr<grpc::Channel>> channel = OpenChannel(address);
  if (!channel.ok()) return channel.status();
  return std::unique_ptr<JobClient>(new JobClient(address, v1::JobService::NewStub(*channel), std::move(notice)));
}

JobClient::JobClient(std::string address, std::unique_ptr<v1::JobService::Stub> stub, Notice notice)
    : address_(std::move(address)), stub_(std::move(stub)), notice_(std::move(notice)) {}

absl::Status JobClient::Insist(const CallLimits& limits,
                               const std::function<grpc::Status(const CallLimits&, bool& got_on)>& attempt) {
  const auto end = steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(
                                             std::clamp(limits.deadline, Seconds(0), Seconds(1e9)));
  Seconds pause = kFirstPause;
  for (;;) {
    CallLimits left = limits;
    left.deadline = end - steady_clock::now();
    bool got_on = false;
    const grpc::Status status = attempt(left, got_on);
    if (status.ok()) return absl::OkStatus();
    if (got_on) pause = kFirstPause;
    const Seconds wait = std::max(Jittered(pause), RetryDelay(status).value_or(Seconds(0)));
    const bool in_time = steady_clock::now() + wait < end;
    if (!MayPass(status) || !in_time || limits.stop.stop_requested()) return DescribeRpcError(status, address_);
    if (notice_) notice_(fmt::format("{}; again in {:.1f} s", status.error_message(), wait.count()));
    Pause(wait, limits.stop);
    pause = std::min(2 * pause, kLongestPause);
  }
}

template <typename Request, typename Response>
absl::StatusOr<Response> JobClient::Ask(grpc::Status (v1::JobService::Stub::*method)(grpc::ClientContext*,
                                                                                     const Request&, Response*),
                                        const Request& request, const CallLimits& limits) {
  Response response;
  const absl::Status status = Insist(limits, [&](const CallLimits& left, bool&) {
    Call call(left);
    return ((*stub_).*method)(call.context(), request, &response);
  });
  if (!status.ok()) return status;
  return response;
}

absl::StatusOr<v1::SolveJob> JobClient::Submit(v1::CreateSolveJobRequest request, const CallLimits& limits) {
  if (request.request_id().empty()) request.set_request_id(NewRequestId());
  return Ask(&v1::JobService::Stub::CreateSolveJob, request, limits);
}

absl::StatusOr<v1::SolveJob> JobClient::Get(const std::string& name, const CallLimits& limits) {
  v1::GetSolveJobRequest request;
  request.set_name(name);
  return Ask(&v1::JobService::Stub::GetSolveJob, request, limits);
}

absl::StatusOr<std::vector<v1::SolveJob>> JobClient::List(const std::vector<v1::JobState>& states, std::size_t most,
                                                          const CallLimits& limits) {
  v1::ListSolveJobsRequest request;
  for (const v1::JobState state : states) request.add_states(state);
  std::vector<v1::SolveJob> jobs;
  do {
    request.set_page_size(static_cast<int>(std::min<std::size_t>(most - jobs.size(), 1000)));
    const auto page = Ask(&v1::JobService::Stub::ListSolveJobs, request, limits);
    if (!page.ok()) return page.status();
    jobs.insert(jobs.end(), page->jobs().begin(), page->jobs().end());
    request.set_page_token(page->next_page_token());
  } while (!request.page_token().empty() && jobs.size() < most);
  return jobs;
}

absl::StatusOr<v1::SolveJob> JobClient::Cancel(const std::string& name, const CallLimits& limits) {
  v1::CancelSolveJobRequest request;
  request.set_name(name);
  return Ask(&v1::JobService::Stub::CancelSolveJob, request, limits);
}

absl::Status JobClient::Delete(const std::string& name, const CallLimits& limits) {
  v1::DeleteSolveJobRequest request;
  request.set_name(name);
  return Ask(&v1::JobService::Stub::DeleteSolveJob, request, limits).status();
}

absl::Status JobClient::Watch(const v1::WatchSolveJobRequest& request,
                              const std::function<void(const v1::JobEvent&)>& on_event, const CallLimits& limits) {
  v1::WatchSolveJobRequest rest = request;
  return Insist(limits, [&](const CallLimits& left, bool& got_on) {
    Call call(left);
    const auto reader = stub_->WatchSolveJob(call.context(), rest);
    bool finished = false;
    for (v1::JobEvent event; reader->Read(&event);) {
      got_on = true;
      rest.set_after_sequence(event.sequence());
      finished = event.has_finished();
      on_event(event);
    }
    const grpc::Status status = reader->Finish();
    if (finished) return grpc::Status::OK;
    if (!status.ok()) return status;
    // Behind the last event there is nothing more to see.
    if (rest.after_sequence() > 0) return grpc::Status::OK;
    return grpc::Status(grpc::StatusCode::DATA_LOSS, "the events of the job ended without its end");
  });
}

absl::Status JobClient::ReadTrajectory(const v1::ReadTrajectoryRequest& request,
                                       const std::function<void(const v1::TrajectoryPage&)>& on_page,
                                       const CallLimits& limits) {
  v1::ReadTrajectoryRequest rest = request;
  return Insist(limits, [&](const CallLimits& left, bool& got_on) {
    Call call(left);
    const auto reader = stub_->ReadTrajectory(call.context(), rest);
    for (v1::TrajectoryPage page; reader->Read(&page);) {
      if (page.crc32() != TrajectoryCrc(page.chunk())) {
        call.context()->TryCancel();
        reader->Finish();
        return grpc::Status(grpc::StatusCode::UNAVAILABLE, "a page of the trajectory arrived damaged");
      }
      got_on = true;
      rest.set_resume_token(page.resume_token());
      on_page(page);
    }
    return reader->Finish();
  });
}

}  // namespace dlcs::client
