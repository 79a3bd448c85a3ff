// SPDX-License-Identifier: Apache-2.0
#include "server/telemetry/process_usage.h"

#include <sys/resource.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

namespace dlcs {
namespace {

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

double CountEntries(const char* folder) {
  std::error_code error;
  const std::filesystem::directory_iterator begin(folder, error);
  return error ? 0 : static_cast<double>(std::distance(begin, std::filesystem::directory_iterator()));
}

}  // namespace

ProcessUsage ReadProcessUsage() {
  ProcessUsage usage;
  double total_pages = 0, resident_pages = 0;
  std::ifstream("/proc/self/statm") >> total_pages >> resident_pages;
  usage.resident_bytes = resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE));
  rusage times{};
  getrusage(RUSAGE_SELF, &times);
  usage.cpu_seconds = Seconds(times.ru_utime) + Seconds(times.ru_stime);
  usage.open_files = CountEntries("/proc/self/fd");
  usage.threads = CountEntries("/proc/self/task");
  return usage;
}

}  // namespace dlcs
