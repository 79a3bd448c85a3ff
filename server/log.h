// SPDX-License-Identifier: Apache-2.0
// Log lines with fields, as text or as JSON.

#ifndef DLCS_SERVER_LOG_H_
#define DLCS_SERVER_LOG_H_

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "spdlog/common.h"

namespace dlcs {

enum class LogFormat { kText, kJson };

// A field of a log line. Empty values are omitted. Names used throughout: solve, job, method, trace_id, user, code,
// seconds.
struct LogField {
  std::string name;
  std::variant<std::string, std::int64_t, double> value;
};
using LogFields = std::vector<LogField>;

// Writes a line if its level is enabled. As text it is the message followed by name=value; as JSON the fields are next
// to "time" (RFC 3339, UTC), "level" and "message". Direct calls of spdlog have no fields. Control characters are
// escaped, so data from callers cannot forge a line. Safe from any thread; formatting is done by the calling thread.
void Log(spdlog::level::level_enum level, const std::string& message, const LogFields& fields = {});

// Sends the logs of this program, of gRPC and of protobuf to standard error: lines of `level` ("debug", "info", "warn",
// "error", "off") and above. Call it before starting threads.
void SetUpLog(const std::string& level, LogFormat format);

}  // namespace dlcs

#endif  // DLCS_SERVER_LOG_H_
