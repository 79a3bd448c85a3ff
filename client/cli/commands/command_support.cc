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

namespace dlcs::client {
namespace {

// Parts of field names in requests, and the corresponding keys of files.
constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kFileNames = {{
    {".sparse.values[", ".entries["},
    {".sparse.row_indices[", ".entries["},
    {".sparse.column_indices[", ".entries["},
    {".kronecker_sum.factors[", ".kronecker_sum["},
    {"].start:", "].t0:"},
}};

// The name in a file, "A[0]" for "problem.a[0]"; `path` begins with the path of a field in the request.
std::string WithoutRequest(std::string path) {
  for (const std::string_view part : {"solve.", "problem.", "nonlinear.", "options."}) {
    if (path.starts_with(part)) path.erase(0, part.size());
  }
  const std::size_t member = path.starts_with("members[") ? path.find("].") : std::string::npos;
  const std::size_t begin = member == std::string::npos ? 0 : member + 2;
  const std::size_t end = std::min(path.find_first_of(".[:", begin), path.size());
  const std::string name = path.substr(begin, end - begin);
  for (const auto& [wire, in_file] :
       {std::pair("horizon", "T"), std::pair("state_names", "states"), std::pair("pair_names", "pairs")}) {
    if (name == wire) path.replace(begin, name.size(), in_file);
  }
  for (const char* matrix : {"a", "b", "n", "m", "w"}) {
    if (name == matrix) path[begin] = static_cast<char>(name[0] - 'a' + 'A');
  }
  if (path.starts_with("selector.c")) path[9] = 'C';
  return path;
}

std::string InWordsOfFiles(std::string line) {
  for (const auto& [name, in_file] : kFileNames) {
    const std::size_t begin = line.find(name);
    if (begin < line.find(' ')) line.replace(begin, name.size(), in_file);
  }
  return line;
}

// "options.steps: 0; must be above 0" -> "--steps: 0; ...", "problem.x0[1]: ..." -> "problem.json: x0[1]: ...".
std::string WithPlace(const std::string& of_request, const std::string& source) {
  const std::string line = WithoutRequest(of_request);
  const std::size_t end = line.find_first_of(":[");
  const std::string_view field = std::string_view(line).substr(0, std::min(end, line.size()));
  const std::string_view flag = field == "all_basic_solutions" ? "--all" : FlagOf(field);
  if (!flag.empty() && end != std::string::npos) return fmt::format("{}{}", flag, line.substr(end));
  return fmt::format("{}: {}", source, InWordsOfFiles(line));
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

ExitCode PrintCallError(const absl::Status& status, const std::string& source) {
  if (!absl::IsInvalidArgument(status)) return PrintError(status, ExitCodeOf(status));
  std::istringstream lines{std::string(status.message())};
  for (std::string line; std::getline(lines, line);) fmt::print(stderr, "dlcs: {}\n", WithPlace(line, source));
  return kBadInput;
}

}  // namespace dlcs::client
