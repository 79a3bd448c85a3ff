// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "client/cli/atomic_file.h"
#include "client/cli/commands.h"
#include "client/cli/paragraphs.h"
#include "client/cli/run_support.h"

namespace dlcs::client {
namespace {

using nlohmann::ordered_json;

// Zero on the wire means that nothing limits it.
ordered_json LimitJson(std::int64_t limit) { return limit > 0 ? ordered_json(limit) : ordered_json(nullptr); }

std::string LimitText(std::int64_t limit) { return limit > 0 ? fmt::format("{}", limit) : "no limit"; }

// Null on a server that takes none.
ordered_json JobLimitsJson(const v1::GetCapabilitiesResponse& response) {
  if (!response.has_jobs()) return nullptr;
  const v1::JobLimits& jobs = response.jobs();
  return {{"max_job_memory_bytes", jobs.max_job_memory_bytes()},
          {"max_job_core_seconds", jobs.max_job_core_seconds()},
          {"max_priority", jobs.max_priority()},
          {"max_queued_jobs", jobs.max_queued_jobs()},
          {"max_queued_jobs_per_user", jobs.max_queued_jobs_per_user()},
          {"max_queued_core_seconds", jobs.max_queued_core_seconds()},
          {"cores", jobs.cores()},
          {"max_attempts", jobs.max_attempts()},
          {"keep_finished_seconds", jobs.keep_finished().seconds()},
          {"keep_finished_bytes", jobs.keep_finished_bytes()},
          {"max_watch_interval_seconds", jobs.max_watch_interval().seconds()},
          {"heartbeat_interval_seconds", jobs.heartbeat_interval().seconds()}};
}

ordered_json UploadLimitsJson(const v1::GetCapabilitiesResponse& response) {
  if (!response.has_uploads()) return nullptr;
  const v1::UploadLimits& uploads = response.uploads();
  return {{"max_upload_bytes", uploads.max_upload_bytes()},
          {"max_uploaded_bytes_per_user", uploads.max_uploaded_bytes_per_user()},
          {"max_uploaded_problems_per_user", uploads.max_uploaded_problems_per_user()},
          {"keep_unused_seconds", uploads.keep_unused().seconds()}};
}

void PrintJson(const v1::GetCapabilitiesResponse& response, std::FILE* out) {
  ordered_json methods = ordered_json::array();
  for (const auto& method : response.methods()) {
    methods.push_back({{"name", method.name()}, {"description", method.description()}});
  }
  const ordered_json root = {{"version", response.version()},
                             {"build", response.build()},
                             {"methods", methods},
                             {"max_states", LimitJson(response.max_states())},
                             {"max_dense_states", LimitJson(response.max_dense_states())},
                             {"max_constraints", LimitJson(response.max_constraints())},
                             {"max_steps", LimitJson(response.max_steps())},
                             {"max_members", LimitJson(response.max_members())},
                             {"max_result_bytes", LimitJson(response.max_result_bytes())},
                             {"max_memory_bytes", LimitJson(response.max_memory_bytes())},
                             {"max_message_bytes", LimitJson(response.max_message_bytes())},
                             {"max_concurrent_solves", LimitJson(response.max_concurrent_solves())},
                             {"threads", response.threads()},
                             {"jobs", JobLimitsJson(response)},
                             {"uploads", UploadLimitsJson(response)},
                             {"setup_cache",
                              {{"max_bytes", response.setup_cache().max_bytes()},
                               {"bytes", response.setup_cache().bytes()},
                               {"values", response.setup_cache().values()},
                               {"hits", response.setup_cache().hits()},
                               {"misses", response.setup_cache().misses()},
                               {"dropped", response.setup_cache().dropped()}}}};
  fmt::print(out, "{}\n", root.dump(2, ' ', false, ordered_json::error_handler_t::replace));
}

std::string AgeText(const google::protobuf::Duration& age) {
  constexpr std::int64_t kHour = 3600, kDay = 24 * kHour;
  const std::int64_t seconds = age.seconds();
  if (seconds >= kDay && seconds % kHour == 0) return fmt::format("{:.4g} days", static_cast<double>(seconds) / kDay);
  if (seconds >= kHour) return fmt::format("{:.4g} hours", static_cast<double>(seconds) / kHour);
  return fmt::format("{} seconds", seconds);
}

void PrintJobLimits(const v1::JobLimits& jobs, std::FILE* out) {
  fmt::print(out, "\nJobs, on {} cores\n", jobs.cores());
  fmt::print(out, "  of one, predicted   {} bytes of memory, {} core-seconds\n", jobs.max_job_memory_bytes(),
             jobs.max_job_core_seconds());
  fmt::print(out, "  waiting             {}, of one user {}; {} core-seconds\n", jobs.max_queued_jobs(),
             jobs.max_queued_jobs_per_user(), jobs.max_queued_core_seconds());
  fmt::print(out, "  given up            after {} attempts that did not get on\n", jobs.max_attempts());
  fmt::print(out, "  kept at their end   {}, {} bytes\n", AgeText(jobs.keep_finished()), jobs.keep_finished_bytes());
}

void PrintUploadLimits(const v1::UploadLimits& uploads, std::FILE* out) {
  fmt::print(out, "\nUploaded problems\n");
  fmt::print(out, "  bytes of one        {}\n", uploads.max_upload_bytes());
  fmt::print(out, "  of one user         {}, {} bytes\n", uploads.max_uploaded_problems_per_user(),
             uploads.max_uploaded_bytes_per_user());
  fmt::print(out, "  kept unused         {}\n", AgeText(uploads.keep_unused()));
}

void PrintTable(const v1::GetCapabilitiesResponse& response, const std::string& server, std::FILE* out) {
  // A server of an earlier version does not tell.
  const std::string build = response.build().empty() ? "" : fmt::format(" ({})", response.build());
  fmt::print(out, "{}: dlcs {}{}, {} threads per solve\n\n", server.empty() ? "this process" : server,
             response.version(), build, response.threads());
  fmt::print(out, "Methods\n");
  Paragraphs paper(WidthOf(out), out);
  for (const auto& method : response.methods()) {
    paper.Print(fmt::format("  {:<19}", method.name()), method.description());
  }
  fmt::print(out, "\nLimits\n");
  fmt::print(out, "  states              {}\n", LimitText(response.max_states()));
  fmt::print(out, "    with a dense A    {}\n", LimitText(response.max_dense_states()));
  fmt::print(out, "  pairs               {}\n", LimitText(response.max_constraints()));
  fmt::print(out, "  steps               {}\n", LimitText(response.max_steps()));
  fmt::print(out, "  ensemble members    {}\n", LimitText(response.max_members()));
  fmt::print(out, "  bytes of a result   {}\n", LimitText(response.max_result_bytes()));
  fmt::print(out, "  bytes of memory     {}\n", LimitText(response.max_memory_bytes()));
  fmt::print(out, "  bytes of a request  {}\n", LimitText(response.max_message_bytes()));
  fmt::print(out, "  solves at once      {}\n", LimitText(response.max_concurrent_solves()));
  if (response.has_jobs()) PrintJobLimits(response.jobs(), out);
  if (response.has_uploads()) PrintUploadLimits(response.uploads(), out);
  const v1::SetupCacheStatistics& setups = response.setup_cache();
  if (setups.max_bytes() == 0) return;
  fmt::print(out, "\nSet-ups kept for further solves of the same matrices\n");
  fmt::print(out, "  values              {}, {} of {} bytes\n", setups.values(), setups.bytes(), setups.max_bytes());
  fmt::print(out, "  hits, misses        {}, {}; {} dropped\n", setups.hits(), setups.misses(), setups.dropped());
}

}  // namespace

ExitCode Run(const CapabilitiesCommand& command) {
  const auto backend = MakeBackend(command.server);
  if (!backend.ok()) return Complain(backend.status(), kBadInput);
  const auto response = (*backend)->GetCapabilities(
      {.deadline = std::chrono::duration<double>(command.deadline_s), .stop = {}});
  if (!response.ok()) return Complain(response.status(), kServiceFailed);
  command.format == OutputFormat::kJson ? PrintJson(*response, stdout)
                                        : PrintTable(*response, command.server.address, stdout);
  const absl::Status printed = FlushStream(stdout, "standard output");
  return printed.ok() ? kSolved : Complain(printed, kServiceFailed);
}

}  // namespace dlcs::client
