// SPDX-License-Identifier: Apache-2.0
// The resources that this process uses, as reported by the kernel.

#ifndef DLCS_SERVER_TELEMETRY_PROCESS_USAGE_H_
#define DLCS_SERVER_TELEMETRY_PROCESS_USAGE_H_

namespace dlcs {

struct ProcessUsage {
  double resident_bytes = 0;
  double cpu_seconds = 0;
  double open_files = 0;
  double threads = 0;
};

// What cannot be read is 0.
ProcessUsage ReadProcessUsage();

}  // namespace dlcs

#endif  // DLCS_SERVER_TELEMETRY_PROCESS_USAGE_H_
