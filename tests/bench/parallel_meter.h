// SPDX-License-Identifier: Apache-2.0
// How much of a solve lies in parallel loops, and what those would take on more processors.

#ifndef DLCS_TESTS_BENCH_PARALLEL_METER_H_
#define DLCS_TESTS_BENCH_PARALLEL_METER_H_

#include <array>

namespace dlcs::bench {

inline constexpr std::array<int, 5> kModeledProcessors = {2, 16, 32, 64, 128};

// Of one thread, in processor time: what other programs do does not count.
struct ParallelShare {
  double total_s = 0;   // everything
  double inside_s = 0;  // inside Workers::ForBlocks(), loops of one block left out
  // The whole on so many processors, if the blocks of a loop took equally long and nothing else were in their way:
  // a loop of b blocks takes ⌈b/p⌉/b of its time on p.
  std::array<double, kModeledProcessors.size()> on_processors_s{};
};

// Everything that happens on this thread from the first call to the second; all loops must run on it alone. The linker
// puts the meter in front of the one door to threads (-Wl,--wrap): the engine is the one that everybody links.
void StartParallelMeter();
ParallelShare StopParallelMeter();

}  // namespace dlcs::bench

#endif  // DLCS_TESTS_BENCH_PARALLEL_METER_H_
