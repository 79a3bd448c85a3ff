// SPDX-License-Identifier: Apache-2.0
#include "client/cli/job_support.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <sstream>
#include <utility>

#include "client/cli/run_support.h"
#include "client/names.h"

namespace dlcs::client {
namespace {

constexpr std::array<std::pair<v1::JobState, const char*>, 6> kStates = {{{v1::JOB_STATE_QUEUED, "queued"},
                                                                          {v1::JOB_STATE_RUNNING, "running"},
                                                                          {v1::JOB_STATE_CANCELLING, "cancelling"},
                                                                          {v1::JOB_STATE_SUCCEEDED, "succeeded"},
                                                                          {v1::JOB_STATE_FAILED, "failed"},
                                                                          {v1::JOB_STATE_CANCELLED, "cancelled"}}};

}  // namespace

absl::StatusOr<std::unique_ptr<JobClient>> ConnectToJobs(const JobTarget& target) {
  const auto options = ConnectionTo(target.server);
  if (!options.ok()) return options.status();
  auto client = JobClient::Connect(*options, SayNotice);
  if (!client.ok()) return InOptions(client.status(), target.server);
  return client;
}

absl::StatusOr<std::unique_ptr<ProblemClient>> ConnectToProblems(const JobTarget& target) {
  const auto options = ConnectionTo(target.server);
  if (!options.ok()) return options.status();
  auto client = ProblemClient::Connect(*options, SayNotice);
  if (!client.ok()) return InOptions(client.status(), target.server);
  return client;
}

CallLimits LimitsFor(const JobTarget& target, const Interrupt& interrupt) {
  return {.deadline = std::chrono::duration<double>(target.patience_s), .stop = interrupt.token()};
}

std::string JobStateWord(v1::JobState state) {
  for (const auto& [known, word] : kStates) {
    if (known == state) return word;
  }
  return fmt::format("state {}", static_cast<int>(state));  // of a newer server
}

std::optional<std::vector<v1::JobState>> ParseJobStates(const std::string& words) {
  std::vector<v1::JobState> states;
  std::istringstream list(words);
  for (std::string word; std::getline(list, word, ',');) {
    const auto* known =
        std::find_if(kStates.begin(), kStates.end(), [&word](const auto& entry) { return entry.second == word; });
    if (known == kStates.end()) return std::nullopt;
    states.push_back(known->first);
  }
  return states;
}

std::vector<std::string> JobStateWords() {
  std::vector<std::string> words;
  for (const auto& [state, word] : kStates) words.emplace_back(word);
  return words;
}

bool HasEnded(v1::JobState state) {
  return state == v1::JOB_STATE_SUCCEEDED || state == v1::JOB_STATE_FAILED || state == v1::JOB_STATE_CANCELLED;
}

std::string TimeText(const google::protobuf::Timestamp& time) {
  if (time.seconds() == 0) return "-";
  return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(static_cast<std::time_t>(time.seconds())));
}

ExitCode ConcludeJob(const v1::SolveJob& job) {
  if (job.state() == v1::JOB_STATE_FAILED) {
    fmt::print(stderr, "dlcs: {} failed: {}\n", job.name(), job.error().message());
    return job.error().code() == static_cast<int>(absl::StatusCode::kInvalidArgument) ? kBadInput : kServiceFailed;
  }
  if (job.state() == v1::JOB_STATE_CANCELLED) {
    fmt::print(stderr, "dlcs: {} was cancelled\n", job.name());
    return kServiceFailed;
  }
  const v1::Summary& summary = job.summary();
  if (!Succeeded(summary)) fmt::print(stderr, "dlcs: {}: {}\n", VerdictText(summary), summary.message());
  return ExitCodeOf(summary);
}

}  // namespace dlcs::client
