// SPDX-License-Identifier: Apache-2.0
#include "client/local/agreement.h"

#include <cmath>
#include <vector>

#include "core/problem/time_function.h"
#include "server/wire/component_names.h"
#include "server/wire/convert.h"

namespace dlcs::client {

bool AreSameFunction(const v1::TimeFunction& one, const v1::TimeFunction& other, int size, const v1::Problem& problem) {
  constexpr int kTimes = 257;
  constexpr double kDigits = 1e-9;
  std::vector<Violation> violations;
  const FormulaParameters parameters = ParametersFromProto(problem.parameters(), "parameters", violations);
  const TimeFunction first = TimeFunctionFromProto(one, size, "f", violations, parameters);
  const TimeFunction second = TimeFunctionFromProto(other, size, "f", violations, parameters);
  if (!violations.empty() || !Validate(first, size, "f").empty() || !Validate(second, size, "f").empty()) return false;
  auto of_first = TimeFunctionEvaluator::Create(first, size), of_second = TimeFunctionEvaluator::Create(second, size);
  if (!of_first.ok() || !of_second.ok()) return false;
  Vector value(size), expected(size);
  for (int k = 0; k < kTimes; ++k) {
    const double time = problem.horizon() * (k + 0.5) / kTimes;
    of_first->Evaluate(time, Side::kRight, value);
    of_second->Evaluate(time, Side::kRight, expected);
    const auto allowed = kDigits * value.array().abs().max(expected.array().abs());
    if (!((value - expected).array().abs() <= allowed).all()) return false;
  }
  return true;
}

}  // namespace dlcs::client
