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
#include "server/net/connection_listener.h"
#include "server/rpc/call_environment.h"
#include "server/rpc/job_service.h"
#include "server/rpc/problem_service.h"
#include "server/rpc/solver_service.h"
#include "server/rpc/unimplemented_service.h"
#include "server/telemetry/http_endpoint.h"
#include "server/telemetry/metrics.h"

namespace dlcs {

// SolverService, with a store JobService and ProblemService too, the standard health service and, where it is asked
// for, reflection behind one listening socket; metrics and probes behind another.
class DlcsServer {
 public:
  // What Start() would say of the settings, and of the files of tokens and certificates. Listens on nothing, opens no
  // store.
  static absl::Status Check(const ServerConfig& config);
  // Listens when it returns. Errors: InvalidArgument for a setting or a file that it names, AlreadyExists for a taken
  // port, and as CheckCanListen().
  static absl::StatusOr<std::unique_ptr<DlcsServer>> Start(const ServerConfig& config);

  // Stops at once unless Stop() was called before.
  ~DlcsServer();

  // "127.0.0.1:50051", with the port that was picked.
  const std::string& address() const { return address_; }
  // The same of /metrics; empty where nothing listens.
  std::string metrics_address() const { return http_ ? http_->address() : ""; }

  // Health turns to NOT_SERVING and new calls get UNAVAILABLE; those under way go on.
  void Drain();
  // True when no call computes, at the latest after `timeout`.
  bool WaitUntilIdle(std::chrono::milliseconds timeout) { return environment_.calls.WaitUntilComputed(timeout); }
  // Drains, stops all solves and gives them `delivery` to hand over their summaries; gives running jobs back to the
  // store; then closes all connections. Call it once or more.
  void Stop(std::chrono::milliseconds delivery);

  // Reads certificates and tokens again where their files have changed, which otherwise takes up to a second.
  void Reload() { access_->Refresh(); }

  const SolverService& service() const { return solver_service_; }

 private:
  DlcsServer(const ServerConfig& config, std::unique_ptr<Access> access);
  // Health follows the store.
  void TellHealth(const std::stop_token& stop);
  ServerState State() const;
  HttpPages Pages() const;

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
  UnimplementedService refusal_;  // in the place of all, where no calls are taken
  std::string address_;
  std::shared_ptr<grpc::ServerCredentials> credentials_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<ConnectionListener> listener_;
  std::jthread health_;
  std::unique_ptr<HttpEndpoint> http_;  // null where nothing listens; reads the others
};

}  // namespace dlcs

#endif  // DLCS_SERVER_DLCS_SERVER_H_
