// SPDX-License-Identifier: Apache-2.0
// Formulas from files and messages. The first two letters are the numbers of states and constraints: "0" none, "1" one,
// ...
#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

#include "core/problem/formula.h"
#include "tests/fuzz/fuzz_target.h"

namespace dlcs::fuzz {
namespace {

constexpr Index kMaxVariables = 12;

bool SameBits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

bool AllBelow(const std::vector<Index>& indices, Index size) {
  return std::all_of(indices.begin(), indices.end(), [size](Index i) { return i >= 0 && i < size; });
}

}  // namespace

void TryFormula(const std::string& input) {
  if (input.size() < 2) return;
  const auto count = [&input](std::size_t k) {
    return static_cast<Index>(static_cast<unsigned char>(input[k] - '0')) % (kMaxVariables + 1);
  };
  const Index m = count(0), n = count(1);
  absl::StatusOr<Formula> formula = Formula::Parse(input.substr(2), {.states = m, .constraints = n});
  if (!formula.ok()) return Require(!formula.status().message().empty(), "a refusal says why");

  Require(AllBelow(formula->states(), m) && AllBelow(formula->constraints(), n), "only variables that are there occur");
  const Vector x = Vector::LinSpaced(m, -1.5, 2), y = Vector::LinSpaced(n, 0, 3);
  const double first = formula->Evaluate(0.25, x, y);
  for (const double t : {0.0, -0.0, 1e-300, -1e9, 1e300, std::numeric_limits<double>::infinity(),
                         std::numeric_limits<double>::quiet_NaN()}) {
    const double value = formula->Evaluate(t, x, y);
    if (!formula->DependsOnTime()) {
      Require(SameBits(value, first) || (value != value && first != first), "without t the value is one");
    }
  }
  constexpr double kEnd = 2;
  const auto analyzed = AnalyzeFormula(input.substr(2), {.states = m, .constraints = n}, 0, kEnd);
  Require(analyzed.ok(), "what is read is analyzed");
  const auto& [times, time_errors, inside, gaps, refusal, warnings] = (*analyzed)->switching;
  Require(std::is_sorted(times.begin(), times.end()) && (times.empty() || (times.front() > 0 && times.back() < kEnd)),
          "switching times are inside");
  Require(!refusal.empty() || inside.empty() || inside.size() == times.size() + 1,
          "every smooth interval has a time inside");
  Require(time_errors.size() == times.size(), "every switching time has an error");
  Formula decided(*analyzed, {kEnd, times});
  for (const double t : {0.0, 0.7, times.empty() ? kEnd : times.front()}) decided.Evaluate(t, x, y, Side::kLeft);

  const double again = formula->Evaluate(0.25, x, y);
  Require(SameBits(again, first) || (again != again && first != first), "a formula remembers nothing");
}

}  // namespace dlcs::fuzz
