// SPDX-License-Identifier: Apache-2.0
// What the service costs on top of the engine: the same solve in this process and through a server over
// loopback, and the rate of its streams beside a bare gRPC stream that sends the same messages.
//
//     service_bench [--quick] [Google Benchmark's flags]
//
// Times are wall-clock times; beside them stands the processor time of the whole process, server and client,
// which says on a busy machine what the wall clock cannot.

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client/local/local_backend.h"
#include "client/rpc/client.h"
#include "dlcs/v1/solver.grpc.pb.h"
#include "grpcpp/security/server_credentials.h"
#include "grpcpp/server_builder.h"
#include "server/dlcs_server.h"
#include "server/wire/convert.h"
#include "spdlog/spdlog.h"
#include "tests/bench/bench_support.h"
#include "tests/support/problems.h"

namespace dlcs::bench {
namespace {

using client::Client;
using client::SolveResult;
using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct Case {
  std::string name;
  Problem problem;
  Options options;

  v1::SolveRequest Request() const {
    v1::SolveRequest request;
    *request.mutable_problem() = ToProto(problem);
    *request.mutable_options() = ToProto(options);
    return request;
  }
};

Case MakeCase(const std::string& name, Method method, Index steps, Index output_times) {
  Case result{name, testing::FourVariableEasy(), {}};
  result.options.method = method;
  result.options.num_steps = steps;
  result.options.estimate_error = false;
  result.options.num_threads = 1;
  result.options.output_times_only = output_times > 0;
  for (Index k = 1; k <= output_times; ++k) {
    result.options.output_times.push_back(result.problem.horizon * static_cast<double>(k) /
                                          static_cast<double>(output_times));
  }
  return result;
}

// Solves of some 10 and 100 ms: with their whole trajectory, 64 bytes a step, and with 100 times of it.
std::vector<Case> OverheadCases() {
  return {MakeCase("march 10 ms, 100 times", Method::kExponentialIntegrator, 24'000, 100),
          MakeCase("march 10 ms, all times", Method::kExponentialIntegrator, 24'000, 0),
          MakeCase("march 100 ms, all times", Method::kExponentialIntegrator, 240'000, 0),
          MakeCase("iteration 10 ms, all times", Method::kLaplaceIteration, 6'000, 0),
          MakeCase("iteration 100 ms, all times", Method::kLaplaceIteration, 60'000, 0)};
}

std::string WhatIsWrong(const absl::StatusOr<SolveResult>& result, std::size_t times) {
  if (!result.ok()) return std::string(result.status().message());
  if (result->summary.termination() != v1::TERMINATION_REACHED_END) return result->summary.message();
  if (result->times.size() != times) return "times are missing";
  return "";
}

void SolveInEngine(benchmark::State& state, const Case& the_case) {
  for (auto _ : state) {
    if (!SolveOrSkip(state, the_case.problem, the_case.options)) return;
  }
}

void SolveThroughBackend(benchmark::State& state, const Case& the_case, client::Backend& backend) {
  const std::optional<Solution> expected = SolveOrSkip(state, the_case.problem, the_case.options);
  if (!expected) return;
  const v1::SolveRequest request = the_case.Request();
  for (auto _ : state) {
    const absl::StatusOr<SolveResult> result = backend.Solve(request, {}, {});
    const std::string wrong = WhatIsWrong(result, expected->times.size());
    if (wrong.empty() && result->x.back() == expected->x(expected->x.rows() - 1, expected->x.cols() - 1)) continue;
    return state.SkipWithError(wrong.empty() ? "other bits than the engine's" : wrong.c_str());
  }
}

// Sends given events and nothing else: what gRPC can do with these messages.
class BareService final : public v1::SolverService::CallbackService {
 public:
  std::vector<v1::SolveEvent> events;

  grpc::ServerWriteReactor<v1::SolveEvent>* Solve(grpc::CallbackServerContext*, const v1::SolveRequest*) override {
    class Reactor final : public grpc::ServerWriteReactor<v1::SolveEvent> {
     public:
      explicit Reactor(const std::vector<v1::SolveEvent>& sent) : events_(sent) { OnWriteDone(true); }
      void OnWriteDone(bool ok) override {
        if (!ok || next_ == events_.size()) return Finish(grpc::Status::OK);
        StartWrite(&events_[next_++]);
      }
      void OnDone() override { delete this; }

     private:
      const std::vector<v1::SolveEvent>& events_;
      std::size_t next_ = 0;
    };
    return new Reactor(events);
  }
};

// The events of one kind that a solve sends, and how fast they come.
struct Stream {
  std::string name;
  Case the_case;
  bool (v1::SolveEvent::*is_counted)() const;
};

std::vector<Stream> Streams() {
  Case chatty = MakeCase("", Method::kLaplaceIteration, 4'000, 1);
  chatty.options.window_steps = 1;
  return {{"trajectory", MakeCase("", Method::kExponentialIntegrator, 1'000'000, 0), &v1::SolveEvent::has_trajectory},
          {"iterates", std::move(chatty), &v1::SolveEvent::has_iterate}};
}

// Calls `backend`, and counts messages and bytes from the first counted event to the end.
void ReadStream(benchmark::State& state, const Stream& stream, client::Backend& backend) {
  const v1::SolveRequest request = stream.the_case.Request();
  double messages = 0, bytes = 0, missed = 0, seconds = 0;
  for (auto _ : state) {
    Clock::time_point first;
    double events = 0;
    const auto result = backend.Solve(request,
                                      [&](const v1::SolveEvent& event) {
                                        missed += static_cast<double>(event.gap().iterates());
                                        if (!(event.*stream.is_counted)()) return;
                                        // The first message starts the clock and does not count.
                                        if (events++ == 0) {
                                          first = Clock::now();
                                          return;
                                        }
                                        bytes += static_cast<double>(event.ByteSizeLong());
                                      },
                                      {});
    if (!result.ok()) return state.SkipWithError(std::string(result.status().message()).c_str());
    state.SetIterationTime(SecondsSince(first));
    seconds += SecondsSince(first);
    messages += events - 1;
  }
  state.counters["messages_per_s"] = messages / seconds;
  state.counters["bytes_per_s"] = bytes / seconds;
  state.counters["missed"] = missed;
}

void Register(const std::string& name, bool quick, std::function<void(benchmark::State&)> run, bool manual = false) {
  benchmark::internal::Benchmark* const bench = benchmark::RegisterBenchmark(name.c_str(), std::move(run));
  bench->Unit(benchmark::kMillisecond)
      ->MinTime(quick ? 0.05 : 0.2)
      ->Repetitions(quick ? 7 : 15)
      ->MeasureProcessCPUTime();
  if (manual) {
    bench->UseManualTime();
  } else {
    bench->UseRealTime();
  }
}

int Main(int argc, char** argv) {
  const bool quick = TakeFlag(argc, argv, "--quick");
  spdlog::set_level(spdlog::level::off);
  ServerConfig config;
  config.listen = "127.0.0.1:0";
  const std::unique_ptr<DlcsServer> server = *DlcsServer::Start(config);
  const auto service_client = *Client::Connect(server->address());
  client::LocalBackend local;

  const std::vector<Case> cases = OverheadCases();
  for (const Case& the_case : cases) {
    const std::string name = "overhead/" + the_case.name + "/";
    Register(name + "engine", quick, [&](benchmark::State& state) { SolveInEngine(state, the_case); });
    Register(name + "local", quick, [&](benchmark::State& state) { SolveThroughBackend(state, the_case, local); });
    Register(name + "service", quick,
             [&](benchmark::State& state) { SolveThroughBackend(state, the_case, *service_client); });
  }

  struct Bare {
    BareService service;
    std::unique_ptr<grpc::Server> server;
    std::unique_ptr<Client> client;
  };
  std::vector<std::unique_ptr<Bare>> bares;
  const std::vector<Stream> streams = Streams();
  for (const Stream& stream : streams) {
    Bare& bare = *bares.emplace_back(std::make_unique<Bare>());
    const auto recorded = local.Solve(stream.the_case.Request(),
                                      [&](const v1::SolveEvent& event) { bare.service.events.push_back(event); }, {});
    if (!recorded.ok()) return 1;
    int port = 0;
    grpc::ServerBuilder builder;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&bare.service);
    bare.server = builder.BuildAndStart();
    bare.client = *Client::Connect("127.0.0.1:" + std::to_string(port));
    const std::string name = "stream/" + stream.name + "/";
    Register(
        name + "engine", quick, [&](benchmark::State& state) { ReadStream(state, stream, local); }, true);
    Register(
        name + "service", quick, [&](benchmark::State& state) { ReadStream(state, stream, *service_client); }, true);
    Register(
        name + "bare", quick, [&](benchmark::State& state) { ReadStream(state, stream, *bare.client); }, true);
  }
  return RunAll(argc, argv, Order::kShuffled);
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) { return dlcs::bench::Main(argc, argv); }
