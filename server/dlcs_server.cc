// SPDX-License-Identifier: Apache-2.0
#include "server/dlcs_server.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "fmt/format.h"
#include "grpc/health/v1/health.pb.h"
#include "grpcpp/ext/proto_server_reflection_plugin.h"
#include "grpcpp/health_check_service_interface.h"
#include "grpcpp/impl/server_builder_option.h"
#include "grpcpp/security/server_credentials.h"
#include "grpcpp/server.h"
#include "grpcpp/server_builder.h"
#include "server/access/access.h"
#include "server/access/credentials.h"
#include "server/gateway/web_port.h"
#include "server/http/http_server.h"
#include "server/net/connection_listener.h"
#include "server/net/listen_address.h"
#include "server/rpc/call_environment.h"
#include "server/rpc/job_service.h"
#include "server/rpc/problem_service.h"
#include "server/rpc/solver_service.h"
#include "server/rpc/unimplemented_service.h"
#include "server/solve_jobs/job_limits.h"
#include "server/solve_jobs/rank_launcher.h"
#include "server/telemetry/metrics.h"
#include "server/telemetry/monitoring_pages.h"
#include "server/telemetry/rpc_telemetry.h"
#include "spdlog/spdlog.h"

namespace dlcs {
namespace {

using std::chrono::milliseconds;

// Both are process-wide and must be done before the first ServerBuilder. A static object that registers reflection
// would be lost to the linker's --as-needed; so would the description of the health service, which nothing else here
// names.
void InitializePlugins() {
  static const bool once = [] {
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    static_cast<void>(grpc::health::v1::HealthCheckRequest::descriptor());
    return true;
  }();
  static_cast<void>(once);
}

// Disables reflection for one server.
class WithoutReflection final : public grpc::ServerBuilderOption {
  void UpdateArguments(grpc::ChannelArguments* /*arguments*/) override {}
  void UpdatePlugins(std::vector<std::unique_ptr<grpc::ServerBuilderPlugin>>* plugins) override {
    std::erase_if(*plugins, [](const std::unique_ptr<grpc::ServerBuilderPlugin>& plugin) {
      return dynamic_cast<const grpc::reflection::ProtoServerReflectionPlugin*>(plugin.get()) != nullptr;
    });
  }
};

void SetChannelArguments(const AccessSettings& access, grpc::ServerBuilder& builder) {
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, access.max_streams_per_connection);
  // By default a client that connects and sends nothing keeps its connection for two minutes.
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, 20'000);
  // Notice a broken link within 15 s instead of minutes, and let clients ping as often; gRPC's default disconnects an
  // idle client that pings every 30 s.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 5'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 10'000);
}

// Errors: InvalidArgument if other machines could read the traffic.
absl::Status CheckEncryption(const char* flag, const ListenAddress& address, const AccessSettings& access) {
  if (!access.tls_cert.empty() || access.insecure_listen || IsLoopback(address)) return absl::OkStatus();
  return absl::InvalidArgumentError(
      fmt::format("{} {}: other machines can reach this address, so that --tls-cert and --tls-key must be given; or "
                  "--insecure-listen, where the network is trusted or a proxy encrypts; or listen on 127.0.0.1",
                  flag, ToString(address)));
}

// The same for both addresses. Errors: also as ParseListenAddress().
absl::Status CheckEncryption(const ServerConfig& config) {
  const absl::StatusOr<ListenAddress> address = ParseListenAddress(config.listen);
  if (!address.ok()) return address.status();
  if (absl::Status encrypted = CheckEncryption("--listen", *address, config.access); !encrypted.ok()) return encrypted;
  if (config.http_listen.empty()) return absl::OkStatus();
  const absl::StatusOr<ListenAddress> web = ParseHostPort(config.http_listen);
  return web.ok() ? CheckEncryption("--http-listen", *web, config.access) : web.status();
}

absl::Status AtFlag(const char* flag, const absl::Status& status) {
  return absl::Status(status.code(), fmt::format("{}: {}", flag, std::string(status.message())));
}

class RunningServer final : public DlcsServer {
 public:
  // `config` is valid and resolved.
  RunningServer(const ServerConfig& config, std::unique_ptr<Access> access);
  ~RunningServer() override;

  absl::Status Listen(const ServerConfig& config, ListenAddress address);

  const std::string& address() const override { return address_; }
  const std::string& metrics_address() const override { return metrics_address_; }
  std::string web_url() const override;
  int solves() const override { return environment_.admission.solves(); }
  std::chrono::microseconds JobsIdleFor() const override {
    return environment_.jobs ? environment_.jobs->manager().idle_for() : std::chrono::microseconds(0);
  }

  void Drain() override;
  bool WaitUntilIdle(milliseconds timeout) override { return environment_.calls.WaitUntilComputed(timeout); }
  void Stop(milliseconds delivery) override;
  void Reload() override { access_->Refresh(); }

 private:
  // Gives the health service the state of the store.
  void SetHealthOfJobs();
  // Keeps it up to date.
  void WatchHealth(const std::stop_token& stop);
  ServerState State() const;
  MonitoringPages Pages() const;
  absl::Status StartMetrics(const std::string& listen);
  absl::Status StartWebPort(const ServerConfig& config);

  void RegisterServices(grpc::ServerBuilder& builder);

  const std::unique_ptr<Access> access_;
  const bool takes_calls_;
  Metrics metrics_;
  std::atomic<bool> draining_ = false;
  CallEnvironment environment_;
  // Null without a store.
  std::unique_ptr<JobService> job_service_;
  std::unique_ptr<ProblemService> problem_service_;
  SolverService solver_service_;
  UnimplementedService refusal_;  // instead of all others on a server that serves no calls
  std::string address_;
  std::shared_ptr<grpc::ServerCredentials> credentials_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<ConnectionListener> listener_;
  std::jthread health_;
  // Null if not served. They use the others.
  std::unique_ptr<WebPort> web_;
  std::string metrics_address_;
  std::unique_ptr<HttpServer> metrics_server_;
};

RunningServer::RunningServer(const ServerConfig& config, std::unique_ptr<Access> access)
    : access_(std::move(access)),
      takes_calls_(config.role != "worker"),
      environment_(config, *access_, metrics_),
      job_service_(environment_.jobs ? std::make_unique<JobService>(environment_) : nullptr),
      problem_service_(environment_.jobs ? std::make_unique<ProblemService>(environment_) : nullptr),
      solver_service_(environment_, job_service_.get()) {}

absl::Status RunningServer::Listen(const ServerConfig& config, ListenAddress address) {
  grpc::ServerBuilder builder;
  SetChannelArguments(config.access, builder);
  builder.SetMaxReceiveMessageSize(static_cast<int>(config.max_message_bytes));
  RegisterServices(builder);
  credentials_ = CredentialsFor(*access_);
  absl::StatusOr<std::unique_ptr<ConnectionListener>> listener = ConnectionListener::Open(address);
  if (!listener.ok()) return listener.status();
  using Outside = grpc::ServerBuilder::experimental_type::ExternalConnectionType;
  const std::shared_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor =
      builder.experimental().AddExternalConnectionAcceptor(Outside::FROM_FD, credentials_);
  if (!config.reflection) builder.SetOption(std::make_unique<WithoutReflection>());
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(NewRpcTelemetry(metrics_, *access_));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  server_ = builder.BuildAndStart();
  if (server_ == nullptr) return absl::UnavailableError("gRPC cannot start: see the log");
  address_ = ToString(address);
  // Before the first call: probes report that a service without a status does not exist.
  if (takes_calls_) {
    server_->GetHealthCheckService()->SetServingStatus(v1::SolverService::service_full_name(), true);
  }
  if (environment_.jobs) {
    SetHealthOfJobs();
    health_ = std::jthread([this](const std::stop_token& stop) { WatchHealth(stop); });
  }
  listener_ = *std::move(listener);
  listener_->Start([acceptor](int listening, int connection) {
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
    parameters.listener_fd = listening;
    parameters.fd = connection;
    acceptor->HandleNewConnection(&parameters);
  });
  if (absl::Status metrics = StartMetrics(config.metrics_listen); !metrics.ok()) return metrics;
  if (absl::Status web = StartWebPort(config); !web.ok()) return web;
  return absl::OkStatus();
}

void RunningServer::RegisterServices(grpc::ServerBuilder& builder) {
  if (!takes_calls_) {
    builder.RegisterCallbackGenericService(&refusal_);
    return;
  }
  builder.RegisterService(&solver_service_);
  if (!job_service_) return;
  builder.RegisterService(job_service_.get());
  builder.RegisterService(problem_service_.get());
}

ServerState RunningServer::State() const {
  ServerState state;
  state.solves = environment_.admission.solves();
  state.max_solves = environment_.admission.max_solves();
  state.web_connections = web_ == nullptr ? 0 : web_->connections();
  state.held_result_bytes = environment_.admission.held_result_bytes();
  state.setups = environment_.SetupStatistics();
  if (const JobBackend* jobs = environment_.jobs.get()) state.jobs = {jobs->manager().load(), jobs->StoreHealthy()};
  return state;
}

absl::Status RunningServer::StartMetrics(const std::string& listen) {
  if (listen.empty()) return absl::OkStatus();
  absl::StatusOr<ListenAddress> address = ParseHostPort(listen);
  if (!address.ok()) return AtFlag("--metrics-listen", address.status());
  auto server = HttpServer::Start(*address, {.threads = 1, .max_held_bytes = 0}, NewMonitoringHandler(Pages()));
  if (!server.ok()) return AtFlag("--metrics-listen", server.status());
  metrics_address_ = ToString(*address);
  metrics_server_ = *std::move(server);
  return absl::OkStatus();
}

absl::Status RunningServer::StartWebPort(const ServerConfig& config) {
  if (config.http_listen.empty()) return absl::OkStatus();
  WebPortOptions options;
  options.listen = config.http_listen;
  options.origins = SplitList(config.http_origins);
  options.hosts = SplitList(config.http_hosts);
  options.max_message_bytes = static_cast<std::size_t>(config.max_message_bytes);
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);
  absl::StatusOr<std::unique_ptr<WebPort>> web =
      WebPort::Start(options, *access_, server_->InProcessChannel(arguments));
  if (!web.ok()) return AtFlag("--http-listen", web.status());
  web_ = *std::move(web);
  return absl::OkStatus();
}

std::string RunningServer::web_url() const {
  if (web_ == nullptr) return "";
  return fmt::format("{}://{}/", access_->Tls() ? "https" : "http", web_->address());
}

MonitoringPages RunningServer::Pages() const {
  MonitoringPages pages;
  pages.metrics = [this] { return metrics_.Text(State()); };
  pages.why_not_ready = [this]() -> std::string { return draining_ ? "shutting down" : ""; };
  pages.why_no_jobs = [this]() -> std::string {
    if (!environment_.jobs) return "this server has no jobs: it has no --store";
    if (draining_) return "shutting down";
    return environment_.jobs->manager().Healthy() ? "" : "the job store does not answer";
  };
  return pages;
}

RunningServer::~RunningServer() { Stop(milliseconds(0)); }

void RunningServer::SetHealthOfJobs() {
  const bool healthy = environment_.jobs->manager().Healthy();
  for (const char* service : {v1::JobService::service_full_name(), v1::ProblemService::service_full_name()}) {
    server_->GetHealthCheckService()->SetServingStatus(service, healthy);
  }
}

void RunningServer::WatchHealth(const std::stop_token& stop) {
  constexpr milliseconds kEvery{250};
  std::mutex mutex;
  std::condition_variable_any changed;
  std::unique_lock lock(mutex);
  while (!changed.wait_for(lock, stop, kEvery, [&] { return stop.stop_requested(); })) SetHealthOfJobs();
}

void RunningServer::Drain() {
  draining_ = true;
  environment_.calls.Drain();
  health_ = {};  // ends it
  grpc::HealthCheckServiceInterface& health = *server_->GetHealthCheckService();
  if (takes_calls_) health.SetServingStatus(v1::SolverService::service_full_name(), false);
  if (environment_.jobs) health.SetServingStatus(v1::JobService::service_full_name(), false);
  if (environment_.jobs && takes_calls_) health.SetServingStatus(v1::ProblemService::service_full_name(), false);
  health.SetServingStatus(false);
}

void RunningServer::Stop(milliseconds delivery) {
  if (server_ == nullptr) return;
  Drain();
  environment_.calls.StopAll(StopCause::kShutdown);
  // Running jobs are released to the store with the part solved so far.
  if (environment_.jobs) environment_.jobs->manager().Drain(milliseconds(0));
  // If watchers and readers were cancelled, they would not know that the server shuts down and not try another one.
  environment_.calls.WaitUntilIdle(delivery);
  listener_.reset();
  // What the calls have sent may still be on its way to slow readers.
  if (web_ != nullptr) web_->Close(std::min(delivery, milliseconds(1000)));
  web_.reset();
  // Cancels the remaining calls: readers that do not read, and streams of the health service, which never end.
  server_->Shutdown(std::chrono::system_clock::now() + milliseconds(100));
  server_->Wait();
  server_.reset();
}

}  // namespace

absl::Status DlcsServer::Check(const ServerConfig& config) {
  if (absl::Status valid = Validate(config); !valid.ok()) return valid;
  if (absl::Status encrypted = CheckEncryption(config); !encrypted.ok()) return encrypted;
  if (absl::Status ranks = CheckRankSettings(RankSettingsOf(config)); !ranks.ok()) return ranks;
  return Access::Check(config.access);
}

absl::StatusOr<std::unique_ptr<DlcsServer>> DlcsServer::Start(const ServerConfig& config) {
  if (absl::Status valid = Validate(config); !valid.ok()) return valid;
  absl::StatusOr<ListenAddress> address = ParseListenAddress(config.listen);
  if (!address.ok()) return address.status();
  if (absl::Status can_listen = CheckCanListen(*address); !can_listen.ok()) return can_listen;
  if (absl::Status encrypted = CheckEncryption(config); !encrypted.ok()) return encrypted;
  if (absl::Status ranks = CheckRankSettings(RankSettingsOf(config)); !ranks.ok()) return ranks;
  absl::StatusOr<std::unique_ptr<Access>> access = Access::Open(config.access);
  if (!access.ok()) return access.status();
  if (config.access.insecure_listen && !IsLoopback(*address)) {
    spdlog::warn("--insecure-listen: requests and results{} are sent on {} without encryption",
                 config.access.tokens.empty() ? "" : ", and the tokens of users,", ToString(*address));
  }

  if (!config.mpi_launcher.empty() && !IsLoopback({.host = config.mpi_host})) {
    spdlog::warn("--mpi-host {}: problems and results go to and from ranks without encryption, as among the ranks",
                 config.mpi_host);
  }

  InitializePlugins();
  auto server = std::make_unique<RunningServer>(Resolved(config), *std::move(access));
  if (absl::Status listening = server->Listen(config, *address); !listening.ok()) return listening;
  return server;
}

}  // namespace dlcs
