// SPDX-License-Identifier: Apache-2.0
// Calls over HTTP/1.1 to a real server: every protocol, rights, bounds, disconnection, and requests that no client
// would send.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <regex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/escaping.h"
#include "dlcs/v1/jobs.grpc.pb.h"
#include "dlcs/v1/problems.grpc.pb.h"
#include "google/protobuf/util/json_util.h"
#include "google/rpc/error_details.pb.h"
#include "grpcpp/generic/generic_stub.h"
#include "nlohmann/json.hpp"
#include "proto/wire/content_hash.h"
#include "server/access/forwarded_caller.h"
#include "server/access/token.h"
#include "server/gateway/rpc_gateway.h"
#include "tests/server/access/all_methods.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/http/http_client.h"
#include "tests/server/service_fixture.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_authority.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using Json = nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::BareConnection;
using ::testing::ElementsAre;
using testing::Fetch;
using ::testing::HasSubstr;
using testing::HttpAnswer;
using testing::HttpCall;
using testing::HttpTls;
using testing::SwitchingRequest;

constexpr char kSolvePath[] = "/dlcs.v1.SolverService/Solve";
constexpr char kCapabilitiesPath[] = "/dlcs.v1.SolverService/GetCapabilities";
constexpr char kListPath[] = "/dlcs.v1.JobService/ListSolveJobs";
const std::string kOwner = "dlcs_token-of-an-owner", kGuest = "dlcs_token-of-a-guest";

std::string ToJson(const google::protobuf::Message& message) {
  std::string json;
  EXPECT_TRUE(google::protobuf::util::MessageToJsonString(message, &json).ok());
  return json;
}

template <typename Message>
Message FromJson(const std::string& json) {
  Message message;
  const auto status = google::protobuf::util::JsonStringToMessage(json, &message);
  EXPECT_TRUE(status.ok()) << status << " in " << json;
  return message;
}

// A message with the prefix of Connect and gRPC-Web.
std::string Framed(const std::string& message, char flags = 0) {
  std::string framed(1, flags);
  for (const int shift : {24, 16, 8, 0}) framed.push_back(static_cast<char>(message.size() >> shift & 0xff));
  return framed + message;
}

struct Frame {
  int flags;
  std::string data;
};
std::vector<Frame> FramesIn(std::string_view body) {
  std::vector<Frame> frames;
  while (body.size() >= 5) {
    std::size_t size = 0;
    for (int k = 1; k <= 4; ++k) size = size << 8 | static_cast<unsigned char>(body[static_cast<std::size_t>(k)]);
    frames.push_back({static_cast<unsigned char>(body[0]), std::string(body.substr(5, size))});
    body.remove_prefix(std::min(body.size(), 5 + size));
  }
  EXPECT_TRUE(body.empty()) << body.size() << " bytes after the last frame";
  return frames;
}

// gRPC-Web's text form: pieces of base64, each padded by itself.
std::string Unbase64(const std::string& text) {
  std::string bytes;
  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = text.find('=', begin);
    end = end == std::string::npos ? text.size() : std::min(text.find_first_not_of('=', end), text.size());
    std::string piece;
    EXPECT_TRUE(absl::Base64Unescape(text.substr(begin, end - begin), &piece));
    bytes += piece;
    begin = end;
  }
  return bytes;
}

// The part of a response that must be the same for every protocol: the trajectory and the end of the solve.
struct Answered {
  std::vector<double> times, x, y, w;
  v1::Termination termination = v1::TERMINATION_UNSPECIFIED;
  bool operator==(const Answered&) const = default;
};
Answered AnswerIn(const std::vector<v1::SolveEvent>& events) {
  Answered answer;
  for (const v1::SolveEvent& event : events) {
    if (event.has_summary()) answer.termination = event.summary().termination();
    if (!event.has_trajectory()) continue;
    const auto append = [](std::vector<double>& to, const auto& from) {
      to.insert(to.end(), from.begin(), from.end());
    };
    append(answer.times, event.trajectory().times());
    append(answer.x, event.trajectory().x());
    append(answer.y, event.trajectory().y());
    append(answer.w, event.trajectory().w());
  }
  return answer;
}

class WebPortTest : public testing::ServiceTest {
 protected:
  void SetUp() override {
    spdlog::set_level(spdlog::level::off);
    Start({});
  }

  void Start(ServerConfig config, bool jobs = true) {
    config.http_listen = "127.0.0.1:0";
    if (jobs) config.store = folder_.File("jobs.db");
    StartServer(config);
    const std::string url = server_->web_url();
    address_ = url.substr(url.find("//") + 2);
    address_.pop_back();
  }

  HttpAnswer Post(const std::string& path, const std::string& content_type, const std::string& body,
                  std::vector<std::pair<std::string, std::string>> headers = {}) const {
    headers.emplace_back("content-type", content_type);
    return Fetch(address_, {.method = "POST", .path = path, .headers = std::move(headers), .body = body}, tls_);
  }
  HttpAnswer PostJson(const std::string& path, const std::string& body = "{}") const {
    return Post(path, "application/json", body);
  }

  static AccessSettings WithUsers(const std::string& file) {
    testing::ReplaceFile(file, "owner submitter " + TokenHashText(kOwner) + "\nguest reader " + TokenHashText(kGuest) +
                                   "\nsensor reader certificate\n");
    AccessSettings access;
    access.tokens = file;
    return access;
  }

  const jobs::testing::TemporaryFolder folder_;
  std::string address_;
  HttpTls tls_;
};

TEST_F(WebPortTest, EveryProtocolGivesTheSameBitsAsGrpc) {
  const v1::SolveRequest request = SwitchingRequest(300);
  const Answered expected = AnswerIn(testing::Solve(*stub_, request).events);
  ASSERT_EQ(expected.termination, v1::TERMINATION_REACHED_END);
  ASSERT_FALSE(expected.x.empty());
  const std::string bytes = request.SerializeAsString();

  const auto parsed = [](const std::vector<Frame>& frames, int end_flag, bool json) {
    std::vector<v1::SolveEvent> events;
    for (const Frame& frame : frames) {
      if (frame.flags == end_flag) continue;
      EXPECT_EQ(frame.flags, 0);
      events.emplace_back();
      if (json) {
        events.back() = FromJson<v1::SolveEvent>(frame.data);
      } else {
        EXPECT_TRUE(events.back().ParseFromString(frame.data));
      }
    }
    EXPECT_EQ(testing::WhatIsWrongWithOrder(events), "");
    return AnswerIn(events);
  };
  const auto connect = FramesIn(Post(kSolvePath, "application/connect+proto", Framed(bytes)).body);
  EXPECT_EQ(parsed(connect, 2, false), expected);
  EXPECT_EQ(connect.back().flags, 2);
  EXPECT_EQ(connect.back().data, "{}");
  const auto connect_json = FramesIn(Post(kSolvePath, "application/connect+json", Framed(ToJson(request))).body);
  EXPECT_EQ(parsed(connect_json, 2, true), expected);
  const auto web = FramesIn(Post(kSolvePath, "application/grpc-web+proto", Framed(bytes)).body);
  EXPECT_EQ(parsed(web, 0x80, false), expected);
  EXPECT_THAT(web.back().data, HasSubstr("grpc-status: 0\r\n"));
  const HttpAnswer text = Post(kSolvePath, "application/grpc-web-text", absl::Base64Escape(Framed(bytes)));
  EXPECT_EQ(text.headers.at("content-type"), "application/grpc-web-text+proto");
  EXPECT_EQ(parsed(FramesIn(Unbase64(text.body)), 0x80, false), expected);

  const HttpAnswer lines = PostJson(kSolvePath, ToJson(request));
  EXPECT_EQ(lines.status, 200);
  EXPECT_EQ(lines.headers.at("content-type"), "application/x-ndjson");
  std::vector<v1::SolveEvent> events;
  std::istringstream stream(lines.body);
  for (std::string line; std::getline(stream, line);) events.push_back(FromJson<v1::SolveEvent>(line));
  EXPECT_EQ(testing::WhatIsWrongWithOrder(events), "");
  EXPECT_EQ(AnswerIn(events), expected);
}

TEST_F(WebPortTest, UnaryCallsAnswerInJsonProtobufAndGrpcWeb) {
  const auto limit = [](const v1::GetCapabilitiesResponse& response) { return response.max_states(); };
  const HttpAnswer json = PostJson(kCapabilitiesPath, "");  // an empty body is an empty message
  EXPECT_EQ(json.status, 200);
  EXPECT_EQ(limit(FromJson<v1::GetCapabilitiesResponse>(json.body)), 1'000'000);
  EXPECT_EQ(Json::parse(json.body)["max_states"], 1'000'000);  // the names of the contract
  v1::GetCapabilitiesResponse response;
  EXPECT_TRUE(response.ParseFromString(Post(kCapabilitiesPath, "application/proto", "").body));
  EXPECT_EQ(limit(response), 1'000'000);
  const auto frames = FramesIn(Post(kCapabilitiesPath, "application/grpc-web", Framed("")).body);
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_TRUE(response.ParseFromString(frames[0].data));
  EXPECT_EQ(limit(response), 1'000'000);
  EXPECT_EQ(frames[1].flags, 0x80);
  EXPECT_EQ(Post("/grpc.health.v1.Health/Check", "application/json", "{}").body, R"({"status":"SERVING"})");
}

TEST_F(WebPortTest, ErrorsHaveCodeFieldAndRule) {
  const HttpAnswer refused = PostJson(kSolvePath, R"({"problem": {"horizon": -1}})");
  EXPECT_EQ(refused.status, 400);
  const Json error = Json::parse(refused.body);
  EXPECT_EQ(error["code"], "invalid_argument");
  google::rpc::BadRequest violations;
  std::string bytes;
  for (const Json& detail : error["details"]) {
    if (detail["type"] != "google.rpc.BadRequest") continue;
    ASSERT_TRUE(absl::Base64Unescape(std::string(detail["value"]), &bytes));
    ASSERT_TRUE(violations.ParseFromString(bytes));
    EXPECT_EQ(detail["debug"]["field_violations"].size(), static_cast<std::size_t>(violations.field_violations_size()));
  }
  ASSERT_GT(violations.field_violations_size(), 0);
  EXPECT_EQ(violations.field_violations(0).field(), "problem.a");

  const HttpAnswer unknown = PostJson(kSolvePath, R"({"problem": {"horizont": 1}})");
  EXPECT_EQ(unknown.status, 400);
  EXPECT_THAT(unknown.body, HasSubstr("horizont"));
  const HttpAnswer missing =
      PostJson("/dlcs.v1.JobService/GetSolveJob", R"({"name": "jobs/aaaaaaaaaaaaaaaaaaaaaaaaaa"})");
  EXPECT_EQ(missing.status, 404);
  EXPECT_EQ(Json::parse(missing.body)["code"], "not_found");

  // In a stream the status follows the messages.
  const auto connect = FramesIn(Post(kSolvePath, "application/connect+json", Framed("{}")).body);
  ASSERT_EQ(connect.size(), 1u);
  EXPECT_EQ(Json::parse(connect[0].data)["error"]["code"], "invalid_argument");
  const auto web = FramesIn(Post(kSolvePath, "application/grpc-web", Framed("")).body);
  ASSERT_EQ(web.size(), 1u);
  EXPECT_THAT(web[0].data, HasSubstr("grpc-status: 3\r\n"));
  EXPECT_THAT(web[0].data, HasSubstr("grpc-status-details-bin: "));
}

// Also those of a file of the contract that comes later.
TEST(RpcGatewayTest, KnowsThePathsOfTheWholeContract) {
  std::vector<std::string> contract = testing::PathsOfAllMethods();
  std::erase_if(contract, [](const std::string& path) { return !path.starts_with("/dlcs.v1."); });
  EXPECT_GT(contract.size(), 12u);
  EXPECT_THAT(RpcGateway::MethodPaths(), ::testing::UnorderedElementsAreArray(contract));
}

TEST_F(WebPortTest, RefusesWhatAProtocolCannotDo) {
  EXPECT_EQ(Post(kSolvePath, "text/plain", "{}").status, 415);
  EXPECT_EQ(Post(kSolvePath, "", "{}").status, 415);
  EXPECT_EQ(Post(kSolvePath, "application/proto", "").status, 415);  // a stream needs envelopes
  EXPECT_THAT(Post(kSolvePath, "application/grpc", "").headers.at("accept-post"),
              HasSubstr("application/connect+json"));
  EXPECT_EQ(Fetch(address_, {.path = kSolvePath}).status, 405);
  EXPECT_EQ(PostJson("/dlcs.v1.SolverService/Nothing").status, 404);
  EXPECT_THAT(PostJson("/dlcs.v1.JobService/ListSolveJob").body,
              HasSubstr("did you mean /dlcs.v1.JobService/ListSolveJobs?"));
  EXPECT_EQ(PostJson("/").status, 405);
  EXPECT_EQ(Fetch(address_, {.path = "/nothing"}).status, 404);
  const auto upload = FramesIn(Post("/dlcs.v1.ProblemService/UploadProblem", "application/grpc-web", Framed("")).body);
  ASSERT_EQ(upload.size(), 1u);
  EXPECT_THAT(upload[0].data, HasSubstr("grpc-status: 12\r\n"));
  EXPECT_EQ(Post("/dlcs.v1.ProblemService/UploadProblem", "application/json", "{}").headers.at("accept-post"),
            "application/connect+json, application/connect+proto");
  EXPECT_EQ(Post(kListPath, "application/json", "{}", {{"content-encoding", "gzip"}}).status, 501);
  EXPECT_EQ(Post(kListPath, "application/json", "{}", {{"connect-timeout-ms", "soon"}}).status, 400);
  EXPECT_EQ(FramesIn(Post(kSolvePath, "application/connect+proto", Framed("") + Framed("")).body)[0].flags, 2);
  EXPECT_THAT(Post(kSolvePath, "application/connect+proto", "abc").body, HasSubstr("inside the prefix"));
  EXPECT_THAT(Post(kSolvePath, "application/connect+proto", Framed("abc").substr(0, 6)).body,
              HasSubstr("inside a message"));
  EXPECT_THAT(Post(kSolvePath, "application/grpc-web-text", "%").body.size(), ::testing::Gt(0u));
}

TEST_F(WebPortTest, SaysThatBytesAreNotTheMessage) {
  const std::string bytes = "\x0a\xff";  // a field that is longer than what is there
  const HttpAnswer unary = Post(kListPath, "application/proto", bytes);
  EXPECT_EQ(unary.status, 400);
  EXPECT_THAT(unary.body, HasSubstr("not a message dlcs.v1.ListSolveJobsRequest"));
  for (const char* path : {kListPath, kSolvePath}) {
    const auto frames = FramesIn(Post(path, "application/grpc-web", Framed(bytes)).body);
    EXPECT_THAT(frames.back().data, HasSubstr("grpc-status: 3\r\n")) << path;
  }
  const auto frames = FramesIn(Post(kSolvePath, "application/connect+proto", Framed(bytes)).body);
  EXPECT_THAT(frames.back().data, HasSubstr("not a message dlcs.v1.SolveRequest"));
}

TEST_F(WebPortTest, UploadsAProblemByConnect) {
  v1::ProblemBody body;
  *body.mutable_problem() = SwitchingRequest(10).problem();
  const std::string problem = body.SerializeAsString();
  v1::UploadProblemRequest first, rest;
  first.mutable_start()->set_bytes(static_cast<std::int64_t>(problem.size()));
  first.mutable_start()->set_sha256(ContentHash(problem));
  rest.set_data(problem);
  const auto frames = FramesIn(Post("/dlcs.v1.ProblemService/UploadProblem", "application/connect+proto",
                                    Framed(first.SerializeAsString()) + Framed(rest.SerializeAsString()))
                                   .body);
  ASSERT_EQ(frames.size(), 2u) << frames.back().data;
  v1::UploadProblemResponse response;
  ASSERT_TRUE(response.ParseFromString(frames[0].data));
  EXPECT_EQ(response.problem().bytes(), static_cast<std::int64_t>(problem.size()));
}

TEST_F(WebPortTest, StoresAProblemInOneCallOfEveryProtocol) {
  constexpr char kCreatePath[] = "/dlcs.v1.ProblemService/CreateProblem";
  const v1::SolveRequest request = SwitchingRequest(100);
  v1::CreateProblemRequest create;
  *create.mutable_problem() = request.problem();
  const std::string bytes = create.SerializeAsString();
  const std::string name = FromJson<v1::StoredProblem>(PostJson(kCreatePath, ToJson(create)).body).name();
  EXPECT_THAT(name, ::testing::MatchesRegex("problems/[0-9a-f]+"));
  const auto named = [](const std::string& message) {
    v1::StoredProblem stored;
    EXPECT_TRUE(stored.ParseFromString(message));
    return stored.name();
  };
  EXPECT_EQ(named(Post(kCreatePath, "application/proto", bytes).body), name);
  EXPECT_EQ(named(FramesIn(Post(kCreatePath, "application/grpc-web", Framed(bytes)).body)[0].data), name);
  const HttpAnswer text = Post(kCreatePath, "application/grpc-web-text", absl::Base64Escape(Framed(bytes)));
  EXPECT_EQ(named(FramesIn(Unbase64(text.body))[0].data), name);

  v1::SolveRequest by_name;
  by_name.set_problem_name(name);
  *by_name.mutable_options() = request.options();
  EXPECT_EQ(AnswerIn(testing::Solve(*stub_, by_name).events), AnswerIn(testing::Solve(*stub_, request).events));
}

TEST_F(WebPortTest, TimeoutsStopASolveThatStillHasAResult) {
  // Only the server measures the time here, and it needs up to half a second to answer.
  const v1::SolveRequest request = testing::EndlessRequest();
  const HttpAnswer stopped = Post(kSolvePath, "application/json", ToJson(request), {{"connect-timeout-ms", "5000"}});
  EXPECT_THAT(stopped.body, HasSubstr("TERMINATION_DEADLINE"));
  const HttpAnswer web =
      Post(kSolvePath, "application/grpc-web", Framed(request.SerializeAsString()), {{"grpc-timeout", "5000m"}});
  EXPECT_THAT(FramesIn(web.body).back().data, HasSubstr("grpc-status: 0\r\n"));
}

TEST_F(WebPortTest, AClientThatLeavesEndsItsSolve) {
  const HttpCall call{.method = "POST",
                      .path = kSolvePath,
                      .headers = {{"content-type", "application/json"}},
                      .body = ToJson(testing::SteppingRequest(20'000'000))};
  BareConnection client(address_);
  ASSERT_TRUE(client.Send(testing::RequestText(call)));
  EXPECT_THAT(client.ReadUntil("accepted"), HasSubstr("200 OK"));
  ASSERT_TRUE(WaitForSolves(1));
  client.Close();
  EXPECT_TRUE(WaitForSolves(0));
}

// The server may parse a request while its call is being destroyed. Found by the address sanitizer, or as a crash.
TEST_F(WebPortTest, AClientThatLeavesAtOnceTakesNoMemoryWithIt) {
  v1::SolveLcpRequest request;
  for (int k = 0; k < 300'000; ++k) request.add_q(k);
  const std::string bytes = request.SerializeAsString();
  for (int k = 0; k < 40; ++k) {
    BareConnection client(address_);
    ASSERT_TRUE(client.Send(testing::RequestText({.method = "POST",
                                                  .path = "/dlcs.v1.SolverService/SolveLcp",
                                                  .headers = {{"content-type", "application/proto"}},
                                                  .body = bytes})));
    client.Close();
  }
  EXPECT_TRUE(testing::Solve(*stub_, SwitchingRequest(20)).status.ok());
}

TEST_F(WebPortTest, AReaderThatStopsReadingHoldsNothingUp) {
  v1::SolveRequest request = testing::ChattyRequest(20'000 / testing::kSlowness);
  BareConnection stalled(address_);
  ASSERT_TRUE(stalled.Send(testing::RequestText({.method = "POST",
                                                 .path = kSolvePath,
                                                 .headers = {{"content-type", "application/json"}},
                                                 .body = ToJson(request)})));
  EXPECT_THAT(stalled.ReadUntil("accepted"), HasSubstr("accepted"));
  EXPECT_TRUE(WaitForSolves(0));                                          // the engine did not wait for the reader
  EXPECT_THAT(stalled.ReadUntil("\r\n0\r\n\r\n"), HasSubstr("summary"));  // and the end arrives
}

TEST_F(WebPortTest, ConnectionsServeMoreThanOneRequest) {
  BareConnection client(address_);
  const std::string request = testing::RequestText(
      {.method = "POST", .path = kListPath, .headers = {{"content-type", "application/json"}}, .body = "{}"});
  for (int k = 0; k < 3; ++k) {
    ASSERT_TRUE(client.Send(request));
    EXPECT_THAT(client.ReadUntil("next_page_token\":\"\"}"), HasSubstr("200 OK"));
  }
  ASSERT_TRUE(client.Send(request + request));  // one behind the other
  EXPECT_THAT(client.ReadUntil("next_page_token\":\"\"}HTTP"), HasSubstr("200 OK"));
  // A client may ask first whether it may send its body.
  BareConnection careful(address_);
  ASSERT_TRUE(careful.Send("POST " + std::string(kListPath) +
                           " HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: 2\r\n"
                           "expect: 100-continue\r\n\r\n"));
  EXPECT_THAT(careful.ReadUntil("\r\n\r\n"), HasSubstr("100 Continue"));
  ASSERT_TRUE(careful.Send("{}"));
  EXPECT_THAT(careful.ReadUntil("next_page_token"), HasSubstr("200 OK"));
}

TEST_F(WebPortTest, BoundsWhatRequestsMayTake) {
  ServerConfig config;
  config.max_message_bytes = 100'000;
  Start(config);
  const HttpAnswer large = PostJson(kListPath, std::string(200'000, ' '));
  EXPECT_EQ(large.status, 429);
  EXPECT_THAT(large.body, HasSubstr("200000 bytes"));
  BareConnection chunked(address_);
  const std::string head = "POST " + std::string(kListPath) +
                           " HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n"
                           "transfer-encoding: chunked\r\n\r\n";
  ASSERT_TRUE(chunked.Send(head));
  for (int k = 0; k < 20 && chunked.Send("2710\r\n" + std::string(10'000, ' ') + "\r\n"); ++k) {
  }
  EXPECT_THAT(chunked.ReadUntil("\r\n\r\n"), HasSubstr("429"));
  EXPECT_EQ(Fetch(address_, {.headers = {{"x-large", std::string(20'000, 'x')}}}).status, 431);
  EXPECT_TRUE(testing::Solve(*stub_, SwitchingRequest(20)).status.ok());
}

TEST_F(WebPortTest, BodiesTakeNotManyTimesTheirSize) {
  const auto begin = std::chrono::steady_clock::now();
  for (const std::string& deep : {R"({"problem": )" + std::string(5'000'000, '['), std::string(101, '{')}) {
    const HttpAnswer answer = PostJson(kSolvePath, deep);
    EXPECT_EQ(answer.status, 400);
    EXPECT_THAT(answer.body, HasSubstr("more than 100 levels"));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, seconds(5) * testing::kSlowness);
  EXPECT_THAT(PostJson(kSolvePath, R"({"title": ")" + std::string(200, '[') + R"("})").body,
              ::testing::Not(HasSubstr("levels")));
  const HttpAnswer many =
      Post("/dlcs.v1.ProblemService/UploadProblem", "application/connect+proto", std::string(5 * 200'000, '\0'));
  EXPECT_THAT(many.body, HasSubstr("more than 131072 messages"));
}

TEST_F(WebPortTest, ErrorsThatRepeatWhatWasSentHaveTheirDetails) {
  for (const HttpAnswer& answer : {PostJson("/dlcs.v1.JobService/GetSolveJob", "{\"name\": \"\xff\"}"),
                                   Post(kListPath, "application/json", "{}", {{"connect-timeout-ms", "\xff"}})}) {
    EXPECT_EQ(answer.status, 400);
    EXPECT_THAT(answer.body, HasSubstr("google.rpc.ErrorInfo"));
  }
}

TEST_F(WebPortTest, SurvivesRequestsThatNoClientWouldSend) {
  for (const std::string bad :
       {"\r\n\r\n\r\n", "GET\r\n\r\n", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", "GET / HTTP/9.9\r\n\r\n",
        "\x16\x03\x01\x02\x00",
        "POST /dlcs.v1.JobService/ListSolveJobs HTTP/1.1\r\nhost: localhost\r\ncontent-length: -1\r\n\r\n",
        "POST /dlcs.v1.JobService/ListSolveJobs HTTP/1.1\r\nhost: localhost\r\ncontent-length: 1\r\n"
        "content-length: 2\r\n\r\nab",
        "POST /dlcs.v1.JobService/ListSolveJobs HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n"
        "transfer-encoding: chunked\r\n\r\nzz\r\n"}) {
    BareConnection client(address_);
    ASSERT_TRUE(client.Send(bad));
    const std::string answer = client.ReadUntil("\r\n\r\n", seconds(15));
    EXPECT_TRUE(answer.empty() || answer.find(" 400 ") != std::string::npos) << bad << "\n" << answer;
  }
  BareConnection half(address_);
  ASSERT_TRUE(half.Send("POST " + std::string(kSolvePath) + " HTTP/1.1\r\nhost: localh"));
  EXPECT_TRUE(half.IsClosed(seconds(20)));
  EXPECT_TRUE(testing::Solve(*stub_, SwitchingRequest(20)).status.ok());
}

// A proxy and this server must agree where a request ends. Otherwise bytes of one client become a request of another.
TEST_F(WebPortTest, RefusesRequestsWithTwoReadings) {
  const std::string head =
      "POST " + std::string(kListPath) + " HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\n";
  const std::string hidden = "GET /hidden HTTP/1.1\r\nhost: localhost\r\n\r\n";
  const std::string chunked = "2\r\n{}\r\n0\r\n\r\n";
  std::string old = head;
  old.replace(old.find("HTTP/1.1"), 8, "HTTP/1.0");
  for (const std::string& request :
       {head + "content-length: 2\r\ntransfer-encoding: chunked\r\n\r\n" + chunked + hidden,
        head + "content-length: 2\r\ntransfer-encoding: xchunked\r\n\r\n{}" + hidden,
        head + "content-length: 2\r\ntransfer-encoding: chunked, identity\r\n\r\n{}" + hidden,
        head + "transfer-encoding: gzip\r\n\r\n" + hidden,
        head + "transfer-encoding: identity, chunked\r\n\r\n" + chunked + hidden,
        old + "transfer-encoding: chunked\r\n\r\n" + chunked + hidden,
        head + "host: evil.example\r\ncontent-length: 2\r\n\r\n{}" + hidden}) {
    BareConnection client(address_);
    ASSERT_TRUE(client.Send(request));
    const std::string answer = client.ReadUntil("There is the page at", seconds(5));
    EXPECT_THAT(answer, HasSubstr("400 Bad Request")) << request;
    EXPECT_THAT(answer, ::testing::Not(HasSubstr("404"))) << request;
  }
}

TEST_F(WebPortTest, AResponseToAnUnreadBodySaysThatTheConnectionEnds) {
  ServerConfig config;
  config.access = WithUsers(folder_.File("tokens.txt"));
  Start(config);
  EXPECT_EQ(PostJson(kListPath).headers["connection"], "close");                 // 401
  EXPECT_EQ(Post(kListPath, "text/html", "{}").headers["connection"], "close");  // 415
  EXPECT_EQ(PostJson("/nothing/Here").headers["connection"], "close");           // 404
  EXPECT_EQ(Post(kListPath, "application/grpc-web", Framed("")).headers["connection"], "close");
}

TEST_F(WebPortTest, AnswersOnlyToItsOwnNames) {
  const auto status = [this](const std::string& host) {
    return Fetch(address_, {.path = "/", .headers = {{"host", host}}}).status;
  };
  for (const char* own : {"localhost", "LOCALHOST:8080", "127.0.0.1:1", "[::1]:8080", "10.0.0.7", "dlcs.localhost"}) {
    EXPECT_EQ(status(own), 200) << own;
  }
  for (const char* foreign : {"evil.example", "localhost.evil.example:80", "127.0.0.1.evil.example", "",
                              "localhost:80@evil.example", "[::1]evil.example", "[localhost]", "[", "localhost:x"}) {
    EXPECT_EQ(status(foreign), 421) << foreign;
  }
  // As proxies send it: the host of the URL counts.
  const auto proxied = [this](const std::string& url, const std::string& host) {
    return Fetch(address_, {.path = url, .headers = {{"host", host}}}).status;
  };
  EXPECT_EQ(proxied("http://localhost:80/", "evil.example"), 200);
  EXPECT_EQ(proxied("HTTP://localhost?q=1", "localhost"), 200);
  EXPECT_EQ(proxied("http://localhost/nothing", "localhost"), 404);
  EXPECT_EQ(proxied("http://evil.example/", "localhost"), 421);
  EXPECT_EQ(proxied("http://localhost@evil.example/", "localhost"), 421);
  ServerConfig config;
  config.http_hosts = "dlcs.example.org, other.example";
  Start(config);
  EXPECT_EQ(status("dlcs.example.org:443"), 200);
  EXPECT_EQ(status("evil.example"), 421);
}

TEST_F(WebPortTest, OtherSitesMayCallOnlyIfTheyAreNamed) {
  const auto preflight = [this](const std::string& origin) {
    return Fetch(address_, {.method = "OPTIONS",
                            .path = kListPath,
                            .headers = {{"origin", origin}, {"access-control-request-method", "POST"}}});
  };
  EXPECT_EQ(preflight("https://plots.example").headers.count("access-control-allow-origin"), 0u);
  ServerConfig config;
  config.http_origins = "https://plots.example";
  Start(config);
  EXPECT_EQ(preflight("https://plots.example").headers.at("access-control-allow-origin"), "https://plots.example");
  EXPECT_EQ(preflight("https://other.example").headers.count("access-control-allow-origin"), 0u);
  const HttpAnswer answer = Post(kListPath, "application/json", "{}", {{"origin", "https://plots.example"}});
  EXPECT_EQ(answer.headers.at("access-control-allow-origin"), "https://plots.example");
  EXPECT_THAT(answer.headers.at("access-control-expose-headers"), HasSubstr("grpc-status-details-bin"));
}

// Collects the lines of the log about calls while it exists, without addresses.
class AuditLines {
 public:
  AuditLines() : before_(spdlog::default_logger()) {
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("audit", std::make_shared<spdlog::sinks::ostream_sink_mt>(text_)));
    spdlog::set_pattern("%v");
    spdlog::set_level(spdlog::level::info);
  }
  ~AuditLines() {
    spdlog::set_default_logger(before_);
    spdlog::set_level(spdlog::level::off);
  }
  std::vector<std::string> lines() const {
    std::vector<std::string> lines;
    std::istringstream text(text_.str());
    for (std::string line; std::getline(text, line);) {
      if (line.rfind("audit", 0) == 0) lines.push_back(std::regex_replace(line, std::regex(":[0-9]+$"), ""));
    }
    return lines;
  }

 private:
  std::ostringstream text_;
  const std::shared_ptr<spdlog::logger> before_;
};

// The code of a call of `path` with an empty message over gRPC.
int CodeOverGrpc(const std::string& address, const std::string& path, const std::string& token,
                 const std::string& forged = "") {
  grpc::GenericStub stub(testing::Connect(address));
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(30));
  if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
  if (!forged.empty()) context.AddMetadata(kForwardedCaller, forged);
  grpc::CompletionQueue queue;
  grpc::ByteBuffer request(nullptr, 0), response;
  const auto call = stub.PrepareUnaryCall(&context, path, request, &queue);
  call->StartCall();
  grpc::Status status;
  call->Finish(&response, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  return static_cast<int>(status.error_code());
}

TEST_F(WebPortTest, RightsAndAuditLinesAreThoseOfGrpc) {
  ServerConfig config;
  config.access = WithUsers(folder_.File("tokens.txt"));
  Start(config);
  for (const std::string& path : testing::PathsOfAllMethods()) {
    if (path.find("Health/Watch") != std::string::npos) continue;  // never ends
    for (const std::string& token : {std::string(), kOwner, kGuest, std::string("wrong")}) {
      int over_grpc = 0, over_http = 0;
      std::vector<std::string> grpc_lines, http_lines;
      {
        const AuditLines audit;
        over_grpc = CodeOverGrpc(server_->address(), path, token);
        grpc_lines = audit.lines();
      }
      {
        const AuditLines audit;
        std::vector<std::pair<std::string, std::string>> headers;
        if (!token.empty()) headers.emplace_back("authorization", "Bearer " + token);
        const auto frames = FramesIn(Post(path, "application/grpc-web", Framed(""), headers).body);
        ASSERT_FALSE(frames.empty()) << path;
        ASSERT_EQ(std::sscanf(frames.back().data.c_str(), "grpc-status: %d", &over_http), 1);
        http_lines = audit.lines();
      }
      if (path.find("UploadProblem") != std::string::npos && over_http == 12) continue;  // no such stream over gRPC-Web
      EXPECT_EQ(over_http, over_grpc) << path << " with " << token;
      EXPECT_EQ(http_lines, grpc_lines) << path << " with " << token;
    }
  }
}

TEST_F(WebPortTest, NobodyForgesWhoCalls) {
  EXPECT_EQ(CodeOverGrpc(server_->address(), kListPath, "", "forged"), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(Post(kListPath, "application/json", "{}", {{kForwardedCaller, "Zm9yZ2Vk"}}).status, 403);
  EXPECT_EQ(Post(kListPath, "application/json", "{}", {{"DLCS-Forwarded-Caller-Bin", ""}}).status, 403);
  const ForwardingKey key, other;
  const ForwardedCaller caller{"ipv4:1.2.3.4:5", {"sensor", "a:b", ""}};
  const auto decoded = key.Decode(key.Encode(caller));
  ASSERT_TRUE(decoded.has_value());
  EXPECT_EQ(decoded->peer, caller.peer);
  EXPECT_EQ(decoded->certificate_names, caller.certificate_names);
  EXPECT_FALSE(other.Decode(key.Encode(caller)).has_value());
  EXPECT_FALSE(key.Decode("").has_value());
  EXPECT_FALSE(key.Decode(key.Encode(caller) + "7:short").has_value());
}

TEST_F(WebPortTest, CertificatesNameUsersOverHttps) {
  const testing::TestAuthority authority, foreign;
  const testing::Issued own = authority.Issue("localhost");
  testing::ReplaceFile(folder_.File("server.key"), own.key);
  testing::ReplaceFile(folder_.File("server.pem"), own.certificate);
  testing::ReplaceFile(folder_.File("ca.pem"), authority.certificate());
  ServerConfig config;
  config.access = WithUsers(folder_.File("tokens.txt"));
  config.access.tls_cert = folder_.File("server.pem");
  config.access.tls_key = folder_.File("server.key");
  config.access.tls_client_ca = folder_.File("ca.pem");
  Start(config);
  EXPECT_THAT(server_->web_url(), HasSubstr("https://"));
  tls_.authority = authority.certificate();
  EXPECT_EQ(PostJson(kListPath).status, 0);  // no handshake without a certificate
  const auto with = [this](const testing::Issued& issued) {
    tls_.certificate = issued.certificate;
    tls_.key = issued.key;
    return PostJson(kListPath).status;
  };
  EXPECT_EQ(with(foreign.Issue("sensor")), 0);
  EXPECT_EQ(with(authority.Issue("nobody")), 401);
  EXPECT_EQ(with(authority.Issue("sensor")), 200);
  // The handler gets the same name: a reader may not submit.
  EXPECT_EQ(PostJson(kSolvePath, ToJson(SwitchingRequest(10))).status, 403);
}

TEST_F(WebPortTest, AnEnsembleIsAJob) {
  const v1::SolveRequest solve = testing::SwitchingRequest(50);
  v1::CreateEnsembleJobRequest request;
  *request.mutable_ensemble()->mutable_problem() = solve.problem();
  *request.mutable_ensemble()->mutable_options() = solve.options();
  for (int k = 0; k < 5; ++k) request.mutable_ensemble()->add_members()->add_x0(k);
  request.set_shard_members(2);
  const HttpAnswer created = PostJson("/dlcs.v1.JobService/CreateEnsembleJob", ToJson(request));
  ASSERT_EQ(created.status, 200) << created.body;
  const std::string name = Json::parse(created.body)["name"];
  const HttpAnswer read =
      PostJson("/dlcs.v1.JobService/ReadEnsemble", R"({"name": ")" + name + R"(", "follow": true})");
  EXPECT_EQ(read.status, 200);
  int members = 0;
  bool complete = false;
  std::istringstream lines(read.body);
  for (std::string line; std::getline(lines, line);) {
    const auto page = FromJson<v1::EnsemblePage>(line);
    members += page.shard().outcomes_size();
    complete = page.complete();
  }
  EXPECT_EQ(members, 5);
  EXPECT_TRUE(complete);
}

TEST_F(WebPortTest, AShutdownDeliversWhatIsSolved) {
  std::thread solving([this] {
    const HttpAnswer answer = PostJson(kSolvePath, ToJson(testing::SteppingRequest(20'000'000)));
    EXPECT_THAT(answer.body, HasSubstr("The server is shutting down"));
  });
  ASSERT_TRUE(WaitForSolves(1));
  server_->Stop(seconds(20));
  solving.join();
}

TEST(WebPortProcessTest, AThousandIdleWatchersAreCheap) {
  const jobs::testing::TemporaryFolder folder;
  testing::DlcsdProcess dlcsd({"--listen", "127.0.0.1:0", "--store", folder.File("jobs.db"), "--http-listen",
                               "127.0.0.1:0", "--max-watches-per-user", "2000", "--max-concurrent-solves", "1"});
  ASSERT_NE(dlcsd.ReadAddress(), "");
  const std::string page = dlcsd.ReadLine();
  const std::size_t scheme = page.find("http://");
  ASSERT_NE(scheme, std::string::npos) << page;
  const std::string address = page.substr(scheme + 7, page.size() - scheme - 8);
  const auto post = [&](const std::string& path, const std::string& body) {
    return HttpCall{.method = "POST", .path = path, .headers = {{"content-type", "application/json"}}, .body = body};
  };
  // The second of two jobs waits for the first, whose grid is small beside the memory that is allowed.
  std::string name;
  for (const char* id : {"first", "second"}) {
    v1::CreateSolveJobRequest request;
    *request.mutable_solve() = testing::EndlessRequest();
    request.mutable_solve()->mutable_options()->set_steps(1'000'000);
    request.set_request_id(id);
    const HttpAnswer created = Fetch(address, post("/dlcs.v1.JobService/CreateSolveJob", ToJson(request)));
    ASSERT_EQ(created.status, 200) << created.body;
    name = Json::parse(created.body)["name"];
  }
  const std::string watch =
      testing::RequestText(post("/dlcs.v1.JobService/WatchSolveJob", R"({"name": ")" + name + R"("})"));
  std::vector<std::unique_ptr<BareConnection>> watchers;
  const auto add = [&](int count) {
    for (int k = 0; k < count; ++k) {
      watchers.push_back(std::make_unique<BareConnection>(address));
      ASSERT_TRUE(watchers.back()->Send(watch));
      ASSERT_THAT(watchers.back()->ReadUntil("QUEUED"), HasSubstr("200 OK"));
    }
  };
  add(50);  // memory that only the first ones allocate
  // The running job allocates its memory first.
  std::int64_t before = 0;
  for (int k = 0; k < 100 && std::abs(dlcsd.ResidentBytes() - before) > 1 << 18; ++k) {
    before = dlcsd.ResidentBytes();
    std::this_thread::sleep_for(milliseconds(500));
  }
  add(1000);
  EXPECT_LT(dlcsd.ResidentBytes() - before, 50 << 20);
}

}  // namespace
}  // namespace dlcs
