// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>

#include "client/cli/commands/command_support.h"
#include "client/cli/commands/commands.h"
#include "client/cli/output/atomic_file.h"
#include "client/cli/output/message_json.h"
#include "client/cli/terminal/terminal.h"
#include "client/cli/terminal/wrapped_text.h"

namespace dlcs::client {
namespace {

// Zero: no limit.
std::string LimitText(std::int64_t limit) { return limit > 0 ? fmt::format("{}", limit) : "no limit"; }

std::string DurationText(const google::protobuf::Duration& age) {
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
  fmt::print(out, "  fails               after {} attempts without progress\n", jobs.max_attempts());
  fmt::print(out, "  kept at their end   {}, {} bytes\n", DurationText(jobs.keep_finished()),
             jobs.keep_finished_bytes());
}

void PrintUploadLimits(const v1::UploadLimits& uploads, std::FILE* out) {
  fmt::print(out, "\nUploaded problems\n");
  fmt::print(out, "  bytes of one        {}\n", uploads.max_upload_bytes());
  fmt::print(out, "  of one user         {}, {} bytes\n", uploads.max_uploaded_problems_per_user(),
             uploads.max_uploaded_bytes_per_user());
  fmt::print(out, "  kept unused         {}\n", DurationText(uploads.keep_unused()));
}

void PrintTable(const v1::GetCapabilitiesResponse& response, const std::string& server, std::FILE* out) {
  // A server of an earlier version does not report it.
  const std::string build = response.build().empty() ? "" : fmt::format(" ({})", response.build());
  fmt::print(out, "{}: dlcs {}{}, {} threads per solve\n\n", server.empty() ? "this process" : server,
             response.version(), build, response.threads());
  fmt::print(out, "Methods\n");
  Paragraphs paper(WidthOf(out), out);
  for (const auto& method : response.methods()) {
    paper.Print(fmt::format("  {:<24}", method.name()), method.description());
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
  if (!backend.ok()) return PrintError(backend.status(), kBadInput);
  const auto response =
      (*backend)->GetCapabilities({.deadline = std::chrono::duration<double>(command.deadline_s), .stop = {}});
  if (!response.ok()) return PrintError(response.status(), kServiceFailed);
  command.format == OutputFormat::kJson ? fmt::print("{}\n", JsonLine(*response))
                                        : PrintTable(*response, command.server.address, stdout);
  const absl::Status printed = FlushStream(stdout, "standard output");
  return printed.ok() ? kSolved : PrintError(printed, kServiceFailed);
}

}  // namespace dlcs::client
