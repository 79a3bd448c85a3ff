// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/parallel_meter.h"

#include <ctime>
#include <functional>

#include "core/parallel/parallel.h"

namespace dlcs::bench {
namespace {

struct Meter {
  bool runs = false;
  int depth = 0;  // loops inside loops belong to the outermost
  double began_s = 0;
  ParallelShare share;
};
thread_local Meter meter;

double ThreadSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void Count(double seconds, Index blocks) {
  meter.share.inside_s += seconds;
  for (std::size_t k = 0; k < kModeledProcessors.size(); ++k) {
    const Index processors = kModeledProcessors[k], rounds = (blocks + processors - 1) / processors;
    meter.share.on_processors_s[k] += seconds * static_cast<double>(rounds) / static_cast<double>(blocks);
  }
}

}  // namespace

void StartParallelMeter() {
  meter = {};
  meter.runs = true;
  meter.began_s = ThreadSeconds();
}

ParallelShare StopParallelMeter() {
  meter.runs = false;
  ParallelShare share = meter.share;
  share.total_s = ThreadSeconds() - meter.began_s;
  for (double& seconds : share.on_processors_s) seconds += share.total_s - share.inside_s;
  return share;
}

}  // namespace dlcs::bench

// Workers::ForBlocks(), by the name that the linker knows it by.
using Body = std::function<void(dlcs::Index, dlcs::Index, dlcs::Index)>;
extern "C" void __real__ZN4dlcs7Workers9ForBlocksEllRKSt8functionIFvlllEE(dlcs::Workers* workers, dlcs::Index count,
                                                                          dlcs::Index block_size, const Body& body);
extern "C" void __wrap__ZN4dlcs7Workers9ForBlocksEllRKSt8functionIFvlllEE(dlcs::Workers* workers, dlcs::Index count,
                                                                          dlcs::Index block_size, const Body& body) {
  using namespace dlcs::bench;
  const dlcs::Index blocks = (count + block_size - 1) / block_size;
  const bool counts = meter.runs && meter.depth == 0 && blocks > 1;
  const double began = counts ? ThreadSeconds() : 0;
  meter.depth += counts;
  __real__ZN4dlcs7Workers9ForBlocksEllRKSt8functionIFvlllEE(workers, count, block_size, body);
  meter.depth -= counts;
  if (counts) Count(ThreadSeconds() - began, blocks);
}
