// SPDX-License-Identifier: Apache-2.0
#include "server/store/postgres/postgres_notice.h"

#include <memory>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "server/store/postgres/postgres_schema.h"

namespace dlcs::jobs {
namespace {

// A letter, the job's id, and after it:
constexpr char kFollowed = 'f';   // nothing
constexpr char kWatched = 'w';    // the most times, and the components wanted: "65 0,2"
constexpr char kTransient = 'p';  // the number of the part, of how many, and the part: "0 2 ..."; together
                                  // "sequence time kind durable_before payload", the last in base 64
constexpr std::size_t kPartBytes = 7900;
constexpr std::size_t kMaxBytes = 2'000'000;

std::string TextOf(const JobChange& change) {
  const Event& event = change.event;
  return absl::StrCat(event.sequence, " ", event.time.time_since_epoch().count(), " ", static_cast<int>(event.kind),
                      " ", change.durable_before, " ", absl::Base64Escape(*event.payload));
}

std::optional<JobChange> ReadWatched(const JobId& job, const std::string& text) {
  const std::pair<std::string, std::string> fields = absl::StrSplit(text, absl::MaxSplits(' ', 1));
  JobChange change{JobChange::What::kWatched, job};
  if (!absl::SimpleAtoi(fields.first, &change.detail.most_times)) return std::nullopt;
  const std::vector<std::string> components = absl::StrSplit(fields.second, ',', absl::SkipEmpty());
  for (const std::string& component : components) {
    if (!absl::SimpleAtoi(component, &change.detail.components.emplace_back())) return std::nullopt;
  }
  return change;
}

std::optional<JobChange> ReadTransient(const JobId& job, const std::string& text) {
  const std::vector<std::string> fields = absl::StrSplit(text, ' ');
  std::int64_t microseconds = 0;
  int kind = 0;
  std::string payload;
  JobChange change{JobChange::What::kTransient, job};
  const bool understood = fields.size() == 5 && absl::SimpleAtoi(fields[0], &change.event.sequence) &&
                          absl::SimpleAtoi(fields[1], &microseconds) && absl::SimpleAtoi(fields[2], &kind) &&
                          absl::SimpleAtoi(fields[3], &change.durable_before) &&
                          absl::Base64Unescape(fields[4], &payload);
  change.event.kind = static_cast<EventKind>(kind);
  if (!understood || IsDurable(change.event.kind) || change.event.kind > EventKind::kWindowFinished)
    return std::nullopt;
  change.event.time = Time(Duration(microseconds));
  change.event.payload = std::make_shared<const std::string>(std::move(payload));
  return change;
}

}  // namespace

std::vector<std::string> NoticesOf(const JobChange& change) {
  if (change.what == JobChange::What::kFollowed) return {absl::StrCat(std::string(1, kFollowed), change.job)};
  if (change.what == JobChange::What::kWatched) {
    return {absl::StrCat(std::string(1, kWatched), change.job, " ", change.detail.most_times, " ",
                         absl::StrJoin(change.detail.components, ","))};
  }
  if (change.what != JobChange::What::kTransient || change.event.payload->size() > kMaxBytes) return {};
  const std::string text = TextOf(change);
  const std::size_t count = (text.size() + kPartBytes - 1) / kPartBytes;
  std::vector<std::string> notices;
  for (std::size_t k = 0; k < count; ++k) {
    notices.push_back(absl::StrCat(std::string(1, kTransient), change.job, " ", k, " ", count, " ",
                                   text.substr(k * kPartBytes, kPartBytes)));
  }
  return notices;
}

std::optional<JobChange> NoticeReader::Read(const std::string& payload) {
  if (payload.empty()) return std::nullopt;
  const std::pair<std::string, std::string> fields = absl::StrSplit(payload.substr(1), absl::MaxSplits(' ', 1));
  const auto& [job, rest] = fields;
  if (!IsJobId(job)) return std::nullopt;
  switch (payload.front()) {
    case kPostgresQueued:
      return JobChange{JobChange::What::kClaimable, job};
    case kPostgresEvents:
      return JobChange{JobChange::What::kEvents, job};
    case kPostgresCancelling:
      return JobChange{JobChange::What::kCancelling, job};
    case kFollowed:
      return JobChange{JobChange::What::kFollowed, job};
    case kWatched:
      return ReadWatched(job, rest);
    case kTransient:
      return ReadPart(job, rest);
    default:
      return std::nullopt;
  }
}

std::optional<JobChange> NoticeReader::ReadPart(const JobId& job, const std::string& part) {
  const std::vector<std::string> fields = absl::StrSplit(part, absl::MaxSplits(' ', 2));
  int number = 0, count = 0;
  if (fields.size() != 3 || !absl::SimpleAtoi(fields[0], &number) || !absl::SimpleAtoi(fields[1], &count)) {
    return std::nullopt;
  }
  if (number == 0) {
    job_ = job;
    parts_ = 0;
    text_.clear();
  }
  if (job != job_ || number != parts_) return std::nullopt;  // the first parts were not received
  ++parts_;
  text_ += fields[2];
  if (parts_ < count) return std::nullopt;
  return ReadTransient(job, std::exchange(text_, ""));
}

}  // namespace dlcs::jobs
