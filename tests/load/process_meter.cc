// SPDX-License-Identifier: Apache-2.0
#include "tests/load/process_meter.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

namespace dlcs::load {
namespace {

int CountEntries(const std::string& folder) {
  return static_cast<int>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

}  // namespace

ProcessUse UseOf(pid_t process) {
  const std::string folder = "/proc/" + std::to_string(process);
  ProcessUse use;
  double pages = 0;
  std::ifstream(folder + "/statm") >> pages >> pages;
  use.resident_mb = pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
  use.descriptors = CountEntries(folder + "/fd");
  use.threads = CountEntries(folder + "/task");
  // Behind the name, which may hold blanks, fields 14 to 17 of proc(5) are the 12th to the 15th.
  std::ifstream file(folder + "/stat");
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  std::istringstream fields(text.substr(text.rfind(')') + 1));
  std::string skipped;
  for (int k = 3; k < 14; ++k) fields >> skipped;
  double user = 0, system = 0, children_user = 0, children_system = 0;
  fields >> user >> system >> children_user >> children_system;
  const auto ticks = static_cast<double>(sysconf(_SC_CLK_TCK));
  use.cpu_s = (user + system) / ticks;
  use.ended_children_cpu_s = (children_user + children_system) / ticks;
  return use;
}

double FamilyCpuSeconds(pid_t process) {
  const ProcessUse first = UseOf(process);
  double seconds = first.cpu_s + first.ended_children_cpu_s;
  const std::string pid = std::to_string(process);
  std::ifstream children("/proc/" + pid + "/task/" + pid + "/children");
  for (pid_t child = 0; children >> child;) {
    try {
      seconds += UseOf(child).cpu_s;
    } catch (const std::filesystem::filesystem_error&) {  // it has just ended
    }
  }
  return seconds;
}

}  // namespace dlcs::load
