// SPDX-License-Identifier: Apache-2.0
// Lines of the log with fields: for people, or as JSON for programs.

#ifndef DLCS_SERVER_LOG_H_
#define DLCS_SERVER_LOG_H_

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "spdlog/common.h"

namespace dlcs {

enum class LogFormat { kText, kJson };

// A fact of a line. An empty text is left out. Names that are the same everywhere: solve, job, method, trace_id, user,
// code, seconds.
struct LogField {
  std::string name;
  std::variant<std::string, std::int64_t, double> value;
};
using LogFields = std::vector<LogField>;

// Writes a line, unless its level is not wanted: as text the message with name=value behind it, as JSON the fields
// beside "time" (RFC 3339, UTC), "level" and "message". What others write through spdlog has no fields. What callers
// sent cannot begin a line of its own: control characters are escaped. Safe from any thread; the formatting is the
// caller's.
void Log(spdlog::level::level_enum level, const std::string& message, const LogFields& fields = {});

// From now on the log of this program, of gRPC and of protobuf goes to standard error: lines of `level` ("debug",
// "info", "warn", "error", "off") and above. Call it before there are threads.
void SetUpLog(const std::string& level, LogFormat format);

}  // namespace dlcs

#endif  // DLCS_SERVER_LOG_H_
