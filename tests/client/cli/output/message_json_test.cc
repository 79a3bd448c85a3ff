// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/message_json.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <google/protobuf/util/message_differencer.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "dlcs/v1/jobs.pb.h"
#include "tests/client/cli/printed.h"

namespace dlcs::client {
namespace {

using google::protobuf::util::MessageDifferencer;

// Two states, one pair, three times, a left limit and every message of a summary; the numbers do not end in binary.
SolveResult Example() {
  SolveResult result;
  result.states = 2;
  result.constraints = 1;
  result.times = {0, 0.1, 1.0 / 3};
  result.x = {1, 0.1 + 0.2, -1e-300, 5e-324, 1.7976931348623157e308, 1e-5};
  result.y = {0, 2.0 / 3, 1e16};
  result.w = {0.7, 0, 123456789012345680.0};
  v1::LeftLimit& limit = result.left_limits.emplace_back();
  limit.set_index(1);
  limit.add_y(0.5);
  limit.add_w(1.0 / 7);
  result.job = "jobs/7";
  result.analysis.set_matrix_class("P-matrix");
  result.analysis.set_states(2);
  result.analysis.add_state_names("iL");
  result.analysis.set_lipschitz(0.3);
  v1::Summary& summary = result.summary;
  summary.set_termination(v1::TERMINATION_REACHED_END);
  summary.set_method(v1::METHOD_LAPLACE_ITERATION);
  summary.add_warnings("a \"quoted\" warning of κ <= 8");
  summary.mutable_verdict()->set_kind(v1::VERDICT_KIND_ERROR_UNKNOWN);
  summary.mutable_accuracy()->set_error(2.0 / 3e9);
  v1::StateJump& jump = *summary.add_jumps();
  jump.add_dx(0.5);
  jump.add_multiplier(2);
  summary.mutable_certificate()->set_node_residual(3e-16);
  summary.mutable_cost()->set_iterations(7);
  summary.mutable_cost()->set_lcps(std::int64_t{1} << 40);
  summary.mutable_newton()->add_residuals(1e-9);
  return result;
}

v1::SolveResult Document(const SolveResult& result, const std::string& title) {
  v1::SolveResult document;
  document.set_title(title);
  document.set_job(result.job);
  *document.mutable_analysis() = result.analysis;
  *document.mutable_summary() = result.summary;
  v1::TrajectoryChunk& trajectory = *document.mutable_trajectory();
  trajectory.mutable_times()->Assign(result.times.begin(), result.times.end());
  trajectory.mutable_x()->Assign(result.x.begin(), result.x.end());
  trajectory.mutable_y()->Assign(result.y.begin(), result.y.end());
  trajectory.mutable_w()->Assign(result.w.begin(), result.w.end());
  trajectory.mutable_left_limits()->Assign(result.left_limits.begin(), result.left_limits.end());
  return document;
}

std::string Text(const SolveResult& result) {
  return Printed([&](std::FILE* out) { PrintJson("two tanks", result, out); });
}

TEST(MessageJsonTest, AResultIsWrittenAsItsMessage) {
  for (const SolveResult& result : {Example(), SolveResult()}) {
    EXPECT_EQ(Text(result), JsonLine(Document(result, "two tanks")) + "\n");
  }
}

TEST(MessageJsonTest, AMemberIsWrittenAsItsMessage) {
  MemberResult member;
  member.member = 3;
  member.label = "cold";
  member.result = Example();
  v1::MemberResult document;
  document.set_member(3);
  document.set_label("cold");
  *document.mutable_summary() = member.result.summary;
  *document.mutable_trajectory() = Document(member.result, "").trajectory();
  EXPECT_EQ(Printed([&](std::FILE* out) { PrintJson(member, out); }), JsonLine(document) + "\n");
}

TEST(MessageJsonTest, IsReadBackAsTheSameMessage) {
  const SolveResult result = Example();
  v1::SolveResult read;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(Text(result), &read).ok());
  EXPECT_TRUE(MessageDifferencer::Equals(read, Document(result, "two tanks")));
}

TEST(MessageJsonTest, GivesBackTheSameBits) {
  SolveResult result;
  result.states = 1;
  std::uint64_t bits = 1;
  while (result.x.size() < 20'000) {
    bits = bits * 6364136223846793005U + 1442695040888963407U;
    const double number = std::bit_cast<double>(bits);
    if (std::isfinite(number)) result.x.push_back(number);
  }
  for (int k = 0; k < 2000; ++k) result.x.push_back(k / 100.0);
  result.x.push_back(-0.0);
  result.times.assign(result.x.size(), 0);
  const std::string text = Text(result);
  const auto read = nlohmann::json::parse(text)["trajectory"]["x"];
  v1::SolveResult message;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(text, &message).ok());
  ASSERT_EQ(read.size(), result.x.size());
  for (std::size_t k = 0; k < result.x.size(); ++k) {
    const auto same = [&](double number) {
      return std::bit_cast<std::uint64_t>(number) == std::bit_cast<std::uint64_t>(result.x[k]);
    };
    EXPECT_TRUE(same(read[k].get<double>()) && same(message.trajectory().x(static_cast<int>(k)))) << result.x[k];
  }
}

TEST(MessageJsonTest, NamesWhatIsNotFinite) {
  SolveResult result = Example();
  result.x[1] = std::numeric_limits<double>::infinity();
  result.x[2] = -std::numeric_limits<double>::infinity();
  result.y[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Text(result), JsonLine(Document(result, "two tanks")) + "\n");
  const auto root = nlohmann::json::parse(Text(result));
  EXPECT_EQ(root["trajectory"]["x"][1], "Infinity");
  EXPECT_EQ(root["trajectory"]["x"][2], "-Infinity");
  EXPECT_EQ(root["trajectory"]["y"][0], "NaN");
}

TEST(MessageJsonTest, HasTheNamesAndDefaultsOfTheContract) {
  const auto root = nlohmann::json::parse(Text(Example()));
  EXPECT_EQ(root["title"], "two tanks");
  EXPECT_EQ(root["job"], "jobs/7");
  EXPECT_EQ(root["summary"]["method"], "METHOD_LAPLACE_ITERATION");
  EXPECT_EQ(root["summary"]["verdict"]["kind"], "VERDICT_KIND_ERROR_UNKNOWN");
  EXPECT_EQ(root["summary"]["verdict"]["success"], false);
  EXPECT_EQ(root["summary"]["cost"]["iterations"], 7);
  EXPECT_EQ(root["summary"]["cost"]["windows"], 0);
  EXPECT_EQ(root["summary"]["cost"]["lcps"], "1099511627776");
  EXPECT_FALSE(root["summary"].contains("failure_time"));
  EXPECT_EQ(root["trajectory"]["left_limits"][0]["index"], 1);
}

TEST(MessageJsonTest, WritesTimesAsRfc3339) {
  v1::SolveJob job;
  job.mutable_create_time()->set_seconds(1'700'000'000);
  EXPECT_EQ(nlohmann::json::parse(JsonLine(job))["create_time"], "2023-11-14T22:13:20Z");
}

}  // namespace
}  // namespace dlcs::client
