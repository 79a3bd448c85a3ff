// SPDX-License-Identifier: Apache-2.0
// Solves plain systems and judges the answers by the reference, listed by family:
//
//     plain_dlcs --seeds 0:2000 --tolerance 1e-4,1e-7,1e-10,default
//
// Prints a line for each wrong answer and each refusal without need, and a table for each tolerance. Exits with 1 if an
// answer was wrong.

#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "tests/hostile/trial_arguments.h"
#include "tests/plain/plain_trial.h"

namespace dlcs::plain {
namespace {

using hostile::Asked;
using hostile::Judgment;

int PlainUsage() {
  std::fprintf(stderr,
               "usage: plain_dlcs [--seeds A:B] [--tolerance T,...,default] [--failures FOLDER] [--seconds S] "
               "[--verbose]\n"
               "  --seeds A:B         seeds A to B - 1 (0:100)\n"
               "  --tolerance LIST    errors to ask for (1e-4,1e-7,1e-10,default)\n"
               "  --failures FOLDER   write the problems that fail to FOLDER/SEED.json\n"
               "  --seconds S         stop a solve after so long (10)\n"
               "  --verbose           a line for every trial\n");
  return 2;
}

using CountOf = std::map<Judgment, int>;

struct PlainTally {
  std::map<std::string, CountOf> by_family;
  std::vector<uint64_t> wrong, refused;
  int rough_zeros = 0, an_ulp_decides = 0;
  double seconds = 0;
};

void PrintTrial(uint64_t seed, const PlainSystem& plain, const Asked& asked, const PlainTrial& trial) {
  std::printf("%llu %s %s: error %.1e, allowed %.1e, of %s, own %.1e, at t = %.4g of %.4g",
              static_cast<unsigned long long>(seed), Text(asked).c_str(), Name(trial.judgment), trial.error,
              trial.allowed, trial.component.c_str(), trial.own, trial.time, plain.system.horizon);
  std::printf(", %.2f s | m = %d, n = %d, %s | %.400s\n", trial.seconds, plain.system.num_states(),
              plain.system.num_pairs(), plain.system.traits.c_str(), trial.verdict.c_str());
}

void PrintTally(const Asked& asked, const PlainTally& tally) {
  constexpr Judgment kColumns[] = {Judgment::kRight, Judgment::kWrong, Judgment::kRefusedWithNeed, Judgment::kRefused,
                                   Judgment::kNotJudged};
  std::printf("%-32s %6s %6s %12s %15s %10s\n", Text(asked).c_str(), "right", "WRONG", "refused with",
              "refused without", "not judged");
  CountOf all;
  const auto print = [&](const std::string& name, const CountOf& counts) {
    std::printf("  %-30s", name.c_str());
    constexpr int kWidths[] = {6, 6, 12, 15, 10};
    for (size_t k = 0; k < std::size(kColumns); ++k) {
      const auto found = counts.find(kColumns[k]);
      std::printf(" %*d", kWidths[k], found == counts.end() ? 0 : found->second);
    }
    std::printf("\n");
  };
  for (const auto& [family, counts] : tally.by_family) {
    print(family, counts);
    for (const auto& [judgment, count] : counts) all[judgment] += count;
  }
  print("all", all);
  hostile::PrintSeeds("wrong", tally.wrong);
  hostile::PrintSeeds("refused without need", tally.refused);
  std::printf("  refused with need since an ulp of the data decides: %d\n", tally.an_ulp_decides);
  std::printf("  right with a zero that is off by one to two times its rounding: %d; %.0f s\n", tally.rough_zeros,
              tally.seconds);
}

int PlainMain(int count, char** texts) {
  hostile::TrialArguments arguments;
  if (!hostile::ReadArguments(count, texts, {}, arguments)) return PlainUsage();
  std::vector<PlainTally> tallies(arguments.asked.size());
  for (uint64_t seed = arguments.seeds.begin; seed < arguments.seeds.end; ++seed) {
    const PlainSystem plain = MakePlainSystem(seed);
    const hostile::Reference reference = hostile::ReferenceOf(plain.system);
    for (size_t k = 0; k < arguments.asked.size(); ++k) {
      const Asked& asked = arguments.asked[k];
      const PlainTrial trial = TryPlain(plain, reference, asked, arguments.seconds);
      PlainTally& tally = tallies[k];
      ++tally.by_family[plain.family][trial.judgment];
      tally.seconds += trial.seconds;
      tally.an_ulp_decides += trial.an_ulp_decides;
      tally.rough_zeros += trial.judgment == Judgment::kRight && trial.has_rough_zero;
      const bool is_wrong = trial.judgment == Judgment::kWrong, is_refused = trial.judgment == Judgment::kRefused;
      if (is_wrong) tally.wrong.push_back(seed);
      if (is_refused) tally.refused.push_back(seed);
      if (is_wrong || is_refused || arguments.verbose) PrintTrial(seed, plain, asked, trial);
      if (is_wrong || is_refused) hostile::WriteFailure(arguments, seed, plain.system);
      std::fflush(stdout);
    }
  }
  return hostile::Conclude(arguments, tallies, PrintTally);
}

}  // namespace
}  // namespace dlcs::plain

int main(int count, char** texts) { return dlcs::plain::PlainMain(count, texts); }
