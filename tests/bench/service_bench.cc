// SPDX-License-Identifier: Apache-2.0
// What the service costs on top of the engine: the same solve in this process and through a server over
// loopback; iterates of a job that are watched with all their values; and streams beside a bare gRPC stream of the same
// messages.
//
//     service_bench [--quick] [Google Benchmark's flags]
//
// The servers run in a process of their own, as in use. Times are wall-clock times; beside them stand the processor
// times of a run, `processor_ms` of both processes and `server_ms` of the servers alone, which say on a busy machine
// what the wall clock cannot. A run of one way follows runs of the others, so that they share what disturbs them.

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <ctime>
#include <functional>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "absl/synchronization/mutex.h"
#include "client/local/local_backend.h"
#include "client/rpc/client.h"
#include "core/models/signorini.h"
#include "core/parallel/memory_pages.h"
#include "core/solve.h"
#include "dlcs/v1/solver.grpc.pb.h"
#include "grpcpp/security/server_credentials.h"
#include "grpcpp/server_builder.h"
#include "server/dlcs_server.h"
#include "server/solve_jobs/watch_view.h"
#include "server/wire/convert.h"
#include "spdlog/spdlog.h"
#include "tests/bench/bench_support.h"
#include "tests/server/store/temporary_folder.h"
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
  int runs = 1;  // in one repetition
  int most_repetitions = 15;

  v1::SolveRequest Request() const {
    v1::SolveRequest request;
    *request.mutable_problem() = ToProto(problem);
    *request.mutable_options() = ToProto(options);
    return request;
  }
};

Case MakeCase(std::string name, Problem problem, Method method, Index steps, Index output_times, int runs) {
  Case result{.name = std::move(name), .problem = std::move(problem), .options = {}, .runs = runs};
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

Problem Membrane(Index cells) {
  SignoriniModel model;
  model.cells = cells;
  return MakeSignoriniProblem(model).value();
}

std::vector<Case> OverheadCases() {
  using testing::FourVariableEasy;
  return {MakeCase("march, 100 pairs, all times", DensePairs(4, 100), Method::kExponentialIntegrator, 870, 0, 10),
          MakeCase("march, 100 pairs, 100 states, all times", DensePairs(100, 100), Method::kExponentialIntegrator, 250,
                   0, 10),
          MakeCase("march, 4 pairs, 100 times", FourVariableEasy(), Method::kExponentialIntegrator, 24'000, 100, 10),
          MakeCase("march, 4 pairs, 24,000 times", FourVariableEasy(), Method::kExponentialIntegrator, 24'000, 0, 10),
          MakeCase("iteration, 4 pairs, 6,000 times", FourVariableEasy(), Method::kLaplaceIteration, 6'000, 0, 10)};
}

// Iterations whose y at every time is watched. The solve of dense matrices takes seconds; that of the membrane, whose
// matrices need no products, hardly more than to copy its iterates some times.
std::vector<Case> IterateCases() {
  std::vector<Case> cases{MakeCase("dense, 255 pairs", DensePairs(20, 255), Method::kLaplaceIteration, 400, 1, 1),
                          MakeCase("membrane, 255 pairs", Membrane(256), Method::kLaplaceIteration, 400, 1, 2),
                          MakeCase("membrane, one window", Membrane(256), Method::kLaplaceIteration, 400, 1, 1)};
  cases.front().most_repetitions = 3;
  cases.back().options.window_steps = Options::kWholeHorizon;
  return cases;
}

// The events of one kind that a solve sends, and how fast they come.
struct Stream {
  std::string name;
  Case the_case;
  bool (v1::SolveEvent::*is_counted)() const;
};

std::vector<Stream> Streams() {
  using testing::FourVariableEasy;
  Case chatty = MakeCase("", FourVariableEasy(), Method::kLaplaceIteration, 4'000, 1, 1);
  chatty.options.window_steps = 1;
  return {{"trajectory", MakeCase("", FourVariableEasy(), Method::kExponentialIntegrator, 250'000, 0, 1),
           &v1::SolveEvent::has_trajectory},
          {"iterates", std::move(chatty), &v1::SolveEvent::has_iterate}};
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

// The events that the streams and, after them, the watched iterates consist of.
std::vector<std::vector<v1::SolveEvent>> RecordedEvents() {
  std::vector<std::vector<v1::SolveEvent>> recorded;
  client::LocalBackend local;
  for (const Stream& stream : Streams()) {
    std::vector<v1::SolveEvent>& events = recorded.emplace_back();
    local.Solve(stream.the_case.Request(), [&](const v1::SolveEvent& event) { events.push_back(event); }, {}).value();
  }
  class Recorder final : public Observer {
   public:
    void OnIterate(const IterateReport& report, const IterateValues& values) override {
      v1::SolveEvent& event = events.emplace_back();
      *event.mutable_iterate() = ToProto(report);
      std::string bytes = event.SerializeAsString();
      AppendValues(values, {.most_times = values.times.size()}, bytes);
      event.ParseFromString(bytes);
    }
    std::vector<v1::SolveEvent> events;
  };
  for (const Case& the_case : IterateCases()) {
    Recorder recorder;
    Solve(the_case.problem, the_case.options, recorder, {}).value();
    recorder.events.emplace_back().mutable_summary()->set_termination(v1::TERMINATION_REACHED_END);
    recorded.push_back(std::move(recorder.events));
  }
  return recorded;
}

// A server of `dlcsd`, and one for each recorded stream, in a process of their own.
class Servers {
 public:
  Servers() {
    std::array<int, 2> ends{};
    if (pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
    process_ = fork();
    if (process_ == 0) {
      close(ends[0]);
      Serve(folder_.File("jobs.db"), ends[1]);
    }
    close(ends[1]);
    std::string text;
    std::array<char, 4096> read_bytes{};
    for (ssize_t size; (size = read(ends[0], read_bytes.data(), read_bytes.size())) > 0;) {
      text.append(read_bytes.data(), static_cast<std::size_t>(size));
      if (text.ends_with('\n')) break;
    }
    std::istringstream words(text);
    for (std::string address; words >> address;) clients_.push_back(*Client::Connect(address));
    if (process_ < 0 || clients_.empty() || clock_getcpuclockid(process_, &clock_) != 0) {
      throw std::runtime_error("no servers");
    }
  }
  ~Servers() {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  Servers(const Servers&) = delete;
  Servers& operator=(const Servers&) = delete;

  Client& dlcsd() { return *clients_.front(); }
  Client& bare(std::size_t recorded) { return *clients_.at(1 + recorded); }
  double ProcessorSeconds() const {
    timespec time{};
    clock_gettime(clock_, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

 private:
  // Writes the addresses as a line, and serves until it is killed.
  [[noreturn]] static void Serve(const std::string& store, int output) {
    RetainFreedMemory();  // as dlcsd does
    ServerConfig config;
    config.listen = "127.0.0.1:0";
    config.store = store;
    config.setup_cache_bytes = 0;  // as the engine has none
    const std::unique_ptr<DlcsServer> server = *DlcsServer::Start(config);
    std::string addresses = server->address();
    std::vector<std::unique_ptr<BareService>> services;
    std::vector<std::unique_ptr<grpc::Server>> bare;
    for (std::vector<v1::SolveEvent>& events : RecordedEvents()) {
      services.emplace_back(std::make_unique<BareService>())->events = std::move(events);
      int port = 0;
      grpc::ServerBuilder builder;
      builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
      builder.RegisterService(services.back().get());
      bare.push_back(builder.BuildAndStart());
      addresses += " 127.0.0.1:" + std::to_string(port);
    }
    addresses += '\n';
    if (write(output, addresses.data(), addresses.size()) < 0) _exit(1);
    for (;;) pause();
  }

  const jobs::testing::TemporaryFolder folder_;
  pid_t process_ = -1;
  clockid_t clock_{};
  std::vector<std::unique_ptr<Client>> clients_;
};

// Counts the processor time of the runs of `state`.
class ProcessorMeter {
 public:
  ProcessorMeter(benchmark::State& state, const Servers& servers) : state_(state), servers_(servers) {}
  ~ProcessorMeter() {
    const auto runs = static_cast<double>(state_.iterations());
    const double server = servers_.ProcessorSeconds() - server_;
    state_.counters["server_ms"] = 1e3 * server / runs;
    state_.counters["processor_ms"] = 1e3 * (ProcessorSeconds() - client_ + server) / runs;
  }

 private:
  benchmark::State& state_;
  const Servers& servers_;
  const double client_ = ProcessorSeconds();
  const double server_ = servers_.ProcessorSeconds();
};

void SolveInEngine(benchmark::State& state, const Case& the_case, const Servers& servers) {
  const ProcessorMeter meter(state, servers);
  for (auto _ : state) {
    if (!SolveOrSkip(state, the_case.problem, the_case.options)) return;
  }
}

std::string WhatIsWrong(const absl::StatusOr<SolveResult>& result, const Solution& expected) {
  if (!result.ok()) return std::string(result.status().message());
  if (result->summary.termination() != v1::TERMINATION_REACHED_END) return result->summary.message();
  if (result->times.size() != expected.times.size()) return "times are missing";
  if (!std::equal(result->y.begin(), result->y.end(), expected.y.data())) return "other bits than the engine's";
  return "";
}

void SolveThroughBackend(benchmark::State& state, const Case& the_case, client::Backend& backend,
                         const Servers& servers) {
  const std::optional<Solution> expected = SolveOrSkip(state, the_case.problem, the_case.options);
  if (!expected) return;
  const v1::SolveRequest request = the_case.Request();
  absl::StatusOr<SolveResult> result = backend.Solve(request, {}, {});  // warms the connection
  {
    const ProcessorMeter meter(state, servers);
    for (auto _ : state) result = backend.Solve(request, {}, {});
  }
  if (const std::string wrong = WhatIsWrong(result, *expected); !wrong.empty()) state.SkipWithError(wrong.c_str());
}

// Runs the solve as a job, and watches it.
void WatchJob(benchmark::State& state, const Case& the_case, v1::WatchView view, Servers& servers) {
  v1::CreateSolveJobRequest request;
  *request.mutable_solve() = the_case.Request();
  client::JobClient& jobs = servers.dlcsd().jobs();
  double iterates = 0, values = 0, missed = 0;
  const ProcessorMeter meter(state, servers);
  for (auto _ : state) {
    const absl::StatusOr<v1::SolveJob> job = jobs.Submit(request, {});
    if (!job.ok()) return state.SkipWithError(std::string(job.status().message()).c_str());
    v1::WatchSolveJobRequest watch;
    watch.set_name(job->name());
    watch.set_view(view);
    const absl::Status watched = jobs.Watch(watch,
                                            [&](const v1::SolveEvent& event) {
                                              const v1::Gap& gap = event.gap();
                                              if (event.has_gap())
                                                missed +=
                                                    static_cast<double>(gap.last_sequence() - gap.first_sequence() + 1);
                                              iterates += event.has_iterate() ? 1 : 0;
                                              values += event.iterate().y_size();
                                            },
                                            {});
    if (!watched.ok()) return state.SkipWithError(std::string(watched.message()).c_str());
  }
  const auto runs = static_cast<double>(state.iterations());
  state.counters["iterates"] = iterates / runs;
  state.counters["values_bytes"] = 8 * values / runs;
  state.counters["missed"] = missed;
}

// Reads a bare stream to its end.
void ReadBare(benchmark::State& state, const Case& the_case, Client& bare, const Servers& servers) {
  const v1::SolveRequest request = the_case.Request();
  const ProcessorMeter meter(state, servers);
  for (auto _ : state) {
    if (const auto result = bare.Solve(request, {}, {}); !result.ok()) {
      return state.SkipWithError(std::string(result.status().message()).c_str());
    }
  }
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

int Main(int argc, char** argv) {
  const bool quick = TakeFlag(argc, argv, "--quick");
  spdlog::set_level(spdlog::level::off);
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);  // as in dlcs and dlcsd
  Servers servers;                                                      // before this process has threads
  RetainFreedMemory();
  client::LocalBackend local;

  const int most_repetitions = quick ? 5 : 15;
  const auto add = [&](const std::string& name, const Case& the_case, std::function<void(benchmark::State&)> run) {
    return benchmark::RegisterBenchmark(name.c_str(), std::move(run))
        ->Unit(benchmark::kMillisecond)
        ->Iterations(the_case.runs)
        ->Repetitions(std::min(most_repetitions, the_case.most_repetitions));
  };

  const std::vector<Case> overhead = OverheadCases();
  for (const Case& the_case : overhead) {
    const auto add_way = [&](const std::string& way, std::function<void(benchmark::State&)> run) {
      add("overhead/" + the_case.name + "/" + way, the_case, std::move(run))->UseRealTime();
    };
    add_way("engine", [&](benchmark::State& state) { SolveInEngine(state, the_case, servers); });
    add_way("local", [&](benchmark::State& state) { SolveThroughBackend(state, the_case, local, servers); });
    add_way("service",
            [&](benchmark::State& state) { SolveThroughBackend(state, the_case, servers.dlcsd(), servers); });
  }

  const std::vector<Stream> streams = Streams();
  for (std::size_t k = 0; k < streams.size(); ++k) {
    const auto add_way = [&, k](const std::string& way, client::Backend& backend) {
      add("stream/" + streams[k].name + "/" + way, streams[k].the_case, [&, k](benchmark::State& state) {
        ReadStream(state, streams[k], backend);
      })->UseManualTime();
    };
    add_way("engine", local);
    add_way("service", servers.dlcsd());
    add_way("bare", servers.bare(k));
  }

  const std::vector<Case> iterations = IterateCases();
  for (std::size_t k = 0; k < iterations.size(); ++k) {
    const Case& the_case = iterations[k];
    const auto add_way = [&](const std::string& way, std::function<void(benchmark::State&)> run) {
      add("iterates/" + the_case.name + "/" + way, the_case, std::move(run))->UseRealTime();
    };
    add_way("engine", [&](benchmark::State& state) { SolveInEngine(state, the_case, servers); });
    add_way("job", [&](benchmark::State& state) { WatchJob(state, the_case, v1::WATCH_VIEW_RESIDUALS, servers); });
    add_way("full", [&](benchmark::State& state) { WatchJob(state, the_case, v1::WATCH_VIEW_FULL, servers); });
    Client& bare = servers.bare(streams.size() + k);
    add_way("bare", [&](benchmark::State& state) { ReadBare(state, the_case, bare, servers); });
  }
  return RunAll(argc, argv, Order::kShuffled);
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) { return dlcs::bench::Main(argc, argv); }
