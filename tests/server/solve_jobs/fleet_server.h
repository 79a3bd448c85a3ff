// SPDX-License-Identifier: Apache-2.0
// A server of a fleet: a real dlcsd that can be killed and started again.

#ifndef DLCS_TESTS_SERVER_SOLVE_JOBS_FLEET_SERVER_H_
#define DLCS_TESTS_SERVER_SOLVE_JOBS_FLEET_SERVER_H_

#include <memory>
#include <string>
#include <vector>

#include "tests/server/dlcsd_process.h"

namespace dlcs::testing {

class FleetServer {
 public:
  // Other workers resume the jobs of a worker that is down for longer than this.
  static constexpr int kLeaseMs = 1000;

  // A server with `role` and `name` on the store at `store`, with further `flags`; `environment` as in DlcsdProcess.
  FleetServer(std::string role, std::string name, std::string store, std::vector<std::string> flags = {},
              std::vector<std::string> environment = {});

  // Starts at the address of the first start. The test fails if the server does not become ready.
  void Start();
  // kill -9.
  void Kill();

  bool is_up() const { return process_ != nullptr; }
  const std::string& address() const { return address_; }

 private:
  const std::string role_, name_, store_;
  const std::vector<std::string> flags_, environment_;
  std::string address_ = "127.0.0.1:0";
  std::unique_ptr<DlcsdProcess> process_;
};

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_SOLVE_JOBS_FLEET_SERVER_H_
