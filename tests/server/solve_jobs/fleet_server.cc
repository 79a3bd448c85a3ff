// SPDX-License-Identifier: Apache-2.0
#include "tests/server/solve_jobs/fleet_server.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <utility>

namespace dlcs::testing {

FleetServer::FleetServer(std::string role, std::string name, std::string store, std::vector<std::string> flags,
                         std::vector<std::string> environment)
    : role_(std::move(role)),
      name_(std::move(name)),
      store_(std::move(store)),
      flags_(std::move(flags)),
      environment_(std::move(environment)) {
  Start();
}

void FleetServer::Start() {
  std::vector<std::string> flags = {"--listen",        address_,
                                    "--store",         store_,
                                    "--role",          role_,
                                    "--worker-name",   name_,
                                    "--lease-ms",      std::to_string(kLeaseMs),
                                    "--checkpoint-ms", "10",
                                    "--log-level",     "off"};
  flags.insert(flags.end(), flags_.begin(), flags_.end());
  process_ = std::make_unique<DlcsdProcess>(flags, environment_);
  address_ = process_->ReadAddress();
  ASSERT_NE(address_, "");
}

void FleetServer::Kill() {
  process_->Signal(SIGKILL);
  process_->Wait();
  process_.reset();
}

}  // namespace dlcs::testing
