// SPDX-License-Identifier: Apache-2.0
#include "core/problem/verdict.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/context/sizes.h"
#include "core/solve.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

Solution Reached(AccuracySource source, double error, double asked) {
  Solution solution;
  solution.termination = Termination::kReachedEnd;
  solution.accuracy.source = source;
  solution.accuracy.error = error;
  solution.accuracy.tolerance = asked;
  return solution;
}

Solution Named(NamedComponent named) {
  Solution solution = Reached(AccuracySource::kControlled, 1e-9, 1e-6);
  named.name = "i(Ln)";
  if (named.beside) named.beside_name = "i(La)";
  solution.accuracy.named.push_back(std::move(named));
  return solution;
}

TEST(VerdictTest, IsSolvedWithinWhatWasAskedForOnly) {
  const Verdict within = JudgeSolution(Reached(AccuracySource::kControlled, 1e-7, 1e-6));
  EXPECT_EQ(within.kind, VerdictKind::kSolved);
  EXPECT_TRUE(within.success);
  EXPECT_EQ(within.text, "SOLVED within an error of 1e-06, estimated error 1e-07");
  // Of methods that compare x alone.
  Solution of_x = Reached(AccuracySource::kControlled, 1e-7, 1e-6);
  of_x.accuracy.errors.x = {Vector{{1}}, Vector{{1e-7}}, Vector{{0}}};
  const Verdict of_x_alone = JudgeSolution(of_x);
  EXPECT_EQ(of_x_alone.text, "SOLVED within an error of 1e-06 of x, estimated error 1e-07");
  EXPECT_THAT(of_x_alone.notes, ElementsAre(HasSubstr("y and w are not estimated")));
  of_x.accuracy.source = AccuracySource::kCompared;
  of_x.accuracy.tolerance = 0;
  const Verdict of_given_steps = JudgeSolution(of_x);
  EXPECT_EQ(of_given_steps.text, "reached T, estimated error 1e-07 of x");
  EXPECT_THAT(of_given_steps.notes, ElementsAre(HasSubstr("y and w are not estimated")));
  // Steps that were given are never solved within anything.
  const Verdict given = JudgeSolution(Reached(AccuracySource::kCompared, 1e-15, 0));
  EXPECT_EQ(given.kind, VerdictKind::kErrorEstimated);
  EXPECT_TRUE(given.success);
}

TEST(VerdictTest, NamesWhatMissedTheToleranceAndWhatWouldAcceptIt) {
  Solution solution = Named({.component = {}, .own = 2, .truncation = 3e-5, .rounding = 1e-15, .allowed = 2e-6});
  const Verdict by_steps = JudgeSolution(solution);
  EXPECT_EQ(by_steps.kind, VerdictKind::kErrorEstimated);
  EXPECT_FALSE(by_steps.success);
  EXPECT_EQ(by_steps.text, "reached T: i(Ln) has an error of 3e-05, allowed is 2e-06, because of steps");
  EXPECT_THAT(by_steps.concerns, ElementsAre("i(Ln) has an error of 3e-05, allowed is 2e-06, because of steps."));
  solution.accuracy.named.push_back(solution.accuracy.named[0]);
  EXPECT_THAT(JudgeSolution(solution).text, HasSubstr("because of steps (and 1 more)"));
  const Verdict by_rounding =
      JudgeSolution(Named({.component = {}, .own = 1e-16, .truncation = 0, .rounding = 3e-9, .allowed = 1e-22}));
  EXPECT_THAT(by_rounding.text, HasSubstr("because of rounding"));
}

// x and y with these errors, judged, after a solve for a tolerance of 1e-6 if they are not those of given steps.
Solution Judged(ErrorsByCause x, ErrorsByCause y, const Options& options, double tolerance = 1e-6) {
  const AccuracySource source = tolerance > 0 ? AccuracySource::kControlled : AccuracySource::kCompared;
  Solution solution = Reached(source, 0, tolerance);
  solution.accuracy.errors.x = std::move(x);
  solution.accuracy.errors.y = std::move(y);
  JudgeComponents(
      options, [] { return AllSizesBeside{}; }, solution.accuracy);
  return solution;
}

TEST(VerdictTest, AdvisesWhatAcceptsEveryComponentByOtherStepsToo) {
  // By steps; twice the rounding is left for other steps.
  Solution solution = Judged({Vector{{2}}, Vector{{3e-5}}, Vector{{1e-6}}}, {}, {});
  EXPECT_THAT(JudgeSolution(solution).concerns,
              ElementsAre(HasSubstr("because of steps"),
                          "--tolerance 1.6e-05 or --absolute-tolerance 'x[0]=3.2e-05' accepts it."));
  // By rounding: steps are not shortened below it, which is two times twice 1.5e-6. Of the others one is accepted, by
  // less than is certain, and one for certain.
  solution = Judged({Vector{{1, 8, 1}}, Vector{{0, 0, 0}}, Vector{{1.5e-6, 3e-6, 1e-8}}},
                    {Vector{{2}}, Vector{{9e-6}}, Vector{{1e-9}}}, {});
  solution.accuracy.advice.absolute[0].name = "iL";
  solution.accuracy.advice.absolute[1].name = "v(out)";
  solution.accuracy.advice.absolute[2].name = "D1";
  EXPECT_THAT(JudgeSolution(solution).concerns,
              ElementsAre(HasSubstr("y[0]"), HasSubstr("x[0]"),
                          "--tolerance 6e-06 or --absolute-tolerance 'iL=6e-06,v(out)=1.2e-05,D1=9.1e-06' accepts "
                          "all of them."));
  // An absolute tolerance that is enough stays one.
  Options options;
  options.absolute_tolerances = {{{ComponentKind::kPair, 0}, 1e-5}};
  solution.accuracy.advice = {};
  JudgeComponents(
      options, [] { return AllSizesBeside{}; }, solution.accuracy);
  EXPECT_THAT(solution.accuracy.advice.absolute, SizeIs(2));
}

TEST(VerdictTest, AdvisesNothingThatCannotHold) {
  // No tolerance below 1 accepts it.
  Solution solution = Judged({Vector{{1e-16}}, Vector{{0}}, Vector{{3e-9}}}, {}, {});
  EXPECT_EQ(JudgeSolution(solution).concerns.back(), "--absolute-tolerance 'x[0]=1.2e-08' accepts it.");
  // Steps that leave nothing of a component are too long, whatever is accepted.
  solution = Judged({Vector{{1}}, Vector{{40}}, Vector{{1e-9}}}, {}, {});
  EXPECT_THAT(JudgeSolution(solution).concerns, SizeIs(1));
  // Nor does a number for the errors help where the certificate contradicts the answer.
  solution = Judged({Vector{{1}}, Vector{{1e-3}}, Vector{{0}}}, {}, {});
  EXPECT_THAT(JudgeSolution(solution).concerns, SizeIs(2));
  solution.certificate.node_residual = 0.5;
  solution.certificate.lcp_scale = 10;
  EXPECT_THAT(JudgeSolution(solution).concerns, ElementsAre(HasSubstr("x[0]"), HasSubstr("residual of the LCP")));
  // An error that is not finite.
  solution = Judged({Vector{{1}}, Vector{{std::numeric_limits<double>::infinity()}}, Vector{{0}}}, {}, {});
  EXPECT_THAT(JudgeSolution(solution).concerns, SizeIs(1));
  // Nobody types ten absolute tolerances.
  solution = Judged({Vector::Ones(10), Vector::Constant(10, 1e-3), Vector::Zero(10)}, {}, {});
  EXPECT_EQ(JudgeSolution(solution).concerns.back(), "--tolerance 0.001 accepts all of them.");
  // Solves that do not converge have shown no error of their own.
  solution.accuracy.follows_tolerance = false;
  EXPECT_THAT(JudgeSolution(solution).concerns, SizeIs(10));
}

TEST(VerdictTest, AdvisesNumbersAtTheEndsOfTheRange) {
  for (const double error : {3e-320, 1e-308, 1e300}) {
    const Solution solution = Judged({Vector{{8 * error}}, Vector{{error}}, Vector{{0}}}, {}, {});
    EXPECT_THAT(JudgeSolution(solution).concerns.back(), HasSubstr("--absolute-tolerance 'x[0]=")) << error;
  }
}

TEST(VerdictTest, AdvisesAToleranceInPlaceOfStepsThatDoNotServe) {
  const Solution solution =
      Judged({Vector{{2}}, Vector{{1.2}}, Vector{{1e-9}}}, {Vector{{1}}, Vector{{5}}, Vector{{0}}}, {}, 0);
  EXPECT_THAT(JudgeSolution(solution).concerns,
              ElementsAre(HasSubstr("x[0]"),
                          "--tolerance 0.5 or --absolute-tolerance 'x[0]=1.3' accepts it. "
                          "A smaller tolerance makes the steps shorter."));
}

TEST(VerdictTest, NamesWhatIsZeroOrNegligible) {
  NamedComponent named{
      .component = {}, .knowledge = Knowledge::kZero, .own = 2e-14, .rounding = 5e-14, .beside = Component{}};
  named.beside_own = 31;
  const Verdict zero = JudgeSolution(Named(named));
  EXPECT_EQ(zero.kind, VerdictKind::kSolved);
  EXPECT_TRUE(zero.success);
  EXPECT_EQ(zero.text,
            "SOLVED within an error of 1e-06, estimated error 1e-09; i(Ln) is zero: 2e-14 (rounding 5e-14), "
            "beside i(La) of 31");
  named = {.component = {},
           .knowledge = Knowledge::kNegligible,
           .own = 1.2e-12,
           .rounding = 1e-15,
           .digits = 3,
           .beside = Component{}};
  named.beside_own = 31;
  EXPECT_THAT(JudgeSolution(Named(named)).notes,
              ElementsAre("i(Ln) is 1.2e-12, known to 3 digits, beside i(La) of 31."));
  Solution two = Named(named);
  two.accuracy.named.push_back(two.accuracy.named[0]);
  EXPECT_THAT(JudgeSolution(two).text, HasSubstr("; 2 components are zero or negligible"));
}

TEST(VerdictTest, GivenStepsAreNoSuccessWhereNoDigitIsKnown) {
  const Verdict known = JudgeSolution(Reached(AccuracySource::kCompared, 0.05, 0));
  EXPECT_TRUE(known.success);
  EXPECT_EQ(known.text, "reached T, estimated error 0.05");
  EXPECT_THAT(known.concerns, IsEmpty());
  Solution solution = Reached(AccuracySource::kCompared, 0, 0);
  TrajectoryErrors& errors = solution.accuracy.errors;
  errors.x = {Vector{{2}}, Vector{{1.2}}, Vector{{0}}};
  errors.y = errors.w = {Vector{{2}}, Vector{{0}}, Vector{{0}}};
  JudgeComponents(
      {}, [&] { return AllSizesBeside{}; }, solution.accuracy);
  const Verdict unknown = JudgeSolution(solution);
  EXPECT_FALSE(unknown.success);
  EXPECT_EQ(unknown.text, "reached T: x[0] has an error of 1.2, allowed is 1, because of steps");
  EXPECT_THAT(unknown.concerns, SizeIs(2));
  // y may be a short pulse.
  std::swap(errors.x, errors.y);
  JudgeComponents(
      {}, [&] { return AllSizesBeside{}; }, solution.accuracy);
  EXPECT_TRUE(JudgeSolution(solution).success);
}

TEST(VerdictTest, KnowsWhatIsNotKnown) {
  const Verdict unknown = JudgeSolution(Reached(AccuracySource::kNotEstimated, 0, 0));
  EXPECT_EQ(unknown.kind, VerdictKind::kErrorUnknown);
  EXPECT_TRUE(unknown.success);
  EXPECT_EQ(JudgeSolution(Reached(AccuracySource::kCompared, std::numeric_limits<double>::quiet_NaN(), 0)).kind,
            VerdictKind::kErrorUnknown);
  const Verdict missed =
      JudgeSolution(Reached(AccuracySource::kControlled, std::numeric_limits<double>::quiet_NaN(), 1e-6));
  EXPECT_EQ(missed.text, "reached T: the error is not known, allowed is 1e-06");
  EXPECT_FALSE(missed.success);
  Solution failed = Reached(AccuracySource::kControlled, 1e-9, 1e-6);
  failed.termination = Termination::kInfeasible;
  EXPECT_EQ(JudgeSolution(failed).kind, VerdictKind::kNotSolved);
  EXPECT_FALSE(JudgeSolution(failed).success);
}

TEST(VerdictTest, IsNoSuccessWhereTheCertificateContradictsIt) {
  Solution solution = Reached(AccuracySource::kControlled, 1e-9, 1e-6);
  solution.certificate.node_residual = 0.5;
  solution.certificate.lcp_scale = 10;
  const Verdict verdict = JudgeSolution(solution);
  EXPECT_NE(verdict.kind, VerdictKind::kSolved);
  EXPECT_FALSE(verdict.success);
  EXPECT_THAT(verdict.concerns, SizeIs(1));
  EXPECT_EQ(verdict.text,
            "reached T: the residual of the LCP at nodes is 0.05 of its size: shorter steps would resolve it");
}

// A defect of x' between nodes need not be an error of x.
TEST(VerdictTest, IsSolvedWhereTheCertificateNeedNotShowAnError) {
  Solution solution = Reached(AccuracySource::kControlled, 1e-5, 1e-4);
  solution.certificate.ode_defect = 0.5;
  solution.certificate.ode_scale = 1;
  const Verdict verdict = JudgeSolution(solution);
  EXPECT_EQ(verdict.kind, VerdictKind::kSolved);
  EXPECT_THAT(verdict.concerns, IsEmpty());
  EXPECT_THAT(verdict.notes, SizeIs(1));
}

TEST(VerdictTest, IsNotGoodWhereAContinuousYMissesItsConditionsBetweenNodes) {
  Solution solution = Reached(AccuracySource::kCompared, 1e-4, 0);
  solution.certificate.midpoint_residual = 6;
  solution.certificate.lcp_scale = 10;
  EXPECT_TRUE(JudgeSolution(solution).success);  // y may jump between nodes
  solution.accuracy.errors.y.own = Vector::Ones(1);
  EXPECT_FALSE(JudgeSolution(solution).success);
}

// A spring of 30 rad/s against a stop: steps of 0.2 are nearly its period, and so are twice and four times that. All
// grids see the same slow motion.
TEST(VerdictTest, StepsThatAliasAreNoSuccess) {
  Problem problem;
  problem.A = Matrix{{0, 1}, {-900, 0}};
  problem.B = Matrix{{0}, {1}};
  problem.N = Matrix{{1, 0}};
  problem.M = Matrix{{0.01}};
  problem.f = TimeFunction::Zero(2);
  problem.g = TimeFunction::Zero(1);
  problem.x0 = Vector{{1, 0}};
  problem.horizon = 2;
  for (const Method method : {Method::kExponentialIntegrator, Method::kLaplaceIteration}) {
    Options options;
    options.method = method;
    options.num_steps = 10;
    const Solution solution = testing::SolveToEnd(problem, options);
    EXPECT_FALSE(JudgeSolution(solution).success) << MethodName(method);
    options.num_steps = 2000;
    EXPECT_TRUE(JudgeSolution(testing::SolveToEnd(problem, options)).success) << MethodName(method);
  }
}

// What everybody types first.
TEST(DefaultErrorTest, IsControlledWithoutBeingAskedFor) {
  const Solution solution = testing::SolveToEnd(testing::ExampleFourOne(), {});
  EXPECT_EQ(solution.method, Method::kEventDriven);
  EXPECT_EQ(solution.accuracy.tolerance, Options::kDefaultErrorTolerance);
  EXPECT_TRUE(solution.accuracy.tolerance_is_default);
  const Verdict verdict = JudgeSolution(solution);
  EXPECT_EQ(verdict.kind, VerdictKind::kSolved) << verdict.text;
  EXPECT_THAT(verdict.text, HasSubstr("(the default)"));
}

TEST(DefaultErrorTest, MentionsTheAbsoluteTolerancesThatMayHaveAcceptedMore) {
  Options options;
  EXPECT_THAT(JudgeSolution(testing::SolveToEnd(testing::ExampleFourOne(), options)).text,
              ::testing::Not(HasSubstr("absolute")));
  options.absolute_tolerances = {{{ComponentKind::kState, 0}, 1e-3}};
  EXPECT_THAT(JudgeSolution(testing::SolveToEnd(testing::ExampleFourOne(), options)).text,
              HasSubstr("an error of 1e-06 (the default) or the absolute tolerances, estimated error"));
}

// First order never gets there with the work allowed by default.
TEST(DefaultErrorTest, IsMissedWithAFigureAndBoundedWork) {
  Options options;
  options.method = Method::kTimeStepping;
  const Solution solution = testing::SolveToEnd(testing::ExampleFourOne(), options);
  EXPECT_LE(solution.cost.steps, Options::kMaxDefaultSteps / 2);
  EXPECT_GT(solution.accuracy.error, Options::kDefaultErrorTolerance);
  EXPECT_EQ(JudgeSolution(solution).kind, VerdictKind::kErrorEstimated);
  EXPECT_FALSE(JudgeSolution(solution).success);
}

// An undamped spring against a stop of stiffness 100, which keeps its energy.
Problem SpringAgainstStop(double horizon) {
  Problem problem;
  problem.A = Matrix{{0, 1}, {-1, 0}};
  problem.B = Matrix{{0}, {1}};
  problem.N = Matrix{{1, 0}};
  problem.M = Matrix{{0.01}};
  problem.f = TimeFunction::Zero(2);
  problem.g = TimeFunction::Constant(Vector{{0.5}});
  problem.x0 = Vector{{1, 0}};
  problem.horizon = horizon;
  return problem;
}

// 1, but for errors.
double EnergyOf(const Eigen::Ref<const Vector>& state) {
  const double depth = std::max(0.0, -state[0] - 0.5);
  return state.squaredNorm() + 100 * depth * depth;
}

// The bound of work ends before T, and steps without events grow beyond all bounds. What the event-driven method found
// up to there is kept.
TEST(DefaultErrorTest, AGoodBeginningIsNotGivenUpForAUselessEnd) {
  const Solution solution = testing::SolveWith(SpringAgainstStop(60'000), {});
  EXPECT_EQ(solution.method, Method::kEventDriven);
  EXPECT_FALSE(JudgeSolution(solution).success);
  EXPECT_GT(solution.failure_time, 100);
  ASSERT_GT(solution.times.size(), 5);
  for (Index k = 0; k < solution.x.cols(); ++k) EXPECT_NEAR(EnergyOf(solution.x.col(k)), 1, 1e-4);
}

// More work than is allowed, but so little more that it is worth it.
TEST(DefaultErrorTest, WhatGetsForwardMayGoOn) {
  const Solution solution = testing::SolveWith(SpringAgainstStop(3000), {});
  EXPECT_EQ(solution.method, Method::kEventDriven);
  EXPECT_TRUE(JudgeSolution(solution).success) << JudgeSolution(solution).text;
  EXPECT_NEAR(EnergyOf(solution.x.rightCols(1)), 1, 1e-4);
}

// Who asks for 20 times as many times means a longer solve.
TEST(DefaultErrorTest, MoreOutputTimesAllowMoreWork) {
  const Problem problem = SpringAgainstStop(30'000);
  EXPECT_FALSE(JudgeSolution(testing::SolveWith(problem, {})).success);
  Options options;
  options.output_times.resize(20'000);
  for (std::size_t k = 0; k < options.output_times.size(); ++k) {
    options.output_times[k] =
        problem.horizon * static_cast<double>(k + 1) / static_cast<double>(options.output_times.size());
  }
  const Solution solution = testing::SolveWith(problem, options);
  EXPECT_EQ(solution.method, Method::kEventDriven);
  EXPECT_TRUE(JudgeSolution(solution).success) << JudgeSolution(solution).text;
}

// Two pairs share one sum, and B sees one of them. If B sees both alike, or acts as N says where M + Mᵀ is zero, x is
// unique whatever y is.
TEST(SeveralSolutionsTest, OfMonotoneSystemsAreWarnedOfWhereXMayDiffer) {
  Problem problem;
  problem.A = Matrix{{-1}};
  problem.N = Matrix{{1}, {1}};
  problem.M = Matrix::Ones(2, 2);
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Constant(Vector{{-1, 1}});
  problem.x0 = Vector{{0}};
  problem.horizon = 1;
  const auto warns = [&](const Matrix& B, const Matrix& M) {
    problem.B = B;
    problem.M = M;
    const std::vector<std::string> warnings = testing::SolveToEnd(problem, {}).warnings;
    return std::any_of(warnings.begin(), warnings.end(), [](const std::string& warning) {
      return warning.find("x may be one of several solutions") != std::string::npos;
    });
  };
  const Matrix ones = Matrix::Ones(2, 2), skew{{0, 1}, {-1, 0}};
  EXPECT_TRUE(warns(Matrix{{1, 0}}, ones));
  EXPECT_FALSE(warns(Matrix{{1, 1}}, ones));
  EXPECT_FALSE(warns(Matrix{{2, 2}}, skew));
  EXPECT_FALSE(warns(Matrix{{1, 0}}, Matrix{{2, 1}, {1, 2}}));
}

// Where w = g is zero any y is a solution, and moves x.
TEST(SeveralSolutionsTest, OfAPairThatNoYActsOnAreWarnedOf) {
  Problem problem;
  problem.A = Matrix{{-1}};
  problem.B = Matrix{{1}};
  problem.M = Matrix{{0}};
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Zero(1);
  problem.x0 = Vector{{1}};
  problem.horizon = 1;
  const auto warnings = [&](double N) {
    problem.N = Matrix{{N}};
    return testing::SolveToEnd(problem, {}).warnings;
  };
  EXPECT_THAT(warnings(0),
              Contains(HasSubstr("y never affects w of constraint 0: where that w is zero, its y may be")));
  EXPECT_THAT(warnings(1), Not(Contains(HasSubstr("never affects"))));
}

// A diode bridge: two pairs share one sum, which B and N see with opposite signs, and the other two are its currents.
// With the wrong sign of a current, or one that drives another state than it depends on, nothing proves x unique.
TEST(SeveralSolutionsTest, OfACircuitAreRuledOutByItsStorage) {
  Problem problem;
  problem.A = Matrix{{-2, 0}, {0, -1}};
  problem.M = Matrix{{1, 1, 1, 0}, {1, 1, 0, 1}, {-1, 0, 0, 0}, {0, -1, 0, 0}};
  problem.f = TimeFunction::Zero(2);
  problem.g = TimeFunction::Zero(4);
  problem.x0 = Vector{{1, 1}};
  problem.horizon = 1;
  const auto warns = [&](const Matrix& B, const Matrix& N) {
    problem.B = B;
    problem.N = N;
    const std::vector<std::string> warnings = testing::SolveWith(problem, {}).warnings;
    return std::any_of(warnings.begin(), warnings.end(), [](const std::string& warning) {
      return warning.find("x may be one of several solutions") != std::string::npos;
    });
  };
  const Matrix circuit{{1, 1, 1, 1}, {0, 0, 0, 0}}, on_its_voltage{{-1, 0}, {-1, 0}, {1, 0}, {1, 0}};
  EXPECT_FALSE(warns(circuit, on_its_voltage));
  EXPECT_FALSE(warns(circuit, Matrix{{-1, 0}, {-1, 0}, {1 + 4e-10, 0}, {1, 0}})) << "data of ten digits";
  EXPECT_TRUE(warns(Matrix{{1, 1, -1, 1}, {0, 0, 0, 0}}, on_its_voltage));
  EXPECT_TRUE(warns(circuit, Matrix{{-1, 0}, {-1, 0}, {1, 0}, {0, 1}}));
}

TEST(GivenStepsTest, HaveAnEstimateUnlessItIsDeclined) {
  Options options;
  options.num_steps = 200;
  EXPECT_EQ(testing::SolveToEnd(testing::ExampleFourOne(), options).accuracy.source, AccuracySource::kCompared);
  options.estimate_error = false;
  const Solution declined = testing::SolveToEnd(testing::ExampleFourOne(), options);
  EXPECT_EQ(declined.accuracy.source, AccuracySource::kNotEstimated);
  EXPECT_FALSE(declined.accuracy.note.empty());
  EXPECT_EQ(JudgeSolution(declined).kind, VerdictKind::kErrorUnknown);
}

// Odd numbers of steps, break points and output times: whatever the grid, there is a figure.
TEST(GivenStepsTest, HaveAnEstimateOnEveryGrid) {
  Problem problem = testing::ExampleFourOne();
  problem.break_points = {0.1, 0.77};
  for (const Index steps : {1, 2, 7, 8, 33, 101, 1000}) {
    Options options;
    options.num_steps = steps;
    options.method = Method::kExponentialIntegrator;
    for (const bool few_outputs : {false, true}) {
      if (few_outputs) options.output_times = {0.123, 1};
      options.output_times_only = few_outputs;
      const Solution solution = testing::SolveToEnd(problem, options);
      ASSERT_EQ(solution.accuracy.source, AccuracySource::kCompared) << solution.accuracy.note;
      double error = 0;
      for (std::size_t k = 0; k < solution.times.size(); ++k) {
        const Vector difference =
            solution.x.col(static_cast<Index>(k)) - testing::ExampleFourOneExact(solution.times[k]);
        error = std::max(error, difference.cwiseAbs().maxCoeff());
      }
      EXPECT_GE(3 * solution.accuracy.error * solution.certificate.x_scale, error) << steps << " steps";
    }
  }
}

// Refused for memory before a node is made: 1e9 steps would take minutes and 8 GB.
TEST(GivenStepsTest, ThatDoNotFitAreRefusedAtOnce) {
  Options options;
  options.num_steps = 1'000'000'000;
  options.max_memory = 1e8;
  options.output_times = {1};
  options.output_times_only = true;
  const Solution solution = testing::SolveWith(testing::ExampleFourOne(), options);
  EXPECT_EQ(solution.termination, Termination::kUnsupported);
  EXPECT_THAT(solution.message, HasSubstr("more than the 1e+08 allowed (--max-memory"));
  EXPECT_GT(solution.cost.predicted_bytes, 8e9);
}

}  // namespace
}  // namespace dlcs
