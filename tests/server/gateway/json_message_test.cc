// SPDX-License-Identifier: Apache-2.0
#include "server/gateway/json_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "dlcs/v1/jobs.pb.h"
#include "dlcs/v1/solver.pb.h"
#include "google/protobuf/util/json_util.h"
#include "server/wire/errors.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;

const google::protobuf::Descriptor& kSolve = *v1::SolveRequest::descriptor();

std::string Numbers(int count) {
  std::string json = R"({"problem": {"x0": [1)";
  for (int k = 1; k < count; ++k) json += ",1";
  return json + "]}}";
}

// Serialized as by the library: lists are packed, and fields with their default are omitted.
std::string Reprinted(const std::string& bytes) {
  v1::SolveRequest request;
  EXPECT_TRUE(request.ParseFromString(bytes));
  return request.SerializeAsString();
}

TEST(JsonMessageTest, PiecesDoNotChangeTheMessage) {
  v1::SolveRequest request = testing::SwitchingRequest(10);
  request.set_title(R"(brackets [{]}, "quotes", 'more', a \ and ü)");
  std::string json;
  ASSERT_TRUE(google::protobuf::util::MessageToJsonString(request, &json).ok());
  for (const std::size_t bytes : {1, 2, 7, 100, 100'000}) {
    const auto message = JsonToMessage(kSolve, json, {.piece_bytes = bytes});
    ASSERT_TRUE(message.ok()) << message.status();
    EXPECT_EQ(Reprinted(*message), request.SerializeAsString()) << bytes;
  }
}

TEST(JsonMessageTest, ThereAndBackIsTheSame) {
  const std::string bytes = testing::SwitchingRequest(10).SerializeAsString();
  const auto json = MessageToJson(kSolve, bytes);
  ASSERT_TRUE(json.ok());
  EXPECT_THAT(*json, HasSubstr("\"output_times\""));  // the names of the contract
  EXPECT_EQ(Reprinted(JsonToMessage(kSolve, *json).value()), bytes);
}

TEST(JsonMessageTest, StopsBetweenTwoPieces) {
  const std::string json = Numbers(100'000);
  int pieces = 0;
  const auto stopped = JsonToMessage(kSolve, json, {.is_wanted = [&] { return ++pieces < 3; }});
  EXPECT_EQ(stopped.status().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(pieces, 3);
  pieces = 0;
  EXPECT_TRUE(JsonToMessage(kSolve, json, {.is_wanted = [&] { return ++pieces > 0; }}).ok());
  EXPECT_EQ(pieces, 7);  // 200,000 bytes
}

TEST(JsonMessageTest, BoundsTheMessage) {
  const std::string json = Numbers(1000);  // of 9 bytes each
  EXPECT_TRUE(JsonToMessage(kSolve, json, {.max_bytes = 9100}).ok());
  const auto refused = JsonToMessage(kSolve, json, {.max_bytes = 8900});
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(refused.status().message(), HasSubstr("8900 bytes"));
}

TEST(JsonMessageTest, RefusesWhatIsNoObjectAtOnce) {
  int pieces = 0;
  for (const std::string json : {"[1,1,1]", "1", "\"text\"", "null", "\n\t nothing"}) {
    const auto refused = JsonToMessage(kSolve, json, {.is_wanted = [&] { return ++pieces > 0; }});
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument) << json;
    EXPECT_THAT(refused.status().message(), HasSubstr("begin with '{'"));
  }
  EXPECT_EQ(pieces, 0);
  for (const std::string json : {"", "  \n", "{}"}) EXPECT_EQ(JsonToMessage(kSolve, json).value(), "") << json;
}

TEST(JsonMessageTest, RefusesWhatIsTooDeep) {
  const auto nested = [](int levels) { return R"({"a": )" + std::string(static_cast<std::size_t>(levels), '[') + "1"; };
  for (const std::size_t bytes : {10, 100'000}) {
    EXPECT_THAT(JsonToMessage(kSolve, nested(100), {.piece_bytes = bytes}).status().message(),
                HasSubstr("more than 100 levels"));
    EXPECT_THAT(JsonToMessage(kSolve, nested(99), {.piece_bytes = bytes}).status().message(),
                ::testing::Not(HasSubstr("levels")));
  }
  // In a string they are text.
  const std::string text = R"({"title": ")" + std::string(200, '[') + R"("})";
  EXPECT_TRUE(JsonToMessage(kSolve, text).ok());
}

TEST(JsonMessageTest, NamesTheField) {
  const std::vector<std::pair<std::string, Violation>> cases = {
      {R"({"problems": {}})", {"problems", "there is no such field"}},
      {R"({"problem": {"horizont": 1}})", {"problem.horizont", "there is no such field"}},
      {R"({"problem": {"x0": [0, "one"]}})", {"problem.x0[1]", "invalid value \"one\" for type TYPE_DOUBLE"}},
      {R"({"options": {"method": "METHOD_OF_MINE"}})",
       {"options.method", "invalid value \"METHOD_OF_MINE\" for type type.googleapis.com/dlcs.v1.Method"}},
  };
  for (const auto& [json, expected] : cases) {
    const std::vector<Violation> violations = ViolationsOf(JsonToMessage(kSolve, json).status());
    ASSERT_EQ(violations.size(), 1u) << JsonToMessage(kSolve, json).status();
    EXPECT_EQ(violations[0].field, expected.field);
    EXPECT_EQ(violations[0].description, expected.description);
  }
}

}  // namespace
}  // namespace dlcs
