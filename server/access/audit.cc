// SPDX-License-Identifier: Apache-2.0
#include "server/access/audit.h"

#include "server/log.h"

namespace dlcs {
namespace {

// Escapes data from callers: a line break in it must not look like a line of the log.
std::string Printable(std::string_view text) {
  constexpr std::size_t kMaxBytes = 128;
  std::string result;
  for (const char c : text.substr(0, kMaxBytes)) result += c > ' ' && c < 0x7f ? c : '?';
  return result.empty() ? "-" : result;
}

}  // namespace

void Audit(const AuditRecord& record) {
  Log(spdlog::level::info, "audit",
      {{"user", Printable(record.user)},
       {"method", Printable(record.method)},
       {"object", Printable(record.object)},
       {"outcome", absl::StatusCodeToString(record.outcome)},
       {"peer", record.peer.empty() ? "" : Printable(record.peer)}});
}

}  // namespace dlcs
