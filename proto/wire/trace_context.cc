// SPDX-License-Identifier: Apache-2.0
#include "proto/wire/trace_context.h"

#include <algorithm>
#include <cstddef>
#include <random>

namespace dlcs {
namespace {

constexpr std::size_t kTraceDigits = 32;
constexpr std::size_t kSpanDigits = 16;
constexpr char kDigits[] = "0123456789abcdef";

bool IsHex(std::string_view text) {
  return std::all_of(text.begin(), text.end(),
                     [](char c) { return std::string_view(kDigits, 16).find(c) != std::string_view::npos; });
}
bool IsId(std::string_view text) { return IsHex(text) && text.find_first_not_of('0') != std::string_view::npos; }

std::string RandomDigits(std::size_t count) {
  thread_local std::random_device random;
  std::string digits;
  while (digits.size() < count) {
    for (unsigned bits = random(), k = 0; k < 8; ++k, bits >>= 4) digits += kDigits[bits & 15];
  }
  return digits;
}

}  // namespace

std::string TraceIdOf(std::string_view traceparent) {
  constexpr std::size_t kTraceBegin = 3, kSpanBegin = kTraceBegin + kTraceDigits + 1,
                        kFlagsBegin = kSpanBegin + kSpanDigits + 1;
  constexpr std::size_t kSize = kFlagsBegin + 2;
  if (traceparent.size() < kSize) return "";
  const std::string_view version = traceparent.substr(0, 2);
  const std::string_view trace = traceparent.substr(kTraceBegin, kTraceDigits);
  const bool dashes =
      traceparent[kTraceBegin - 1] == '-' && traceparent[kSpanBegin - 1] == '-' && traceparent[kFlagsBegin - 1] == '-';
  const bool ends = traceparent.size() == kSize || (version != "00" && traceparent[kSize] == '-');
  const bool sound = dashes && ends && IsHex(version) && version != "ff" && IsId(trace) &&
                     IsId(traceparent.substr(kSpanBegin, kSpanDigits)) && IsHex(traceparent.substr(kFlagsBegin, 2));
  return sound ? std::string(trace) : "";
}

std::string NewTraceId() { return RandomDigits(kTraceDigits); }

std::string TraceparentOf(const std::string& trace_id) {
  return "00-" + trace_id + "-" + RandomDigits(kSpanDigits) + "-01";
}

}  // namespace dlcs
