// SPDX-License-Identifier: Apache-2.0
#include "core/parallel/team.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dlcs {
namespace {

constinit thread_local Team* team_of_thread = nullptr;

}  // namespace

double Team::Sum(double value) {
  if (is_alone()) return value;
  double sum = 0;
  for (const double part : Gather(value)) sum += part;
  return sum;
}

double Team::Max(double value) {
  if (is_alone()) return value;
  double largest = -std::numeric_limits<double>::infinity();
  for (const double part : Gather(value)) {
    if (std::isnan(part)) return part;
    if (part > largest) largest = part;
  }
  return largest;
}

bool Team::Any(bool value) { return Max(value ? 1 : 0) > 0; }

bool Team::IsSame(std::uint64_t hash) {
  constexpr int kExact = 32;
  const auto value = static_cast<double>(hash >> kExact);
  if (is_alone()) return true;
  const std::vector<double> values = Gather(value);
  return std::all_of(values.begin(), values.end(), [value](double other) { return other == value; });
}

Team& Team::Alone() {
  static Team alone;
  return alone;
}

Team& Team::Current() { return team_of_thread ? *team_of_thread : Alone(); }

TeamScope::TeamScope(Team& team) : outer_(team_of_thread) { team_of_thread = &team; }

TeamScope::~TeamScope() { team_of_thread = outer_; }

}  // namespace dlcs
