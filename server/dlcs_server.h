// SPDX-License-Identifier: Apache-2.0
// The whole server in one object: what dlcsd runs, and what tests start in their own process.

#ifndef DLCS_SERVER_DLCS_SERVER_H_
#define DLCS_SERVER_DLCS_SERVER_H_

#include <atomic>
#include <chrono>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>

#include "absl/status/statusor.h"
#include "grpcpp/security/server_credentials.h"
#include "grpcpp/server.h"
#include "server/access/access.h"
#include "server/config/server_config.h"
#include "server/gateway/web_port.h"
#include "server/http/http_server.h"
#include "server/net/connection_listener.h"
#include "server/rpc/call_environment.h"
#include "server/rpc/job_service.h"
#include "server/rpc/problem_service.h"
#include "server/rpc/solver_service.h"
#include "server/rpc/unimplemented_service.h"
#include "server/telemetry/metrics.h"
#include "server/telemetry/monitoring_pages.h"

namespace dlcs {

// Serves SolverService, the standard health service, JobService and ProblemService if there is a store, and optionally
// reflection on one listening socket; the page and calls over HTTP, and metrics and probes, on others.
class DlcsServer {
 public:
  // Checks the settings and the files of tokens and certificates as Start() does. Does not listen and does not open the
  // store.
  static absl::Status Check(const ServerConfig& config);
  // The server listens when this returns. Errors: InvalidArgument for a setting or a file that it names, AlreadyExists
  // for a taken port, and as CheckCanListen().
  static absl::StatusOr<std::unique_ptr<DlcsServer>> Start(const ServerConfig& config);

  // Stops at once unless Stop() was called before.
  ~DlcsServer();

  // "127.0.0.1:50051", with the actual port.
  const std::string& address() const { return address_; }
  // The same for /metrics; empty if it is not served.
  const std::string& metrics_address() const { return metrics_address_; }
  // "http://127.0.0.1:8080/" of the page and of calls over HTTP; empty if they are not served.
  std::string web_url() const;

  // Health becomes NOT_SERVING and new calls get UNAVAILABLE; running calls continue.
  void Drain();
  // Waits at most `timeout` until no call computes; returns whether that is so.
  bool WaitUntilIdle(std::chrono::milliseconds timeout) { return environment_.calls.WaitUntilComputed(timeout); }
  // Drains, stops all solves, waits up to `delivery` for their summaries to be delivered, releases running jobs to the
  // store, and closes all connections. May be called more than once.
  void Stop(std::chrono::milliseconds delivery);

  // Reads changed files of certificates and tokens now; otherwise that takes up to a second.
  void Reload() { access_->Refresh(); }

  const SolverService& service() const { return solver_service_; }

 private:
  DlcsServer(const ServerConfig& config, std::unique_ptr<Access> access);
  // Keeps the health service up to date with the state of the store.
  void TellHealth(const std::stop_token& stop);
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

}  // namespace dlcs

#endif  // DLCS_SERVER_DLCS_SERVER_H_
