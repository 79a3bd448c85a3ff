// SPDX-License-Identifier: Apache-2.0
#include "client/cli/jobs/job_support.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <sstream>
#include <utility>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/problem_input.h"
#include "client/cli/output/ensemble_output.h"
#include "client/result/names.h"

namespace dlcs::client {
namespace {

constexpr std::size_t kJobLetters = 26;
constexpr std::array<std::pair<v1::JobState, const char*>, 6> kStates = {{{v1::JOB_STATE_QUEUED, "queued"},
                                                                          {v1::JOB_STATE_RUNNING, "running"},
                                                                          {v1::JOB_STATE_CANCELLING, "cancelling"},
                                                                          {v1::JOB_STATE_SUCCEEDED, "succeeded"},
                                                                          {v1::JOB_STATE_FAILED, "failed"},
                                                                          {v1::JOB_STATE_CANCELLED, "cancelled"}}};

}  // namespace

absl::StatusOr<std::unique_ptr<Client>> Connect(const JobTarget& target) {
  auto options = ConnectionTo(target.server);
  if (!options.ok()) return options.status();
  options->repeat = target.repeat;
  auto client = Client::Connect(*options, PrintNotice);
  if (!client.ok()) return InOptions(client.status(), target.server);
  return client;
}

CallLimits LimitsFor(const JobTarget& target, const Interrupt& interrupt) {
  return {.deadline = std::chrono::duration<double>(target.patience_s), .stop = interrupt.token()};
}

google::protobuf::Timestamp FromNow(double seconds) {
  const auto time = std::chrono::system_clock::now() + std::chrono::duration_cast<std::chrono::system_clock::duration>(
                                                           std::chrono::duration<double>(seconds));
  const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
  google::protobuf::Timestamp result;
  result.set_seconds(ns / 1'000'000'000);
  result.set_nanos(static_cast<int>(ns % 1'000'000'000));
  return result;
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

std::string AgeText(const google::protobuf::Timestamp& time) {
  const std::time_t seconds = std::max<std::time_t>(0, std::time(nullptr) - static_cast<std::time_t>(time.seconds()));
  if (time.seconds() == 0) return "-";
  if (seconds < 120) return fmt::format("{}s", seconds);
  if (seconds < 7200) return fmt::format("{}m", seconds / 60);
  if (seconds < 172800) return fmt::format("{}h", seconds / 3600);
  return fmt::format("{}d", seconds / 86400);
}

std::string WithoutControlCharacters(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char letter) { return letter < 0x20 || letter == 0x7f; }, '?');
  return text;
}

namespace {

// The only name in `found`, or an error if there is none or more than one.
absl::StatusOr<std::string> OnlyMatch(const std::string& typed, const char* what, const char* list,
                                      const std::vector<std::pair<std::string, std::string>>& found) {
  constexpr std::size_t kMaxShown = 5;
  if (found.size() == 1) return found.front().first;
  if (found.empty()) {
    return absl::InvalidArgumentError(
        fmt::format("no {} has a name that begins with \"{}\"; dlcs {} shows them", what, typed, list));
  }
  std::string text = fmt::format("\"{}\" begins the names of {} {}s:", typed, found.size(), what);
  for (std::size_t k = 0; k < std::min(found.size(), kMaxShown); ++k) {
    text += fmt::format("\n  {}  {}", found[k].first, found[k].second);
  }
  return absl::InvalidArgumentError(text + (found.size() > kMaxShown ? "\n  ..." : ""));
}

constexpr const char* kLettersOfJobs = "abcdefghijklmnopqrstuvwxyz234567";

}  // namespace

absl::StatusOr<std::string> FindJob(JobClient& client, const std::string& typed, const CallLimits& limits) {
  const std::string letters = typed.starts_with("jobs/") ? typed.substr(5) : typed;
  if (letters.empty() || letters.size() > kJobLetters ||
      letters.find_first_not_of(kLettersOfJobs) != std::string::npos) {
    return absl::InvalidArgumentError(
        fmt::format("\"{}\" is not the name of a job; must be jobs/ and {} characters of a-z2-7, or the first of them",
                    typed, kJobLetters));
  }
  const std::string name = "jobs/" + letters;
  if (letters.size() == kJobLetters) return name;
  const auto jobs = client.List({}, kAllJobs, limits);
  if (!jobs.ok()) return jobs.status();
  std::vector<std::pair<std::string, std::string>> found;
  for (const v1::SolveJob& job : *jobs) {
    if (job.name().starts_with(name)) found.emplace_back(job.name(), WithoutControlCharacters(job.title()));
  }
  return OnlyMatch(typed, "job", "list", found);
}

absl::StatusOr<JobOnServer> ConnectToJob(const JobTarget& target, const std::string& typed,
                                         const Interrupt& interrupt) {
  auto client = Connect(target);
  if (!client.ok()) return client.status();
  const CallLimits limits = LimitsFor(target, interrupt);
  auto name = FindJob((*client)->jobs(), typed, limits);
  if (!name.ok()) return name.status();
  return JobOnServer{*std::move(client), limits, *std::move(name)};
}

absl::StatusOr<std::string> FindProblem(ProblemClient& client, const std::string& typed, const CallLimits& limits) {
  if (IsProblemName(typed)) return typed;
  const auto problems = client.List(limits);
  if (!problems.ok()) return problems.status();
  std::vector<std::pair<std::string, std::string>> found;
  for (const v1::StoredProblem& problem : *problems) {
    if (problem.name().starts_with(typed)) {
      found.emplace_back(problem.name(), WithoutControlCharacters(problem.title()));
    }
  }
  return OnlyMatch(typed, "problem", "problems", found);
}

std::string TitleOf(const v1::SolveJob& job) {
  return job.title().empty() ? job.name() : WithoutControlCharacters(job.title());
}

namespace {

// For a job that ended early: how many members of an ensemble have a result, and how many have none.
std::string MembersText(const v1::SolveJob& job) {
  if (!job.has_ensemble()) return "";
  const v1::EnsembleCounts& counts = job.ensemble().counts();
  const std::int64_t ended = Ended(counts);
  return fmt::format(" ({}{} of {} members missing)", ended > 0 ? CountText(counts) + ", " : "",
                     job.ensemble().members() - ended, job.ensemble().members());
}

}  // namespace

ExitCode ConcludeJob(const v1::SolveJob& job) {
  if (job.state() == v1::JOB_STATE_FAILED) {
    fmt::print(stderr, "dlcs: {} failed{}: {}\n", job.name(), MembersText(job), job.error().message());
    return job.error().code() == static_cast<int>(absl::StatusCode::kInvalidArgument) ? kBadInput : kServiceFailed;
  }
  if (job.state() == v1::JOB_STATE_CANCELLED) {
    fmt::print(stderr, "dlcs: {} was cancelled{}{}\n", job.name(), job.has_start_time() ? "" : " before it began",
               MembersText(job));
    return kServiceFailed;
  }
  if (job.has_ensemble()) {
    fmt::print(stderr, "dlcs: {}\n", CountText(job.ensemble().counts()));
    return job.ensemble().counts().failed() > 0 ? kNoAnswer : kSolved;
  }
  const v1::Summary& summary = job.summary();
  if (!Succeeded(summary)) fmt::print(stderr, "dlcs: {}: {}\n", VerdictText(summary), summary.message());
  return ExitCodeOf(summary);
}

}  // namespace dlcs::client
