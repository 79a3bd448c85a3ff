// SPDX-License-Identifier: Apache-2.0
// The caller of a call that this process forwards to its own gRPC server (server/gateway), in the metadata of that
// call.

#ifndef DLCS_SERVER_ACCESS_FORWARDED_CALLER_H_
#define DLCS_SERVER_ACCESS_FORWARDED_CALLER_H_

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace dlcs {

// The key of the metadata. Calls from outside that have it are refused.
inline constexpr const char* kForwardedCaller = "dlcs-forwarded-caller-bin";

struct ForwardedCaller {
  std::string peer;                            // as gRPC writes it: "ipv4:10.0.0.7:40312"
  std::vector<std::string> certificate_names;  // of the verified certificate
};

// Signs with 256 random bits that never leave the process, so that nobody else can forge a value.
class ForwardingKey {
 public:
  ForwardingKey();

  std::string Encode(const ForwardedCaller& caller) const;
  // Absent for a value that this key has not encoded.
  std::optional<ForwardedCaller> Decode(std::string_view value) const;

 private:
  const std::string secret_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_ACCESS_FORWARDED_CALLER_H_
