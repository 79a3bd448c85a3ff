// SPDX-License-Identifier: Apache-2.0
#include "server/wire/status.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "proto/shared/truncate_text.h"
#include "server/wire/errors.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

// What gRPC sends in the trailer: base64 of the details, beside the message.
std::size_t HeaderBytes(const grpc::Status& status) {
  return status.error_details().size() * 4 / 3 + 3 * status.error_message().size();
}

TEST(StatusTest, ViolationsTravelThereAndBack) {
  const absl::Status status = InvalidRequest({{"M[1][0]", "nan; must be finite"}, {"T", "-1; must be positive"}});
  const absl::Status back = FromGrpc(ToGrpc(status));
  EXPECT_EQ(back.message(), status.message());
  const std::vector<Violation> violations = ViolationsOf(back);
  ASSERT_THAT(violations, SizeIs(2));
  EXPECT_EQ(violations[1].field, "T");
  EXPECT_EQ(violations[1].description, "-1; must be positive");
  EXPECT_THAT(std::string(back.message()), HasSubstr("M[1][0]: nan; must be finite (the first of 2 violations)"));
}

TEST(StatusTest, HundredsOfViolationsFitIntoHeaders) {
  const std::vector<Violation> many(500, {std::string(1000, 'f'), std::string(1000, 'd')});
  const grpc::Status status = ToGrpc(InvalidRequest(many));
  EXPECT_LT(HeaderBytes(status), 8000u);
  EXPECT_THAT(status.error_message(), HasSubstr("of 500 violations"));
  const std::vector<Violation> short_ones(500, {"A[0][0]", "nan"});
  EXPECT_THAT(ViolationsOf(FromGrpc(ToGrpc(InvalidRequest(short_ones)))), SizeIs(kMaxReportedViolations));
}

TEST(StatusTest, TextIsCutBetweenCharacters) {
  EXPECT_EQ(TruncateUtf8("abcdef", 6), "abcdef");
  EXPECT_EQ(TruncateUtf8("abcdefg", 6), "abc...");
  // ⟂ has three bytes; the cut would fall into the second one.
  EXPECT_EQ(TruncateUtf8("a⟂⟂⟂⟂", 8), "a⟂...");
}

TEST(StatusTest, LimitsAreNamedWithTheirValue) {
  const grpc::Status status = ToGrpc(LimitExceeded("max_states", 2000, 3000));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  google::rpc::Status rich;
  ASSERT_TRUE(rich.ParseFromString(status.error_details()));
  google::rpc::ErrorInfo info;
  ASSERT_EQ(rich.details_size(), 1);
  ASSERT_TRUE(rich.details(0).UnpackTo(&info));
  EXPECT_EQ(info.domain(), "dlcs.v1");
  EXPECT_EQ(info.reason(), "LIMIT_EXCEEDED");
  EXPECT_EQ(info.metadata().at("limit"), "max_states");
  EXPECT_EQ(info.metadata().at("value"), "2000");
  EXPECT_EQ(info.metadata().at("requested"), "3000");
}

TEST(StatusTest, BusyServersSayWhenToComeBack) {
  const grpc::Status status = ToGrpc(ServerBusy("max_concurrent_solves", 2, std::chrono::milliseconds(1500)));
  google::rpc::Status rich;
  ASSERT_TRUE(rich.ParseFromString(status.error_details()));
  google::rpc::RetryInfo retry;
  bool found = false;
  for (const auto& detail : rich.details()) found = found || detail.UnpackTo(&retry);
  ASSERT_TRUE(found);
  EXPECT_EQ(retry.retry_delay().seconds(), 1);
  EXPECT_EQ(retry.retry_delay().nanos(), 500'000'000);
}

TEST(StatusTest, OkStaysOk) {
  EXPECT_TRUE(ToGrpc(absl::OkStatus()).ok());
  EXPECT_TRUE(FromGrpc(grpc::Status::OK).ok());
}

// "No server answers" is what callers make of UNAVAILABLE without it.
TEST(StatusTest, AStoreThatDoesNotAnswerIsToldFromAServerThatDoesNot) {
  const grpc::Status status = ToGrpc(absl::UnavailableError("The job store cannot be reached."));
  google::rpc::Status rich;
  google::rpc::ErrorInfo info;
  ASSERT_TRUE(rich.ParseFromString(status.error_details()));
  ASSERT_EQ(rich.details_size(), 1);
  ASSERT_TRUE(rich.details(0).UnpackTo(&info));
  EXPECT_EQ(info.reason(), "STORE_UNAVAILABLE");
  EXPECT_EQ(info.domain(), "dlcs.v1");
}

}  // namespace
}  // namespace dlcs
