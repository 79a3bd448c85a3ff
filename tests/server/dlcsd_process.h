// SPDX-License-Identifier: Apache-2.0
// The program dlcsd in a process of its own.

#ifndef DLCS_TESTS_SERVER_DLCSD_PROCESS_H_
#define DLCS_TESTS_SERVER_DLCSD_PROCESS_H_

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <vector>

namespace dlcs::testing {

// Starts with `flags` and, beside those of this process, the variables `environment` ("NAME=value"); is killed when it
// is destroyed, unless it has ended.
class DlcsdProcess {
 public:
  explicit DlcsdProcess(const std::vector<std::string>& flags, const std::vector<std::string>& environment = {});
  ~DlcsdProcess();
  DlcsdProcess(const DlcsdProcess&) = delete;
  DlcsdProcess& operator=(const DlcsdProcess&) = delete;

  // The next line of its standard output, without the line break; empty at the end.
  std::string ReadLine();
  // All lines that are left.
  std::string ReadOutput();
  // HOST:PORT in the line that reports that it is ready; empty if the next line is another one.
  std::string ReadAddress();

  void Signal(int signal);
  // Waits for the end. The exit status, or minus the number of the signal that killed it.
  int Wait();

  // All of its standard error; call it after Wait().
  std::string ReadErrors();

  pid_t pid() const { return pid_; }
  // Memory in use now (resident set).
  std::int64_t ResidentBytes() const;
  // The peak of its memory in use; call it after Wait(). Linux includes the memory that this process used when it
  // started it.
  std::int64_t peak_bytes() const { return peak_bytes_; }

 private:
  pid_t pid_ = -1;
  int output_ = -1;
  int errors_ = -1;
  std::int64_t peak_bytes_ = 0;
};

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_DLCSD_PROCESS_H_
