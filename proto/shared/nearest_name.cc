// SPDX-License-Identifier: Apache-2.0
#include "proto/shared/nearest_name.h"

#include <algorithm>
#include <cctype>
#include <cstddef>

namespace dlcs {
namespace {

// Edits are counted in halves, so that "t" is nearer to "T" than to "f".
constexpr int kEdit = 2;
constexpr int kHalfEdit = 1;
constexpr std::size_t kShortestAbbreviation = 3;

bool IsSeparator(char c) { return c == '_' || c == '-' || c == ' '; }

int ReplaceCost(char a, char b) {
  if (a == b) return 0;
  const bool same_letter = std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
  return same_letter || (IsSeparator(a) && IsSeparator(b)) ? kHalfEdit : kEdit;
}

int InsertCost(char c) { return IsSeparator(c) ? kHalfEdit : kEdit; }

// Edit distance with exchanged neighbors, row by row over the letters of `a`.
int Distance(const std::string& a, const std::string& b) {
  std::vector<int> row(b.size() + 1, 0);
  for (std::size_t j = 0; j < b.size(); ++j) row[j + 1] = row[j] + InsertCost(b[j]);
  std::vector<int> last(row.size());          // the row before
  std::vector<int> last_but_one(row.size());  // and the one before that
  for (std::size_t i = 0; i < a.size(); ++i) {
    last_but_one.swap(last);
    last.swap(row);
    row[0] = last[0] + InsertCost(a[i]);
    for (std::size_t j = 0; j < b.size(); ++j) {
      row[j + 1] =
          std::min({last[j] + ReplaceCost(a[i], b[j]), last[j + 1] + InsertCost(a[i]), row[j] + InsertCost(b[j])});
      if (i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j]) {
        row[j + 1] = std::min(row[j + 1], last_but_one[j - 1] + kHalfEdit);
      }
    }
  }
  return row.back();
}

// "laplace" or "iteration" means "laplace-iteration", however many characters are missing.
bool IsAbbreviation(const std::string& name, const std::string& candidate) {
  if (name.size() < kShortestAbbreviation) return false;
  for (std::size_t at = candidate.find(name); at != std::string::npos; at = candidate.find(name, at + 1)) {
    if (at == 0 || IsSeparator(candidate[at - 1])) return true;
  }
  return false;
}

}  // namespace

std::optional<std::string> NearestName(const std::string& name, const std::vector<std::string>& known) {
  std::optional<std::string> nearest;
  int fewest = 0;
  for (const std::string& candidate : known) {
    // The dashes of an option say nothing about its name.
    const std::size_t letters = candidate.size() - std::min(candidate.find_first_not_of('-'), candidate.size());
    const int allowed = std::max<int>(kHalfEdit, kEdit * static_cast<int>(letters) / 2);
    // Each letter too many is an edit.
    if (name.size() > candidate.size() + static_cast<std::size_t>(allowed)) continue;
    const int distance = IsAbbreviation(name, candidate) ? kHalfEdit : Distance(name, candidate);
    if (distance <= allowed && (!nearest || distance < fewest)) {
      nearest = candidate;
      fewest = distance;
    }
  }
  return nearest;
}

std::string DidYouMean(const std::optional<std::string>& meant) {
  return meant ? "; did you mean " + *meant + "?" : "";
}

}  // namespace dlcs
