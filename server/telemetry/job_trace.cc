// SPDX-License-Identifier: Apache-2.0
#include "server/telemetry/job_trace.h"

#include <algorithm>
#include <cstddef>

namespace dlcs {
namespace {

// Field 100000 of protobuf's wire format, bytes, of which there are 32.
constexpr char kTag[] = "\x82\xea\x30\x20";
constexpr std::size_t kTagSize = sizeof kTag - 1;
constexpr std::size_t kIdSize = 32;

}  // namespace

std::string WithTraceId(std::string request, const std::string& trace_id) {
  if (trace_id.size() == kIdSize) request.append(kTag, kTagSize).append(trace_id);
  return request;
}

std::string TraceIdIn(const std::string& request) {
  if (request.size() < kTagSize + kIdSize) return "";
  const std::size_t begin = request.size() - kTagSize - kIdSize;
  if (request.compare(begin, kTagSize, kTag) != 0) return "";
  const std::string id = request.substr(begin + kTagSize);
  // The end of a request may look like the tag by chance.
  return id.find_first_not_of("0123456789abcdef") == std::string::npos ? id : "";
}

}  // namespace dlcs
