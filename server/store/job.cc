// SPDX-License-Identifier: Apache-2.0
#include "server/store/job.h"

#include <algorithm>
#include <random>

namespace dlcs::jobs {
namespace {

constexpr std::string_view kAlphabet = "abcdefghijklmnopqrstuvwxyz234567";
constexpr std::size_t kIdLength = 26;

}  // namespace

const char* JobStateName(JobState state) {
  switch (state) {
    case JobState::kQueued:
      return "QUEUED";
    case JobState::kRunning:
      return "RUNNING";
    case JobState::kCancelling:
      return "CANCELLING";
    case JobState::kSucceeded:
      return "SUCCEEDED";
    case JobState::kFailed:
      return "FAILED";
    case JobState::kCancelled:
      return "CANCELLED";
  }
  return "UNKNOWN";
}

JobId NewJobId() {
  // Random bits from the system each time, since an id must not be guessable.
  std::random_device random;
  JobId id(kIdLength, ' ');
  std::generate(id.begin(), id.end(), [&random] { return kAlphabet[random() % kAlphabet.size()]; });
  return id;
}

bool IsJobId(std::string_view text) {
  return text.size() == kIdLength && text.find_first_not_of(kAlphabet) == std::string_view::npos;
}

}  // namespace dlcs::jobs
