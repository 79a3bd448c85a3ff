// SPDX-License-Identifier: Apache-2.0
#include "client/cli/commands/command_support.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <sstream>
#include <string_view>
#include <utility>

#include "client/cli/commands/interrupt.h"
#include "client/cli/options/solve_option_table.h"
#include "client/local/local_backend.h"
#include "client/rpc/client.h"
#include "client/rpc/rpc_error.h"
#include "google/rpc/error_details.pb.h"

namespace dlcs::client {
namespace {

// What files call fields of a problem, and parts of their paths.
constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kFileNames = {{
    {"a", "A"},
    {"b", "B"},
    {"n", "N"},
    {"m", "M"},
    {"e", "E"},
    {"w", "W"},
    {"horizon", "T"},
    {"state_names", "states"},
    {"pair_names", "pairs"},
}};
constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kFileParts = {{
    {".sparse.values[", ".entries["},
    {".sparse.row_indices[", ".entries["},
    {".sparse.column_indices[", ".entries["},
    {".kronecker_sum.factors[", ".kronecker_sum["},
    {"].start", "].t0"},
    {"selector.c", "selector.C"},
    {"outputs.c", "outputs.C"},
    {"outputs.d", "outputs.D"},
}};

// What the command line calls `field`, the path of an option in a request from its name on; empty if it is none.
std::string FlagAndIndex(std::string_view field) {
  const std::size_t end = std::min(field.find('['), field.size());
  const std::string_view name = field.substr(0, end);
  const std::string_view flag = name == "all_basic_solutions" ? "--all" : FlagOf(name);
  // NAME=NUMBER of a list is found by its name, which the error quotes.
  const std::string_view rest = field.find('.') == std::string_view::npos ? field.substr(end) : "";
  return flag.empty() ? std::string() : fmt::format("{}{}", flag, rest);
}

// What a file calls `field`, the path of a field of a problem: "A[0][1]" for "a[0][1]".
std::string InWordsOfFiles(std::string field) {
  const std::size_t member = field.starts_with("members[") ? field.find("].") : std::string::npos;
  const std::size_t begin = member == std::string::npos ? 0 : member + 2;
  const std::size_t end = std::min(field.find_first_of(".[", begin), field.size());
  for (const auto& [wire, in_file] : kFileNames) {
    if (std::string_view(field).substr(begin, end - begin) != wire) continue;
    field.replace(begin, end - begin, in_file);
    break;
  }
  for (const auto& [wire, in_file] : kFileParts) {
    if (const std::size_t at = field.find(wire); at != std::string::npos) field.replace(at, wire.size(), in_file);
  }
  return field;
}

// Where the user finds `field`, a path in a request: "--steps" for options.steps, "problem.json: x0[1]" for
// problem.x0[1].
std::string PlaceOf(std::string field, const std::string& source) {
  for (const std::string_view part : {"solve.", "ensemble.", "problem.", "nonlinear.", "options."}) {
    if (field.starts_with(part)) field.erase(0, part.size());
  }
  const std::string flag = FlagAndIndex(field);
  return flag.empty() ? fmt::format("{}: {}", source, InWordsOfFiles(std::move(field))) : flag;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Backend>> MakeBackend(const ServerTarget& server, bool quiet) {
  if (server.address.empty()) return std::make_unique<LocalBackend>();
  if (!server.origin.empty() && !quiet) PrintNotice(fmt::format("on {} ({})", server.address, server.origin));
  const auto options = ConnectionTo(server);
  if (!options.ok()) return options.status();
  auto client = Client::Connect(*options, PrintNotice);
  if (!client.ok()) return InOptions(client.status(), server);
  return *std::move(client);
}

absl::Status MakeIfAbsent(const ServerTarget& server, bool quiet, std::unique_ptr<Backend>& backend) {
  if (backend) return absl::OkStatus();
  absl::StatusOr<std::unique_ptr<Backend>> made = MakeBackend(server, quiet);
  if (made.ok()) backend = *std::move(made);
  return made.status();
}

void PrintNotice(const std::string& text) { fmt::print(stderr, "dlcs: {}\n", text); }

ExitCode PrintError(const absl::Status& status, ExitCode code) {
  if (absl::IsCancelled(status) && Interrupt::Signal() != 0) {
    fmt::print(stderr, "dlcs: interrupted; a request that was already sent may still be executed\n");
    return code;
  }
  std::istringstream lines{std::string(status.message())};
  for (std::string line; std::getline(lines, line);) fmt::print(stderr, "dlcs: {}\n", line);
  return code;
}

ExitCode PrintCallError(const absl::Status& status, const std::string& source, const std::string& members) {
  const google::rpc::BadRequest bad_request = BadRequestOf(status);
  if (bad_request.field_violations().empty()) return PrintError(status, ExitCodeOf(status));
  for (const auto& violation : bad_request.field_violations()) {
    const bool of_member = !members.empty() && (violation.field().starts_with("members") ||
                                                violation.field().starts_with("ensemble.members"));
    fmt::print(stderr, "dlcs: {}: {}\n", PlaceOf(violation.field(), of_member ? members : source),
               violation.description());
  }
  return kBadInput;
}

void PrintProblemFile(const nlohmann::ordered_json& file, std::FILE* out) {
  const char* before = "{";
  for (const auto& [key, value] : file.items()) {
    fmt::print(out, "{}\n  {}: {}", before, nlohmann::json(key).dump(), value.dump());
    before = ",";
  }
  fmt::print(out, "\n}}\n");
}

}  // namespace dlcs::client
