// SPDX-License-Identifier: Apache-2.0
#include "client/rpc/rpc_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "google/rpc/status.pb.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

template <typename... Details>
grpc::Status Rich(grpc::StatusCode code, const std::string& message, const Details&... details) {
  google::rpc::Status rich;
  rich.set_code(code);
  rich.set_message(message);
  (rich.add_details()->PackFrom(details), ...);
  return grpc::Status(code, message, rich.SerializeAsString());
}

std::string Words(const grpc::Status& status) {
  const absl::Status described = DescribeRpcError(status, "host:1");
  EXPECT_EQ(static_cast<int>(described.code()), static_cast<int>(status.error_code()));
  return std::string(described.message());
}

TEST(RpcErrorTest, ListsEveryViolation) {
  google::rpc::BadRequest bad_request;
  for (const char* field : {"M", "x0[1]"}) {
    auto& violation = *bad_request.add_field_violations();
    violation.set_field(field);
    violation.set_description("is wrong");
  }
  EXPECT_EQ(Words(Rich(grpc::StatusCode::INVALID_ARGUMENT, "2 violations", bad_request)),
            "M: is wrong\nx0[1]: is wrong");
}

TEST(RpcErrorTest, SaysWhenToComeBack) {
  google::rpc::RetryInfo retry;
  retry.mutable_retry_delay()->set_seconds(2);
  retry.mutable_retry_delay()->set_nanos(500'000'000);
  EXPECT_THAT(Words(Rich(grpc::StatusCode::RESOURCE_EXHAUSTED, "all solvers are taken.", retry)),
              AllOf(HasSubstr("all solvers are taken"), HasSubstr("Try again in 2.5 s")));
}

TEST(RpcErrorTest, TellsAMissingServerFromOneThatShutsDown) {
  EXPECT_THAT(
      Words(grpc::Status(grpc::StatusCode::UNAVAILABLE, "connection refused")),
      AllOf(HasSubstr("no server answers at host:1"), HasSubstr("Check host and port"), Not(HasSubstr("--listen"))));
  const grpc::Status refused(grpc::StatusCode::UNAVAILABLE, "connection refused");
  EXPECT_THAT(std::string(DescribeRpcError(refused, "localhost:1").message()), HasSubstr("dlcsd --listen localhost:1"));
  EXPECT_THAT(Words(grpc::Status(grpc::StatusCode::UNAVAILABLE, "failed: Trying to connect an http1.x server")),
              AllOf(HasSubstr("the program at host:1 speaks HTTP/1.1 and not gRPC"), HasSubstr("--http-listen")));
  google::rpc::ErrorInfo info;
  info.set_domain("dlcs.v1");
  EXPECT_THAT(Words(Rich(grpc::StatusCode::UNAVAILABLE, "shutting down", info)),
              HasSubstr("cannot take the call: shutting down"));
}

TEST(RpcErrorTest, DoesNotCallADeadlineAMissingServer) {
  EXPECT_THAT(Words(grpc::Status(grpc::StatusCode::DEADLINE_EXCEEDED, "Deadline Exceeded")),
              AllOf(HasSubstr("the deadline passed before host:1 answered"), Not(HasSubstr("no server"))));
}

TEST(RpcErrorTest, TellsWhyADlcsdDoesNotOfferACall) {
  EXPECT_EQ(Words(grpc::Status(grpc::StatusCode::UNIMPLEMENTED, "This server runs jobs: ask a front.")),
            "the server at host:1 refuses: This server runs jobs: ask a front.");
  EXPECT_EQ(Words(grpc::Status(grpc::StatusCode::NOT_FOUND, "There is no such job.")),
            "the server at host:1 refuses: There is no such job.");
}

TEST(RpcErrorTest, KeepsTheMessageWhenDetailsAreGarbage) {
  EXPECT_THAT(Words(grpc::Status(grpc::StatusCode::INVALID_ARGUMENT, "bad", "\x01\x02garbage")), HasSubstr("bad"));
  EXPECT_THAT(Words(grpc::Status(grpc::StatusCode::UNIMPLEMENTED, "unknown service")), HasSubstr("Is it a dlcsd"));
  EXPECT_THAT(Words(grpc::Status(grpc::StatusCode::INTERNAL, "oops")), HasSubstr("log"));
}

}  // namespace
}  // namespace dlcs::client
