// SPDX-License-Identifier: Apache-2.0
// Metrics, probes and the log of a real server, as monitoring sees them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "dlcs/v1/jobs.grpc.pb.h"
#include "grpcpp/impl/codegen/client_unary_call.h"
#include "nlohmann/json.hpp"
#include "proto/wire/trace_context.h"
#include "server/session/version.h"
#include "server/telemetry/job_trace.h"
#include "spdlog/spdlog.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/http/http_client.h"
#include "tests/server/service_fixture.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using std::chrono::seconds;
using testing::DlcsdProcess;
using testing::Get;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr char kTraceparentOfTest[] = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01";
constexpr char kTraceIdOfTest[] = "0af7651916cd43dd8448eb211c80319c";

// The value of a series as it is written, name{label="value",...}; -1 where there is none.
double Value(const std::string& metrics, const std::string& series) {
  std::istringstream lines(metrics);
  for (std::string line; std::getline(lines, line);) {
    if (line.compare(0, series.size() + 1, series + " ") == 0) return std::stod(line.substr(series.size()));
  }
  return -1;
}

class TelemetryTest : public testing::ServiceTest {
 protected:
  void SetUp() override {
    spdlog::set_level(spdlog::level::off);  // passing tests print nothing
    ServerConfig config;
    config.store = folder_.File("jobs.db");
    config.metrics_listen = "127.0.0.1:0";
    config.max_constraints = 100;
    StartServer(config);
    jobs_ = v1::JobService::NewStub(testing::Connect(server_->address()));
  }

  std::string Metrics() const { return Get(server_->metrics_address(), "/metrics").body; }

  // Returns the metrics as soon as `series` is `value`. gRPC counts a call a moment after its caller has the answer.
  std::string MetricsWhen(const std::string& series, double value) const {
    std::string metrics = Metrics();
    for (int i = 0; i < 3000 && Value(metrics, series) != value; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      metrics = Metrics();
    }
    EXPECT_EQ(Value(metrics, series), value) << series << " in\n" << metrics;
    return metrics;
  }

  // Submits a job and watches it to its end.
  void RunJob(const v1::SolveRequest& solve) {
    v1::CreateSolveJobRequest request;
    *request.mutable_solve() = solve;
    v1::SolveJob job;
    grpc::ClientContext create;
    testing::SetDeadline(create, seconds(60));
    const grpc::Status created = jobs_->CreateSolveJob(&create, request, &job);
    ASSERT_TRUE(created.ok()) << created.error_message();
    grpc::ClientContext watch;
    testing::SetDeadline(watch, seconds(60));
    v1::WatchSolveJobRequest wanted;
    wanted.set_name(job.name());
    const auto reader = jobs_->WatchSolveJob(&watch, wanted);
    for (v1::SolveEvent event; reader->Read(&event);) {
    }
    ASSERT_TRUE(reader->Finish().ok());
  }

  const jobs::testing::TemporaryFolder folder_;
  std::unique_ptr<v1::JobService::Stub> jobs_;
};

TEST_F(TelemetryTest, CountsCallsByMethodAndCode) {
  ASSERT_TRUE(testing::Solve(*stub_, testing::SwitchingRequest(100)).status.ok());
  v1::GetSolveJobRequest request;
  request.set_name("jobs/aaaaaaaaaaaaaaaaaaaaaaaaaa");
  v1::SolveJob job;
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(60));
  ASSERT_EQ(jobs_->GetSolveJob(&context, request, &job).error_code(), grpc::StatusCode::NOT_FOUND);

  MetricsWhen("dlcs_rpcs_total{code=\"NOT_FOUND\",method=\"dlcs.v1.JobService/GetSolveJob\"}", 1);
  const std::string metrics = MetricsWhen("dlcs_rpcs_total{code=\"OK\",method=\"dlcs.v1.SolverService/Solve\"}", 1);
  EXPECT_EQ(Value(metrics, "dlcs_rpc_duration_seconds_count{method=\"dlcs.v1.SolverService/Solve\"}"), 1);
  EXPECT_EQ(Value(metrics, "dlcs_rpcs_in_flight{method=\"dlcs.v1.SolverService/Solve\"}"), 0);
  EXPECT_GT(Value(metrics, "dlcs_events_sent_total{method=\"dlcs.v1.SolverService/Solve\"}"), 2);
}

TEST_F(TelemetryTest, CountsMethodsThatThereAreNotUnderOneName) {
  const auto channel = testing::Connect(server_->address());
  for (const char* name : {"/no.such.Service/Method", "/dlcs.v1.SolverService/NoSuch", "/a\"b\nc/d"}) {
    grpc::ClientContext context;
    testing::SetDeadline(context, seconds(60));
    v1::GetSolveJobRequest request;
    v1::SolveJob response;
    const grpc::internal::RpcMethod method(name, grpc::internal::RpcMethod::NORMAL_RPC);
    EXPECT_FALSE((grpc::internal::BlockingUnaryCall<v1::GetSolveJobRequest, v1::SolveJob>(channel.get(), method,
                                                                                          &context, request, &response)
                      .ok()));
  }
  const std::string metrics = MetricsWhen("dlcs_rpcs_in_flight{method=\"unknown\"}", 0);
  EXPECT_GE(Value(metrics, "dlcs_rpcs_total{code=\"UNIMPLEMENTED\",method=\"unknown\"}"), 2);
  EXPECT_THAT(metrics, Not(HasSubstr("NoSuch")));
}

TEST_F(TelemetryTest, CountsACallThatIsUnderWayAndItsCancellation) {
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(60));
  const auto reader = stub_->Solve(&context, testing::SteppingRequest(20'000'000));
  ASSERT_TRUE(WaitForSolves(1));
  const std::string in_flight = "dlcs_rpcs_in_flight{method=\"dlcs.v1.SolverService/Solve\"}";
  std::string metrics = MetricsWhen(in_flight, 1);
  EXPECT_EQ(Value(metrics, "dlcs_solves_running"), 1);
  // The result is counted shortly after the solve has released its slot.
  for (int k = 0; k < 500 && Value(metrics, "dlcs_held_result_bytes") <= 1e6; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    metrics = MetricsWhen(in_flight, 1);
  }
  EXPECT_GT(Value(metrics, "dlcs_held_result_bytes"), 1e6);
  context.TryCancel();
  ASSERT_TRUE(WaitForSolves(0));
  MetricsWhen("dlcs_rpcs_total{code=\"CANCELLED\",method=\"dlcs.v1.SolverService/Solve\"}", 1);
}

TEST_F(TelemetryTest, CountsWhatSolvesAndJobsDid) {
  ASSERT_TRUE(testing::Solve(*stub_, testing::SwitchingRequest(100)).status.ok());
  RunJob(testing::SwitchingRequest(100));
  MetricsWhen("dlcs_jobs_finished_total{outcome=\"succeeded\"}", 1);
  const std::string metrics = MetricsWhen("dlcs_jobs_running", 0);
  EXPECT_EQ(Value(metrics, "dlcs_solve_steps_total"), 200);
  EXPECT_GE(Value(metrics, "dlcs_solve_lcps_total"), 200);
  EXPECT_GT(Value(metrics, "dlcs_solve_seconds_total{phase=\"setup\"}"), 0);
  // The same method has the same name in both.
  std::smatch found;
  ASSERT_TRUE(std::regex_search(metrics, found, std::regex("dlcs_solves_total\\{kind=\"call\",method=\"([a-z-]+)\"")));
  for (const char* kind : {"call", "job"}) {
    EXPECT_EQ(Value(metrics, "dlcs_solves_total{kind=\"" + std::string(kind) + "\",method=\"" + found[1].str() +
                                 "\",termination=\"REACHED_END\"}"),
              1);
  }
  EXPECT_GT(Value(metrics, "dlcs_events_sent_total{method=\"dlcs.v1.JobService/WatchSolveJob\"}"), 3);
  for (const char* name : {"dlcs_jobs_queued", "dlcs_jobs_queued_core_seconds", "dlcs_jobs_oldest_queued_seconds"}) {
    MetricsWhen(name, 0);  // the store is asked once a second
  }
  EXPECT_EQ(Value(metrics, "dlcs_store_healthy"), 1);
  for (const char* operation : {"Create", "Claim", "Finish", "ReadEvents"}) {
    EXPECT_GE(
        Value(metrics, "dlcs_store_operation_duration_seconds_count{operation=\"" + std::string(operation) + "\"}"), 1)
        << operation;
  }
  EXPECT_GE(Value(metrics, "dlcs_setup_cache_misses_total"), 1);
  EXPECT_GE(Value(metrics, "dlcs_setup_cache_hits_total"), 1);
  EXPECT_GT(Value(metrics, "process_resident_memory_bytes"), 1e6);
  EXPECT_GT(Value(metrics, "process_cpu_seconds_total"), 0);
  EXPECT_THAT(metrics, HasSubstr("dlcs_build_info{version=\"" DLCS_VERSION "\""));
}

TEST_F(TelemetryTest, SaysHowTheProgramWasMade) {
  grpc::ClientContext context;
  testing::SetDeadline(context, seconds(60));
  v1::GetCapabilitiesResponse response;
  ASSERT_TRUE(stub_->GetCapabilities(&context, v1::GetCapabilitiesRequest(), &response).ok());
  EXPECT_EQ(response.build(), BuildText());
  EXPECT_THAT(Metrics(), HasSubstr(std::string("revision=\"") + kBuild.revision + "\""));
}

// Checks the format as far as that is possible without Prometheus: every family occurs once, with help and type, before
// its samples.
TEST_F(TelemetryTest, IsTextThatPrometheusReads) {
  RunJob(testing::SwitchingRequest(100));
  const testing::HttpAnswer page = Get(server_->metrics_address(), "/metrics");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.headers.at("content-type"), "text/plain; version=0.0.4; charset=utf-8");
  std::istringstream lines(page.body);
  std::set<std::string> families;
  std::string family;
  for (std::string line; std::getline(lines, line);) {
    std::smatch found;
    if (std::regex_match(line, found, std::regex("# (HELP|TYPE) ([a-z_]+) (.+)"))) {
      family = found[2];
      if (found[1] == "TYPE") {
        EXPECT_TRUE(families.insert(family).second) << family << " is there twice";
        EXPECT_EQ(found[3] == "counter", family.ends_with("_total")) << family;
      }
      continue;
    }
    ASSERT_TRUE(std::regex_match(line, found, std::regex("([a-z_]+)(\\{.*\\})? [-+.0-9a-zA-Z]+"))) << line;
    EXPECT_EQ(found[1].str().compare(0, family.size(), family), 0) << line << " among samples of " << family;
  }
  EXPECT_GT(families.size(), 20U);
}

TEST_F(TelemetryTest, ProbesFollowTheStoreAndTheDrain) {
  const std::string address = server_->metrics_address();
  EXPECT_EQ(Get(address, "/livez").status, 200);
  EXPECT_EQ(Get(address, "/readyz").status, 200);
  MetricsWhen("dlcs_store_healthy", 1);
  EXPECT_EQ(Get(address, "/readyz/jobs").status, 200);
  std::filesystem::rename(folder_.File("jobs.db"), folder_.File("elsewhere.db"));
  MetricsWhen("dlcs_store_healthy", 0);
  EXPECT_EQ(Get(address, "/readyz").status, 200);
  EXPECT_EQ(Get(address, "/readyz/jobs").status, 503);
  EXPECT_THAT(Get(address, "/readyz/jobs").body, HasSubstr("the job store does not answer"));
  server_->Drain();
  EXPECT_EQ(Get(address, "/readyz").status, 503);
  EXPECT_EQ(Get(address, "/livez").status, 200);
  EXPECT_EQ(Get(address, "/nothing").status, 404);
}

TEST_F(TelemetryTest, ATakenPortIsAClearError) {
  ServerConfig config;
  config.listen = "127.0.0.1:0";
  config.metrics_listen = server_->metrics_address();
  const auto second = DlcsServer::Start(config);
  EXPECT_EQ(second.status().code(), absl::StatusCode::kAlreadyExists);
  EXPECT_THAT(std::string(second.status().message()), HasSubstr("--metrics-listen"));
}

// Lines of the log of a server that ran one solve, one job and one call that was refused, all in one trace.
std::string LogOf(const std::vector<std::string>& flags) {
  const jobs::testing::TemporaryFolder folder;
  std::vector<std::string> all = {"--listen", "127.0.0.1:0", "--store", folder.File("jobs.db")};
  all.insert(all.end(), flags.begin(), flags.end());
  DlcsdProcess dlcsd(all);
  const auto channel = testing::Connect(dlcsd.ReadAddress());
  const auto context = [] {
    auto made = std::make_unique<grpc::ClientContext>();
    testing::SetDeadline(*made, seconds(60));
    made->AddMetadata(kTraceparent, kTraceparentOfTest);
    return made;
  };
  const auto solver = v1::SolverService::NewStub(channel);
  const auto solve_context = context();
  const auto reader = solver->Solve(solve_context.get(), testing::SwitchingRequest(100));
  for (v1::SolveEvent event; reader->Read(&event);) {
  }
  EXPECT_TRUE(reader->Finish().ok());

  const auto jobs = v1::JobService::NewStub(channel);
  v1::CreateSolveJobRequest create;
  *create.mutable_solve() = testing::SwitchingRequest(100);
  v1::SolveJob job;
  EXPECT_TRUE(jobs->CreateSolveJob(context().get(), create, &job).ok());
  v1::WatchSolveJobRequest watch;
  watch.set_name(job.name());
  const auto watch_context = context();
  const auto events = jobs->WatchSolveJob(watch_context.get(), watch);
  for (v1::SolveEvent event; events->Read(&event);) {
  }
  EXPECT_TRUE(events->Finish().ok());

  v1::GetSolveJobRequest get;
  get.set_name("jobs/a \"quoted\"\nline break \x01");
  EXPECT_EQ(jobs->GetSolveJob(context().get(), get, &job).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  v1::SolveRequest wrong = testing::SwitchingRequest(100);
  wrong.mutable_problem()->mutable_f()->Clear();
  EXPECT_FALSE(testing::Solve(*solver, wrong).status.ok());
  dlcsd.Signal(SIGTERM);
  EXPECT_EQ(dlcsd.Wait(), 0);
  return dlcsd.ReadErrors();
}

TEST(LogTest, JsonHasOneObjectALineWithItsFields) {
  std::istringstream log(LogOf({"--log-format", "json", "--log-level", "debug"}));
  std::map<std::string, nlohmann::json> last;  // of each message, the last with a trace where there is one
  for (std::string line; std::getline(log, line);) {
    const nlohmann::json json = nlohmann::json::parse(line, nullptr, false);
    ASSERT_TRUE(json.is_object()) << line;
    EXPECT_TRUE(
        std::regex_match(json.value("time", ""), std::regex("\\d{4}-\\d\\d-\\d\\dT\\d\\d:\\d\\d:\\d\\d\\.\\d{6}Z")))
        << line;
    EXPECT_NE(json.value("level", ""), "") << line;
    const std::string message = json.value("message", "") + " " + json.value("method", "");
    if (json.contains("trace_id") || !last.contains(message)) last[message] = json;
  }
  const nlohmann::json call = last["call finished dlcs.v1.SolverService/Solve"];
  EXPECT_EQ(call.value("trace_id", ""), kTraceIdOfTest) << call;
  EXPECT_EQ(call.value("code", ""), "OK");
  EXPECT_EQ(call.value("level", ""), "debug");
  EXPECT_TRUE(call["seconds"].is_number()) << call;
  const nlohmann::json create = last["call finished dlcs.v1.JobService/CreateSolveJob"];
  EXPECT_THAT(create.value("job", ""), HasSubstr("jobs/")) << create;
  EXPECT_EQ(create.value("trace_id", ""), kTraceIdOfTest);
  bool has_solve = false, has_job = false;
  for (const auto& [message, json] : last) {
    if (message.starts_with("solve finished")) {
      has_solve = true;
      EXPECT_EQ(json.value("trace_id", ""), kTraceIdOfTest) << json;
      EXPECT_EQ(json.value("steps", 0), 100);
      EXPECT_EQ(json.value("solve", ""), call.value("solve", "-")) << json;
    }
    if (message.starts_with("job finished")) {
      has_job = true;
      EXPECT_EQ(json.value("job", ""), create.value("job", "-")) << json;
      EXPECT_EQ(json.value("outcome", ""), "succeeded");
      EXPECT_EQ(json.value("trace_id", ""), kTraceIdOfTest) << json;
      EXPECT_TRUE(json["seconds"].is_number()) << json;
    }
  }
  EXPECT_TRUE(has_solve);
  EXPECT_TRUE(has_job);
}

TEST(LogTest, TextIsForPeopleAndCallsAreToldAtDebugOnly) {
  const std::string log = LogOf({});
  EXPECT_THAT(log, HasSubstr(" info job finished job=jobs/"));
  EXPECT_THAT(log, HasSubstr(" info solve finished solve=solve-"));
  EXPECT_THAT(log, HasSubstr(" trace_id=0af7651916cd43dd8448eb211c80319c"));
  EXPECT_THAT(log, Not(HasSubstr("call finished")));
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_TRUE(std::regex_search(line, std::regex("^\\d{4}-\\d\\d-\\d\\d \\d\\d:\\d\\d:\\d\\d\\.\\d{3} [a-z]+ ")))
        << line;
  }
}

TEST(JobTraceTest, IsPassedOverByWhoeverReadsTheRequest) {
  const v1::SolveRequest request = testing::SwitchingRequest(100);
  const std::string stored = WithTraceId(request.SerializeAsString(), kTraceIdOfTest);
  EXPECT_EQ(TraceIdIn(stored), kTraceIdOfTest);
  v1::SolveRequest read;
  ASSERT_TRUE(read.ParseFromString(stored));
  read.DiscardUnknownFields();
  EXPECT_EQ(read.SerializeAsString(), request.SerializeAsString());
  EXPECT_EQ(WithTraceId("request", ""), "request");
  EXPECT_EQ(TraceIdIn(request.SerializeAsString()), "");
  EXPECT_EQ(TraceIdIn(""), "");
}

TEST(TraceContextTest, ReadsWhatTheStandardAllowsAndNothingElse) {
  EXPECT_EQ(TraceIdOf(kTraceparentOfTest), kTraceIdOfTest);
  EXPECT_EQ(TraceIdOf("01-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01-more"), kTraceIdOfTest);
  for (const char* wrong : {"", "00", "00-0AF7651916CD43DD8448EB211C80319C-b7ad6b7169203331-01",
                            "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01-more",
                            "ff-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01",
                            "00-00000000000000000000000000000000-b7ad6b7169203331-01",
                            "00-0af7651916cd43dd8448eb211c80319c-0000000000000000-01",
                            "00-0af7651916cd43dd8448eb211c8031\n9-b7ad6b7169203331-01",
                            "00_0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"}) {
    EXPECT_EQ(TraceIdOf(wrong), "") << wrong;
  }
  const std::string id = NewTraceId();
  EXPECT_EQ(TraceIdOf(TraceparentOf(id)), id);
  EXPECT_NE(NewTraceId(), id);
}

}  // namespace
}  // namespace dlcs
