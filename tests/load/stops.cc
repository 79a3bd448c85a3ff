// SPDX-License-Identifier: Apache-2.0
// Measures how long after a stop work ends.

#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <optional>
#include <random>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "tests/load/percentiles.h"
#include "tests/load/questions.h"
#include "tests/load/stop_cases.h"

namespace dlcs::load {
namespace {

using std::chrono::duration;
using std::chrono::steady_clock;

double ProcessorSecondsOf(pthread_t thread) {
  clockid_t clock{};
  timespec time{};
  if (pthread_getcpuclockid(thread, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

struct Stopped {
  double wall_ms = 0;  // from the request to the return
  double cpu_ms = 0;   // of the thread that solves, which a busy machine does not make longer
  bool is_sound = false;
};

// Runs `work`, and requests a stop after `seconds`. Absent if it ended before; `took` is then its duration.
std::optional<Stopped> StopAfter(const StoppableWork& work, double seconds, double& took) {
  std::stop_source stop;
  std::atomic<bool> is_over = false;
  steady_clock::time_point end;
  double cpu_end = 0;
  bool is_sound = false;
  const auto begin = steady_clock::now();
  std::thread solver([&] {
    is_sound = work.run(stop.get_token());  // a stop may come when all is done but the return
    end = steady_clock::now();
    cpu_end = ProcessorSecondsOf(pthread_self());
    is_over = true;
  });
  for (duration<double> rest(seconds); !is_over && rest.count() > 0;) {
    std::this_thread::sleep_for(std::min(rest, duration<double>(0.02)));
    rest = duration<double>(seconds) - (steady_clock::now() - begin);
  }
  const bool was_over = is_over;
  const double cpu_begin = was_over ? 0 : ProcessorSecondsOf(solver.native_handle());
  const auto asked = steady_clock::now();
  stop.request_stop();
  solver.join();
  took = duration<double>(end - begin).count();
  if (was_over || end < asked) return std::nullopt;
  return Stopped{1e3 * duration<double>(end - asked).count(), 1e3 * (cpu_end - cpu_begin), is_sound};
}

}  // namespace

bool AskStops(const StopsQuestion& question) {
  // What the engine promises, in processor time of its thread: a factor of two for slower machines.
  const auto limit_ms = [](int size) { return size <= 500 ? 40.0 : 200.0; };
  std::printf("stops: %d of each, within %.3g s, --seed %u; times in ms\n", question.stops, question.longest,
              question.seed);
  std::printf("%-6s %-34s %8s %8s %8s %10s\n", "size", "work", "p50", "p99", "max", "max of cpu");
  std::mt19937 random(question.seed);
  bool holds = true;
  for (const int size : question.sizes) {
    for (const StoppableWork& work : StoppableWorks(size)) {
      if (work.name.find(question.only) == std::string::npos) continue;
      double longest = question.longest;
      std::vector<double> wall, cpu;
      bool is_sound = true;
      for (int tries = 0; static_cast<int>(wall.size()) < question.stops && tries < 3 * question.stops; ++tries) {
        double took = 0;
        const double after = std::uniform_real_distribution<double>(0, longest)(random);
        if (const auto stopped = StopAfter(work, after, took)) {
          wall.push_back(stopped->wall_ms);
          cpu.push_back(stopped->cpu_ms);
          is_sound = is_sound && stopped->is_sound;
        } else {
          longest = std::min(longest, took);
        }
      }
      if (wall.empty()) continue;
      const double worst = *std::max_element(cpu.begin(), cpu.end());
      const bool is_late = worst > limit_ms(size);
      std::printf("%-6d %-34s %8.2f %8.2f %8.2f %10.2f%s%s\n", size, work.name.c_str(), Percentile(wall, 50),
                  Percentile(wall, 99), Percentile(wall, 100), worst, is_late ? "  LATE" : "",
                  is_sound ? "" : "  WRONG: ended as something else");
      std::fflush(stdout);
      holds = holds && !is_late && is_sound;
    }
  }
  return holds;
}

}  // namespace dlcs::load
