// SPDX-License-Identifier: Apache-2.0
// What a process holds.

#ifndef DLCS_TESTS_LOAD_PROCESS_METER_H_
#define DLCS_TESTS_LOAD_PROCESS_METER_H_

#include <sys/types.h>

namespace dlcs::load {

struct ProcessUse {
  double resident_mb = 0;
  int descriptors = 0;  // open files and sockets
  int threads = 0;
  double cpu_s = 0;                 // so far, of all threads
  double ended_children_cpu_s = 0;  // of those that it has waited for
};

// Of the process now, from /proc.
ProcessUse UseOf(pid_t process);

// Processor time so far of the process and its children, also of those that have ended.
double FamilyCpuSeconds(pid_t process);

}  // namespace dlcs::load

#endif  // DLCS_TESTS_LOAD_PROCESS_METER_H_
