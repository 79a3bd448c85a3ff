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
  // A worker that is away for longer than this finds its jobs in other hands.
  static constexpr int kLeaseMs = 1000;

  // Of `role`, named `name`, on the store at `store`; `flags` are further ones, `environment` as of DlcsdProcess.
  FleetServer(std::string role, std::string name, std::string store, std::vector<std::string> flags = {},
              std::vector<std::string> environment = {});

  // At the address of the first start. The test fails where it does not get ready.
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
