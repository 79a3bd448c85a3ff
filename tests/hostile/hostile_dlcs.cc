// SPDX-License-Identifier: Apache-2.0
// Solves random systems and judges the answers by the reference:
//
//     hostile_dlcs --seeds 0:400 --tolerance 1e-4,1e-7,1e-10,default,steps=1000
//
// Prints a line for each failure, a table, and the quality of the engine's error estimates. Exits with 1 if an answer
// was wrong.

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/hostile/generator.h"
#include "tests/hostile/trial.h"
#include "tests/hostile/trial_arguments.h"

namespace dlcs::hostile {
namespace {

constexpr double kSlow = 5;  // seconds
constexpr std::array kMethods = {Method::kEventDriven, Method::kExponentialIntegrator, Method::kLaplaceIteration,
                                 Method::kWuChenIteration, Method::kTimeStepping};

struct Arguments : TrialArguments {
  Method method = Method::kAuto;
  bool lists_traits = false;
};

int Usage() {
  std::fprintf(stderr,
               "usage: hostile_dlcs [--seeds A:B] [--tolerance T,...,default,steps=N] [--method NAME] [--failures "
               "FOLDER] [--seconds S] [--verbose]\n"
               "  --seeds A:B         seeds A to B - 1 (0:100)\n"
               "  --tolerance LIST    errors to ask for, or fixed steps (1e-4,1e-7,1e-10,default)\n"
               "  --method NAME       solve by this method (auto)\n"
               "  --failures FOLDER   write the problems that fail to FOLDER/SEED.json\n"
               "  --seconds S         stop a solve after so long (10)\n"
               "  --verbose           a line for every trial; with --traits the times of events\n"
               "  --traits            list the systems and what the reference says of them, and solve none\n");
  return 2;
}

bool Parse(int count, char** texts, Arguments& arguments) {
  const auto read_method = [&](const std::string& value) {
    const auto method =
        std::find_if(kMethods.begin(), kMethods.end(), [&](Method m) { return value == MethodName(m); });
    if (method != kMethods.end()) arguments.method = *method;
    return method != kMethods.end();
  };
  return ReadArguments(count, texts, {{{"--traits", &arguments.lists_traits}}, {{"--method", read_method}}}, arguments);
}

struct Tally {
  std::map<Judgment, int> judgments;
  std::vector<uint64_t> wrong, refused, slow;
  int ill_conditioned_wrong = 0;
  int refused_at_end = 0;
  std::vector<double> quotients;  // figure over error
};

void Print(uint64_t seed, const System& system, const Asked& asked, const Trial& trial) {
  std::printf("%llu %s %s: error %.1e of %s at t = %.4g", static_cast<unsigned long long>(seed), Text(asked).c_str(),
              Name(trial.judgment), trial.error.value_or(NAN), trial.component.c_str(), trial.time);
  if (trial.figure) std::printf(", figure %.1e", *trial.figure);
  if (trial.condition) std::printf(", condition %.1e", *trial.condition);
  std::printf(", %.2f s | m = %d, n = %d, %s | %.300s\n", trial.seconds, system.num_states(), system.num_pairs(),
              system.traits.c_str(), trial.verdict.c_str());
}

void PrintTally(const Asked& asked, Tally& tally) {
  std::printf("%-8s", Text(asked).c_str());
  for (const Judgment judgment :
       {Judgment::kRight, Judgment::kWrong, Judgment::kRefusedWithNeed, Judgment::kRefused, Judgment::kNotJudged}) {
    std::printf("  %s %d", Name(judgment), tally.judgments[judgment]);
  }
  std::printf("  slow %zu\n", tally.slow.size());
  PrintSeeds("wrong", tally.wrong);
  if (tally.ill_conditioned_wrong > 0) {
    std::printf("  of these one ulp of the data moves by more than asked: %d\n", tally.ill_conditioned_wrong);
  }
  PrintSeeds("refused without need", tally.refused);
  if (!tally.refused.empty())
    std::printf("  of these T was reached, with an estimated error: %d\n", tally.refused_at_end);
  PrintSeeds("slow", tally.slow);
  std::vector<double>& quotients = tally.quotients;
  if (quotients.empty()) return;
  std::sort(quotients.begin(), quotients.end());
  const auto below = [&quotients](double limit) {
    return std::lower_bound(quotients.begin(), quotients.end(), limit) - quotients.begin();
  };
  std::printf("  figure over error of %zu: least %.2g, median %.3g; below 1/3: %td, below 1/10: %td\n",
              quotients.size(), quotients.front(), quotients[quotients.size() / 2], below(1.0 / 3), below(0.1));
}

int Main(int count, char** texts) {
  Arguments arguments;
  if (!Parse(count, texts, arguments)) return Usage();
  std::vector<Tally> tallies(arguments.asked.size());
  for (uint64_t seed = arguments.seeds.begin; seed < arguments.seeds.end; ++seed) {
    const System system = MakeSystem(seed);
    const Reference reference = ReferenceOf(system);
    if (arguments.lists_traits) {
      std::printf("%llu m = %d, n = %d, %s: %d steps, %d events, to %g of %g %s\n",
                  static_cast<unsigned long long>(seed), system.num_states(), system.num_pairs(), system.traits.c_str(),
                  reference.steps, reference.events, reference.end, system.horizon, reference.reason.c_str());
      for (const double t : reference.event_times) {
        if (arguments.verbose) std::printf("  %.16g\n", t);
      }
      continue;
    }
    for (size_t k = 0; k < arguments.asked.size(); ++k) {
      Asked asked = arguments.asked[k];
      asked.method = arguments.method;
      const Trial trial = Try(system, reference, asked, arguments.seconds);
      Tally& tally = tallies[k];
      ++tally.judgments[trial.judgment];
      if (trial.judgment == Judgment::kWrong) {
        tally.wrong.push_back(seed);
        if (trial.condition.value_or(0) > asked.error()) ++tally.ill_conditioned_wrong;
      }
      if (trial.judgment == Judgment::kRefused) {
        tally.refused.push_back(seed);
        if (trial.reached_end) ++tally.refused_at_end;
      }
      if (trial.seconds > kSlow) tally.slow.push_back(seed);
      if (trial.reached_end && trial.figure && trial.error_of_figure)
        tally.quotients.push_back(*trial.figure / *trial.error_of_figure);
      const bool failed =
          trial.judgment == Judgment::kWrong || trial.judgment == Judgment::kRefused || trial.seconds > kSlow;
      if (failed || arguments.verbose) Print(seed, system, asked, trial);
      if (failed) WriteFailure(arguments, seed, system);
      std::fflush(stdout);
    }
  }
  return Conclude(arguments, tallies, PrintTally);
}

}  // namespace
}  // namespace dlcs::hostile

int main(int count, char** texts) { return dlcs::hostile::Main(count, texts); }
