// SPDX-License-Identifier: Apache-2.0
#include "server/dlcs_server.h"

#include <condition_variable>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "fmt/format.h"
#include "grpc/health/v1/health.pb.h"
#include "grpcpp/ext/proto_server_reflection_plugin.h"
#include "grpcpp/health_check_service_interface.h"
#include "grpcpp/impl/server_builder_option.h"
#include "grpcpp/security/server_credentials.h"
#include "grpcpp/server_builder.h"
#include "server/access/credentials.h"
#include "server/net/connection_listener.h"
#include "server/net/listen_address.h"
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
absl::Status CheckEncryption(const ListenAddress& address, const AccessSettings& access) {
  if (!access.tls_cert.empty() || access.insecure_listen || IsLoopback(address)) return absl::OkStatus();
  return absl::InvalidArgumentError(fmt::format(
      "--listen {}: other machines can reach this address, so that --tls-cert and --tls-key must be given; or "
      "--insecure-listen, where the network is trusted or a proxy encrypts; or listen on 127.0.0.1",
      ToString(address)));
}

}  // namespace

absl::Status DlcsServer::Check(const ServerConfig& config) {
  if (absl::Status valid = Validate(config); !valid.ok()) return valid;
  const absl::StatusOr<ListenAddress> address = ParseListenAddress(config.listen);
  if (!address.ok()) return address.status();
  if (absl::Status encrypted = CheckEncryption(*address, config.access); !encrypted.ok()) return encrypted;
  return Access::Check(config.access);
}

absl::StatusOr<std::unique_ptr<DlcsServer>> DlcsServer::Start(const ServerConfig& config) {
  if (absl::Status valid = Validate(config); !valid.ok()) return valid;
  absl::StatusOr<ListenAddress> address = ParseListenAddress(config.listen);
  if (!address.ok()) return address.status();
  if (absl::Status can_listen = CheckCanListen(*address); !can_listen.ok()) return can_listen;
  if (absl::Status encrypted = CheckEncryption(*address, config.access); !encrypted.ok()) return encrypted;
  absl::StatusOr<std::unique_ptr<Access>> access = Access::Open(config.access);
  if (!access.ok()) return access.status();
  if (config.access.insecure_listen && !IsLoopback(*address)) {
    spdlog::warn("--insecure-listen: requests and results{} are sent on {} without encryption",
                 config.access.tokens.empty() ? "" : ", and the tokens of users,", ToString(*address));
  }

  InitializePlugins();
  std::unique_ptr<DlcsServer> result(new DlcsServer(Resolved(config), *std::move(access)));
  grpc::ServerBuilder builder;
  SetChannelArguments(config.access, builder);
  builder.SetMaxReceiveMessageSize(static_cast<int>(config.max_message_bytes));
  result->RegisterServices(builder);
  result->credentials_ = CredentialsFor(*result->access_);
  absl::StatusOr<std::unique_ptr<ConnectionListener>> listener = ConnectionListener::Open(*address);
  if (!listener.ok()) return listener.status();
  using Outside = grpc::ServerBuilder::experimental_type::ExternalConnectionType;
  auto acceptor = builder.experimental().AddExternalConnectionAcceptor(Outside::FROM_FD, result->credentials_);
  if (!config.reflection) builder.SetOption(std::make_unique<WithoutReflection>());
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(NewRpcTelemetry(result->metrics_, *result->access_));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  result->server_ = builder.BuildAndStart();
  if (result->server_ == nullptr) return absl::UnavailableError("gRPC cannot start: see the log");
  result->listener_ = *std::move(listener);
  result->listener_->Start(std::move(acceptor));
  result->address_ = ToString(*address);
  if (result->takes_calls_) {
    result->server_->GetHealthCheckService()->SetServingStatus(v1::SolverService::service_full_name(), true);
  }
  if (result->environment_.jobs) {
    result->health_ = std::jthread([server = result.get()](const std::stop_token& stop) { server->TellHealth(stop); });
  }
  if (!config.metrics_listen.empty()) {
    absl::StatusOr<std::unique_ptr<HttpEndpoint>> http = HttpEndpoint::Start(config.metrics_listen, result->Pages());
    if (!http.ok())
      return absl::Status(http.status().code(),
                          fmt::format("--metrics-listen: {}", std::string(http.status().message())));
    result->http_ = *std::move(http);
  }
  return result;
}

DlcsServer::DlcsServer(const ServerConfig& config, std::unique_ptr<Access> access)
    : access_(std::move(access)),
      takes_calls_(config.role != "worker"),
      environment_(config, *access_, metrics_),
      job_service_(environment_.jobs ? std::make_unique<JobService>(environment_) : nullptr),
      problem_service_(environment_.jobs ? std::make_unique<ProblemService>(environment_) : nullptr),
      solver_service_(environment_, job_service_.get()) {}

void DlcsServer::RegisterServices(grpc::ServerBuilder& builder) {
  if (!takes_calls_) {
    builder.RegisterCallbackGenericService(&refusal_);
    return;
  }
  builder.RegisterService(&solver_service_);
  if (!job_service_) return;
  builder.RegisterService(job_service_.get());
  builder.RegisterService(problem_service_.get());
}

ServerState DlcsServer::State() const {
  ServerState state;
  state.solves = environment_.admission.solves();
  state.max_solves = environment_.admission.max_solves();
  state.held_result_bytes = environment_.admission.held_result_bytes();
  state.setups = environment_.SetupStatistics();
  if (const JobBackend* jobs = environment_.jobs.get()) state.jobs = {jobs->manager().load(), jobs->StoreHealthy()};
  return state;
}

HttpPages DlcsServer::Pages() const {
  HttpPages pages;
  pages.metrics = [this] { return metrics_.Text(State()); };
  pages.why_not_ready = [this]() -> std::string { return draining_ ? "shutting down" : ""; };
  pages.why_no_jobs = [this]() -> std::string {
    if (!environment_.jobs) return "this server has no jobs: it has no --store";
    if (draining_) return "shutting down";
    return environment_.jobs->manager().Healthy() ? "" : "the job store does not answer";
  };
  return pages;
}

DlcsServer::~DlcsServer() { Stop(milliseconds(0)); }

void DlcsServer::TellHealth(const std::stop_token& stop) {
  constexpr milliseconds kEvery{250};
  std::mutex mutex;
  std::condition_variable_any changed;
  std::unique_lock lock(mutex);
  do {
    for (const char* service : {v1::JobService::service_full_name(), v1::ProblemService::service_full_name()}) {
      server_->GetHealthCheckService()->SetServingStatus(service, environment_.jobs->manager().Healthy());
    }
  } while (!changed.wait_for(lock, stop, kEvery, [&] { return stop.stop_requested(); }));
}

void DlcsServer::Drain() {
  draining_ = true;
  environment_.calls.Drain();
  health_ = {};  // ends it
  grpc::HealthCheckServiceInterface& health = *server_->GetHealthCheckService();
  if (takes_calls_) health.SetServingStatus(v1::SolverService::service_full_name(), false);
  if (environment_.jobs) health.SetServingStatus(v1::JobService::service_full_name(), false);
  if (environment_.jobs && takes_calls_) health.SetServingStatus(v1::ProblemService::service_full_name(), false);
  health.SetServingStatus(false);
}

void DlcsServer::Stop(milliseconds delivery) {
  if (server_ == nullptr) return;
  Drain();
  environment_.calls.StopAll(StopCause::kShutdown);
  // Running jobs are released to the store with the part solved so far.
  if (environment_.jobs) environment_.jobs->manager().Drain(milliseconds(0));
  // If watchers and readers were cancelled, they would not know that the server shuts down and not try another one.
  environment_.calls.WaitUntilIdle(delivery);
  listener_.reset();
  // Cancels the remaining calls: readers that do not read, and streams of the health service, which never end.
  server_->Shutdown(std::chrono::system_clock::now() + milliseconds(100));
  server_->Wait();
  server_.reset();
}

}  // namespace dlcs
