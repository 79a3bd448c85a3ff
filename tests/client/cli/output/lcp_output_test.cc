// SPDX-License-Identifier: Apache-2.0
#include "client/cli/output/lcp_output.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/client/cli/printed.h"

namespace dlcs::client {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(LcpOutputTest, PrintsTheSolution) {
  v1::SolveLcpResponse response;
  response.set_verdict(v1::LCP_STATUS_SOLVED);
  response.add_y(0.1);
  response.add_w(0);
  response.set_residual(1e-17);
  response.set_matrix_class("P-matrix");
  EXPECT_THAT(Printed([&](std::FILE* out) { PrintLcpTable(response, out); }),
              AllOf(HasSubstr("SOLVED"), HasSubstr("0.1"), HasSubstr("1.0e-17")));
}

TEST(LcpOutputTest, ShowsIndexSetsAndAllSolutions) {
  v1::SolveLcpResponse response;
  response.set_verdict(v1::LCP_STATUS_SOLVED);
  response.set_rule("the least norm");
  for (const double y : {0.5, 0.5, 0.0}) {
    response.add_y(y);
    response.add_w(0);
  }
  response.mutable_sets()->add_j(0);
  response.mutable_sets()->add_j(1);
  response.mutable_sets()->add_k(2);
  v1::BasicSolution& solution = *response.mutable_all()->add_solutions();
  for (const double y : {1.0, 0.0, 0.0}) {
    solution.add_y(y);
    solution.add_w(0);
  }
  v1::SolutionFace& face = *response.mutable_all()->add_faces();
  face.add_basis(0);
  face.add_basis(1);
  face.add_nearest(0.5);
  const std::string text = Printed([&](std::FILE* out) { PrintLcpTable(response, out); });
  EXPECT_THAT(text, AllOf(HasSubstr("Rule    the least norm\n"), HasSubstr("J (y > 0)      {0, 1}"),
                          HasSubstr("K (y = w = 0)  {2}: degenerate"), HasSubstr("Other solutions satisfy"),
                          HasSubstr("1 basic solution; the search was not complete"), HasSubstr("y = (1, 0, 0)"),
                          HasSubstr("a continuum with w = 0 on {0, 1}"), Not(HasSubstr("no other solutions"))));
  response.mutable_all()->clear_faces();
  response.mutable_all()->set_complete(true);
  EXPECT_THAT(Printed([&](std::FILE* out) { PrintLcpTable(response, out); }),
              HasSubstr("There are no other solutions."));
}

v1::SolveDcpResponse Ramp() {
  v1::SolveDcpResponse response;
  response.set_solved(true);
  response.set_message("Found.");
  for (const double t : {0.0, 1.0, 1.0, 2.0}) {
    response.mutable_v()->add_times(t);
    response.mutable_v()->add_values(response.v().times_size() > 2 ? t + 5 : t);
  }
  response.mutable_certificate()->set_least_w(-1e-16);
  response.mutable_unique()->set_answer(v1::ANSWER_UNKNOWN);
  response.mutable_unique()->set_reason("a P-matrix");
  return response;
}

TEST(DcpOutputTest, TabulatesBothSidesOfAJump) {
  const std::string text = Printed([](std::FILE* out) { PrintDcpTable(Ramp(), {true, "Found."}, 80, out); });
  EXPECT_THAT(text, AllOf(HasSubstr("SOLVED: Found."), HasSubstr("1   1\n1   6\n2   7\n"), HasSubstr("-1.0e-16"),
                          HasSubstr("unknown (a P-matrix)")));
}

// v = c t for q = -2 t and M = 1 (w = (c - 2) t) on [0, 1], in units of `scale`.
DcpVerdict Checked(
    double c, double scale, void (*change)(v1::DcpCertificate&) = [](v1::DcpCertificate&) {}) {
  v1::SolveDcpRequest request;
  request.mutable_m()->mutable_dense()->set_rows(1);
  request.mutable_m()->mutable_dense()->set_columns(1);
  request.mutable_m()->mutable_dense()->add_values(1);
  for (const double t : {0.0, 1.0}) {
    request.mutable_q()->add_times(t);
    request.mutable_q()->add_values(-2 * t * scale);
    request.mutable_check()->add_times(t);
    request.mutable_check()->add_values(c * t * scale);
  }
  v1::SolveDcpResponse response;
  v1::DcpCertificate& certificate = *response.mutable_certificate();
  certificate.set_least_increase(c * scale);
  certificate.set_least_w(std::min(0.0, (c - 2) * scale));
  certificate.set_complementarity(std::abs(0.5 * (c - 2) * c) * scale * scale);
  change(certificate);
  return VerdictOf(request, response);
}

TEST(DcpOutputTest, ACheckedPathHasAVerdictInItsOwnUnits) {
  for (const double scale : {1e-12, 1.0, 1e12}) {
    EXPECT_TRUE(Checked(2, scale).solved) << scale;
    EXPECT_THAT(Checked(1.9, scale).message, HasSubstr("w goes below 0")) << scale;
    EXPECT_FALSE(Checked(1.9, scale).solved) << scale;
    EXPECT_THAT(Checked(2.2, scale).message, HasSubstr("integral of w_i dv_i")) << scale;
    EXPECT_FALSE(Checked(2.2, scale).solved) << scale;
    EXPECT_FALSE(Checked(-1, scale).solved) << scale;
  }
  const DcpVerdict start = Checked(2, 1, [](v1::DcpCertificate& c) { c.set_start(0.5); });
  EXPECT_FALSE(start.solved);
  EXPECT_THAT(start.message, HasSubstr("v(0) is off by 0.5"));
}

}  // namespace
}  // namespace dlcs::client
