// SPDX-License-Identifier: Apache-2.0
// Every case of tests/cases, by every method that serves its class, against references made by event-driven
// integration. Errors are relative to the largest |x| (or |B y|) over the references of the case.

#include "tests/support/cases.h"

#include <gtest/gtest.h>

#include <string>

#include "core/linalg/norms.h"
#include "core/solve.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using testing::Case;
using testing::CaseError;
using testing::ErrorOf;
using testing::LoadCase;
using testing::ReferenceTimes;

Solution SolveCase(const Case& the_case, Method method, Index steps) {
  Options options;
  options.method = method;
  options.num_steps = steps;
  options.output_times = ReferenceTimes(the_case);
  options.output_times_only = true;
  options.project_initial_state = true;
  return testing::SolveToEnd(the_case.problem, options);
}

CaseError Error(const Case& the_case, Method method, Index steps) {
  const Solution solution = SolveCase(the_case, method, steps);
  return ErrorOf(the_case, solution.times, solution.x, solution.y);
}

// `steps` gives 1e-3 with the first-order method; `fine_steps` 1e-6 with the second-order ones (0: no P or Z class).
struct Expectation {
  const char* name;
  Index steps;
  Index fine_steps;
};
void PrintTo(const Expectation& expectation, std::ostream* out) { *out << expectation.name; }

class CasesTest : public ::testing::TestWithParam<Expectation> {};

TEST_P(CasesTest, TimeSteppingConvergesWithOrderOne) {
  const Case the_case = LoadCase(GetParam().name);
  const Index steps = GetParam().steps;
  const CaseError coarse = Error(the_case, Method::kTimeStepping, steps / 4);
  const CaseError fine = Error(the_case, Method::kTimeStepping, steps);
  EXPECT_LT(fine.x, 1e-3);
  EXPECT_LT(fine.By, 1e-3);
  // A quarter of the step: order 1 is a quarter of the error. Cases with rough sources converge less evenly.
  if (coarse.x > 1e-9) {
    EXPECT_LT(fine.x, coarse.x / 2.5);
  }
}

TEST_P(CasesTest, ExponentialIntegratorAgrees) {
  const Case the_case = LoadCase(GetParam().name);
  const CaseError error = Error(the_case, Method::kExponentialIntegrator, GetParam().steps);
  EXPECT_LT(error.x, 1e-3);
  EXPECT_LT(error.By, 1e-3);
}

TEST_P(CasesTest, LaplaceIterationReachesOneInAMillion) {
  const Index steps = GetParam().fine_steps;
  const Case the_case = LoadCase(GetParam().name);
  if (steps == 0) {
    Options options;
    options.method = Method::kLaplaceIteration;
    Observer silent;
    const auto solution = Solve(the_case.problem, options, silent, {});
    ASSERT_TRUE(solution.ok());
    EXPECT_EQ(solution->termination, Termination::kUnsupported);
    return;
  }
  const Solution iterated = SolveCase(the_case, Method::kLaplaceIteration, steps);
  const CaseError error = ErrorOf(the_case, iterated.times, iterated.x, iterated.y);
  EXPECT_LT(error.x, 1e-6);
  EXPECT_LT(error.By, 1e-6);
  if (the_case.y_is_unique) {
    EXPECT_LT(error.y, 1e-6);
  }
  // The march solves the same discrete equations: it agrees to rounding, amplified by the conditioning of the flow.
  const Solution marched = SolveCase(the_case, Method::kExponentialIntegrator, steps);
  EXPECT_LT(MaxAbs(iterated.x - marched.x), 1e-9 * MaxAbs(marched.x));
}

TEST_P(CasesTest, AutomaticMethodGivesACertificate) {
  const Case the_case = LoadCase(GetParam().name);
  const Solution solution = SolveCase(the_case, Method::kAuto, GetParam().steps);
  const CaseError error = ErrorOf(the_case, solution.times, solution.x, solution.y);
  EXPECT_LT(error.x, 1e-3);
  EXPECT_LT(solution.certificate.node_residual, 1e-9 * solution.certificate.lcp_scale);
  EXPECT_FALSE(solution.reason.empty());
  if (!the_case.state_jumps.empty()) {
    ASSERT_EQ(solution.jumps.size(), the_case.state_jumps.size());
    for (size_t k = 0; k < solution.jumps.size(); ++k) {
      EXPECT_EQ(solution.jumps[k].time, the_case.state_jumps[k].first);
      EXPECT_LT(MaxAbs(solution.jumps[k].dx - the_case.state_jumps[k].second), 1e-9);
    }
  } else {
    EXPECT_TRUE(solution.jumps.empty());
  }
}

INSTANTIATE_TEST_SUITE_P(All, CasesTest,
                         ::testing::Values(Expectation{"rlcd", 2000000, 100000},         //
                                           Expectation{"abb_circuit_a", 100000, 20000},  //
                                           Expectation{"observer_lcs", 100000, 100000},  //
                                           Expectation{"saturated_pd", 40000, 20000},    //
                                           Expectation{"wall_permeable", 20000, 20000},  //
                                           Expectation{"leontief_stock", 40000, 40000},  //
                                           Expectation{"train_brakes", 100000, 100000},  //
                                           Expectation{"formula_zoo", 40000, 40000},     //
                                           Expectation{"z_least", 40000, 20000},         //
                                           Expectation{"diode_bridge", 1000000, 0},      //
                                           Expectation{"diode_bridge_cap", 1000000, 0},  //
                                           Expectation{"abb_circuit_c", 100000, 0},      //
                                           Expectation{"vickrey", 100000, 0},            //
                                           Expectation{"american_put", 20000, 0},        //
                                           Expectation{"relay_sliding", 100000, 0},      //
                                           Expectation{"friction_oscillator", 2000000, 0}),
                         [](const auto& the_case) { return std::string(the_case.param.name); });

TEST(CasesOutsideTest, TripleIntegratorIsRefusedForItsRelativeDegree) {
  const Case the_case = LoadCase("outside_triple_integrator");
  for (const Method method : {Method::kAuto, Method::kTimeStepping, Method::kExponentialIntegrator}) {
    Options options;
    options.method = method;
    Observer silent;
    const auto solution = Solve(the_case.problem, options, silent, {});
    ASSERT_TRUE(solution.ok());
    EXPECT_EQ(solution->termination, Termination::kUnsupported);
    EXPECT_NE(solution->message.find("relative degree 3"), std::string::npos) << solution->message;
  }
}

TEST(CasesOutsideTest, InfeasibleSystemEndsWithTheTime) {
  const Case the_case = LoadCase("outside_infeasible");
  for (const bool project : {false, true}) {
    Options options;
    options.project_initial_state = project;
    Observer silent;
    const auto solution = Solve(the_case.problem, options, silent, {});
    ASSERT_TRUE(solution.ok());
    EXPECT_EQ(solution->termination, Termination::kInfeasible);
    EXPECT_EQ(solution->failure_time, 0);
    EXPECT_NE(solution->message.find("t = 0"), std::string::npos) << solution->message;
  }
}

TEST(CasesJumpTest, InconsistentStatesAreExplainedWithoutProjection) {
  for (const char* name : {"abb_circuit_c", "diode_bridge_cap"}) {
    const Case the_case = LoadCase(name);
    Observer silent;
    const auto solution = Solve(the_case.problem, {}, silent, {});
    ASSERT_TRUE(solution.ok());
    EXPECT_EQ(solution->termination, Termination::kInconsistentState) << name;
    EXPECT_NE(solution->message.find("jump"), std::string::npos) << solution->message;
  }
}

}  // namespace
}  // namespace dlcs
