// SPDX-License-Identifier: Apache-2.0
// The whole server in one object: what dlcsd runs, and what tests start in their own process.

#ifndef DLCS_SERVER_DLCS_SERVER_H_
#define DLCS_SERVER_DLCS_SERVER_H_

#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/config/server_config.h"

namespace dlcs {

// Serves SolverService, the standard health service, JobService and ProblemService if there is a store, and optionally
// reflection on one listening socket; the page and calls over HTTP, and metrics and probes, on others. An interface, so
// that its users need not compile all headers of a server.
class DlcsServer {
 public:
  // Checks the settings and the files of tokens and certificates as Start() does. Does not listen and does not open the
  // store.
  static absl::Status Check(const ServerConfig& config);
  // The server listens when this returns. Errors: InvalidArgument for a setting or a file that it names, AlreadyExists
  // for a taken port, and as CheckCanListen().
  static absl::StatusOr<std::unique_ptr<DlcsServer>> Start(const ServerConfig& config);

  // Stops at once unless Stop() was called before.
  virtual ~DlcsServer() = default;

  // "127.0.0.1:50051", with the actual port.
  virtual const std::string& address() const = 0;
  // The same for /metrics; empty if it is not served.
  virtual const std::string& metrics_address() const = 0;
  // "http://127.0.0.1:8080/" of the page and of calls over HTTP; empty if they are not served.
  virtual std::string web_url() const = 0;
  // The number of running solves.
  virtual int solves() const = 0;

  // For how long there has been no job to run, here or in the store; 0 without a store.
  virtual std::chrono::microseconds JobsIdleFor() const = 0;

  // Health becomes NOT_SERVING and new calls get UNAVAILABLE; running calls continue.
  virtual void Drain() = 0;
  // Waits at most `timeout` until no call computes; returns whether that is so.
  virtual bool WaitUntilIdle(std::chrono::milliseconds timeout) = 0;
  // Drains, stops all solves, waits up to `delivery` for their summaries to be delivered, releases running jobs to the
  // store, and closes all connections. May be called more than once.
  virtual void Stop(std::chrono::milliseconds delivery) = 0;

  // Reads changed files of certificates and tokens now; otherwise that takes up to a second.
  virtual void Reload() = 0;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_DLCS_SERVER_H_
