// SPDX-License-Identifier: Apache-2.0
// The trace that a call belongs to, as W3C Trace Context writes it: metadata `traceparent`, 00-TRACE ID-SPAN ID-FLAGS.

#ifndef DLCS_PROTO_WIRE_TRACE_CONTEXT_H_
#define DLCS_PROTO_WIRE_TRACE_CONTEXT_H_

#include <string>
#include <string_view>

namespace dlcs {

// The key of the metadata.
inline constexpr char kTraceparent[] = "traceparent";

// 32 hexadecimal digits; empty if `traceparent` is malformed, which the standard treats as absent. From versions above
// 00 the fields of version 00 are read.
std::string TraceIdOf(std::string_view traceparent);

// A new random id.
std::string NewTraceId();

// The header for one call of the trace: with a new span id, sampled.
std::string TraceparentOf(const std::string& trace_id);

}  // namespace dlcs

#endif  // DLCS_PROTO_WIRE_TRACE_CONTEXT_H_
