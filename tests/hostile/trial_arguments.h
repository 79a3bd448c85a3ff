// SPDX-License-Identifier: Apache-2.0
// What the commands that try random systems read and print.

#ifndef DLCS_TESTS_HOSTILE_TRIAL_ARGUMENTS_H_
#define DLCS_TESTS_HOSTILE_TRIAL_ARGUMENTS_H_

#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/hostile/trial.h"

namespace dlcs::hostile {

struct SeedRange {
  uint64_t begin, end;  // without `end`
};
// "A:B"
std::optional<SeedRange> ReadSeeds(const std::string& text);

// "1e-4,default,steps=1000"
std::vector<Asked> ReadAsked(const std::string& list);
std::string Text(const Asked& asked);

// What every such command takes.
struct TrialArguments {
  SeedRange seeds = {0, 100};
  std::vector<Asked> asked = ReadAsked("1e-4,1e-7,1e-10,default");
  std::string failures;  // folder for the problems that fail
  double seconds = 10;   // a solve is stopped after so long
  bool verbose = false;
};
// Options of one command: some that stand alone, and some with a value, which return whether it makes sense.
struct MoreOptions {
  std::map<std::string, bool*> flags;
  std::map<std::string, std::function<bool(const std::string&)>> values;
};
// Returns whether all arguments make sense.
bool ReadArguments(int count, char** texts, const MoreOptions& more, TrialArguments& arguments);

// Writes the system to SEED.json in the folder for those that fail, if there is one.
void WriteFailure(const TrialArguments& arguments, uint64_t seed, const System& system);

// A line "  what: 1 2 3"; none without seeds.
void PrintSeeds(const char* what, const std::vector<uint64_t>& seeds);

// Prints how many systems were tried, and each tally by print(asked, tally). Returns the exit code: 1 if an answer was
// wrong.
template <typename Tally, typename Print>
int Conclude(const TrialArguments& arguments, std::vector<Tally>& tallies, const Print& print) {
  std::printf("%llu systems\n", static_cast<unsigned long long>(arguments.seeds.end - arguments.seeds.begin));
  bool has_wrong = false;
  for (size_t k = 0; k < tallies.size(); ++k) {
    print(arguments.asked[k], tallies[k]);
    has_wrong = has_wrong || !tallies[k].wrong.empty();
  }
  return has_wrong ? 1 : 0;
}

}  // namespace dlcs::hostile

#endif  // DLCS_TESTS_HOSTILE_TRIAL_ARGUMENTS_H_
