// SPDX-License-Identifier: Apache-2.0
// Malicious requests: each is refused with its code, quickly and with little memory.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

#include "dlcs/v1/jobs.grpc.pb.h"
#include "dlcs/v1/solver.grpc.pb.h"
#include "tests/server/dlcsd_process.h"
#include "tests/server/service_fixture.h"
#include "tests/server/store/temporary_folder.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using grpc::StatusCode::INVALID_ARGUMENT;
using grpc::StatusCode::RESOURCE_EXHAUSTED;
using ::testing::HasSubstr;
using testing::SwitchingRequest;

constexpr std::int32_t kLargest = std::numeric_limits<std::int32_t>::max();
constexpr std::size_t kManyBytes = std::size_t{10} << 20;

class HostileRequestTest : public ::testing::Test {
 protected:
  HostileRequestTest()
      : dlcsd_({"--listen", "127.0.0.1:0", "--store", folder_.File("jobs.db"), "--log-level", "off"}),
        address_(dlcsd_.ReadAddress()),
        solver_(v1::SolverService::NewStub(testing::Connect(address_))),
        jobs_(v1::JobService::NewStub(testing::Connect(address_))) {
    // Warms allocators, pools and the store.
    EXPECT_TRUE(testing::Solve(*solver_, SwitchingRequest(1000)).status.ok());
    before_ = dlcsd_.ResidentBytes();
  }

  // Checks that the server still answers, and has grown by no more than a few messages of gRPC.
  ~HostileRequestTest() override {
    EXPECT_TRUE(testing::Solve(*solver_, SwitchingRequest(100)).status.ok());
    // Sanitizers keep freed memory.
    if (testing::kSlowness == 1) {
      EXPECT_LT(dlcsd_.ResidentBytes() - before_, 150'000'000);
    }
  }

  void ExpectRefused(const grpc::Status& status, grpc::StatusCode code, const std::string& words) {
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr(words));
    EXPECT_LE(status.error_message().size(), 600u);
  }
  void ExpectSolveRefused(const std::function<void(v1::SolveRequest&)>& spoil, grpc::StatusCode code,
                          const std::string& words) {
    v1::SolveRequest request = SwitchingRequest(100);
    spoil(request);
    ExpectRefused(testing::Solve(*solver_, request).status, code, words);
    v1::CreateSolveJobRequest job;
    *job.mutable_solve() = request;
    grpc::ClientContext context;
    v1::SolveJob response;
    ExpectRefused(jobs_->CreateSolveJob(&context, job, &response), code, words);
  }

  jobs::testing::TemporaryFolder folder_;
  testing::DlcsdProcess dlcsd_;
  const std::string address_;
  const std::unique_ptr<v1::SolverService::Stub> solver_;
  const std::unique_ptr<v1::JobService::Stub> jobs_;
  std::int64_t before_ = 0;
};

void SetFormula(v1::SolveRequest& request, const std::string& formula) {
  *request.mutable_problem()->mutable_f()->mutable_pieces(0)->mutable_formulas()->mutable_formulas(0) = formula;
}

TEST_F(HostileRequestTest, LongAndDeepFormulas) {
  ExpectSolveRefused([](auto& request) { SetFormula(request, "t" + std::string(kManyBytes, ' ')); }, INVALID_ARGUMENT,
                     "10485761 bytes; at most 65536");
  ExpectSolveRefused([](auto& request) { SetFormula(request, std::string(30'000, '(')); }, INVALID_ARGUMENT,
                     "nested deeper than 100");
}

TEST_F(HostileRequestTest, ShapesThatNobodyCanHold) {
  const auto sparse = [](v1::Matrix& matrix) {
    matrix.mutable_sparse()->set_rows(kLargest);
    matrix.mutable_sparse()->set_columns(kLargest);
  };
  ExpectSolveRefused([&](auto& request) { sparse(*request.mutable_problem()->mutable_a()); }, RESOURCE_EXHAUSTED,
                     "max_states");
  ExpectSolveRefused(
      [&](auto& request) {
        auto& sum = *request.mutable_problem()->mutable_a()->mutable_kronecker_sum();
        sparse(*sum.add_factors());
        sparse(*sum.add_factors());
      },
      RESOURCE_EXHAUSTED, "max_states = 4611686014132420608");
  ExpectSolveRefused(
      [&](auto& request) {
        request.mutable_problem()->mutable_m()->mutable_dense()->set_rows(kLargest);
        request.mutable_problem()->mutable_m()->mutable_dense()->set_columns(kLargest);
      },
      RESOURCE_EXHAUSTED, "max_constraints");
  ExpectSolveRefused([&](auto& request) { request.mutable_problem()->mutable_m()->mutable_dense()->set_rows(-1); },
                     INVALID_ARGUMENT, "problem.m");
  ExpectSolveRefused([](auto& request) { request.mutable_options()->set_steps(1'000'000'000); }, RESOURCE_EXHAUSTED,
                     "max_steps");
  ExpectSolveRefused([](auto& request) { request.mutable_options()->set_steps(2'000'000'000); }, INVALID_ARGUMENT,
                     "steps: 2000000000; must be between 1 and 1000000000");
  grpc::ClientContext context;
  v1::SolveLcpRequest lcp;
  v1::SolveLcpResponse response;
  sparse(*lcp.mutable_m());
  ExpectRefused(solver_->SolveLcp(&context, lcp, &response), RESOURCE_EXHAUSTED, "max_constraints");
}

TEST_F(HostileRequestTest, NamesThatAreNone) {
  const std::string good = "jobs/" + std::string(26, 'a');
  for (const std::string& name : {std::string(), std::string("jobs/"), std::string("jobs/../../../../../../etc/passwd"),
                                  std::string("../jobs/") + std::string(26, 'a'), good + "/",
                                  good + std::string(1, '\0'), "/" + good, std::string("jobs/") + std::string(26, '/'),
                                  "jobs/" + std::string(26, 'A'), std::string("jobs/' OR 1=1; DROP TABLE jobs--aa"),
                                  std::string("jobs/%2e%2e%2f%2e%2e%2fetc%2fpassw"), std::string(kManyBytes, 'a')}) {
    grpc::ClientContext get, cancel, remove, watch, read;
    v1::SolveJob job;
    v1::GetSolveJobRequest get_request;
    get_request.set_name(name);
    ExpectRefused(jobs_->GetSolveJob(&get, get_request, &job), INVALID_ARGUMENT, "name: ");
    v1::CancelSolveJobRequest cancel_request;
    cancel_request.set_name(name);
    ExpectRefused(jobs_->CancelSolveJob(&cancel, cancel_request, &job), INVALID_ARGUMENT, "name: ");
    v1::DeleteSolveJobRequest remove_request;
    v1::DeleteSolveJobResponse removed;
    remove_request.set_name(name);
    ExpectRefused(jobs_->DeleteSolveJob(&remove, remove_request, &removed), INVALID_ARGUMENT, "name: ");
    v1::WatchSolveJobRequest watch_request;
    watch_request.set_name(name);
    ExpectRefused(jobs_->WatchSolveJob(&watch, watch_request)->Finish(), INVALID_ARGUMENT, "name: ");
    v1::ReadTrajectoryRequest read_request;
    read_request.set_name(name);
    ExpectRefused(jobs_->ReadTrajectory(&read, read_request)->Finish(), INVALID_ARGUMENT, "name: ");
    grpc::ClientContext read_ensemble;
    v1::ReadEnsembleRequest ensemble_request;
    ensemble_request.set_name(name);
    ExpectRefused(jobs_->ReadEnsemble(&read_ensemble, ensemble_request)->Finish(), INVALID_ARGUMENT, "name: ");
  }
}

TEST_F(HostileRequestTest, TokensAndIdsOfAnyLength) {
  for (const std::string& token :
       {std::string("'; DROP TABLE jobs; --"), std::string(kManyBytes, '9'), std::string("-1")}) {
    grpc::ClientContext context;
    v1::ListSolveJobsRequest request;
    v1::ListSolveJobsResponse response;
    request.set_page_token(token);
    ExpectRefused(jobs_->ListSolveJobs(&context, request, &response), INVALID_ARGUMENT, "token");
  }
  grpc::ClientContext context;
  v1::CreateSolveJobRequest request;
  *request.mutable_solve() = SwitchingRequest(10);
  request.set_request_id(std::string(kManyBytes, 'x'));
  v1::SolveJob job;
  ExpectRefused(jobs_->CreateSolveJob(&context, request, &job), INVALID_ARGUMENT, "request_id: has 10485760 bytes");
}

TEST_F(HostileRequestTest, MessagesAboveTheLimit) {
  v1::SolveRequest request = SwitchingRequest(10);
  SetFormula(request, std::string(std::size_t{65} << 20, ' '));
  ExpectRefused(testing::Solve(*solver_, request).status, RESOURCE_EXHAUSTED, "larger than max");
}

}  // namespace
}  // namespace dlcs
