// SPDX-License-Identifier: Apache-2.0
#include "core/problem/number_range.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "core/problem/validate.h"
#include "core/problem/verdict.h"
#include "core/solve.h"

namespace dlcs {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// x' = -x + y + f, 0 <= y ⟂ x - 1 + 2 y >= 0.
Problem SmallProblem() {
  Problem problem;
  problem.A = Matrix{{-1}};
  problem.B = Matrix{{1}};
  problem.N = Matrix{{1}};
  problem.M = Matrix{{2}};
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Constant(Vector::Constant(1, -1));
  problem.x0 = Vector::Constant(1, 1);
  problem.horizon = 4;
  return problem;
}

// The first violation as one line.
std::string FirstOf(const Problem& problem) {
  const std::vector<Violation> violations = Validate(problem, Options());
  return violations.empty() ? "" : violations.front().field + ": " + violations.front().description;
}

absl::StatusOr<Solution> SolveAny(const Problem& problem, const Options& options) {
  Observer observer;
  return Solve(problem, options, observer, {});
}

constexpr const char* kBeyond = "beyond the largest number, 1.8e308; choose other units";

TEST(NumberRangeTest, NamesEachProductThatOverflows) {
  Problem NB = SmallProblem();
  NB.B = Matrix{{1e308}};
  NB.N = Matrix{{1e308}};
  EXPECT_EQ(FirstOf(NB), std::string("N[0][0]: 1e+308; times B[0][0] = 1e+308, in N B, it is ") + kBeyond);
  Problem Ax = SmallProblem();
  Ax.A = Matrix{{-1e200}};
  Ax.x0 = Vector::Constant(1, 1e200);
  EXPECT_EQ(FirstOf(Ax), std::string("x0[0]: 1e+200; times A[0][0] = -1e+200, in A x0, it is ") + kBeyond);
  Problem Nx = SmallProblem();
  Nx.N = Matrix{{1e200}};
  Nx.x0 = Vector::Constant(1, 1e200);
  EXPECT_EQ(FirstOf(Nx), std::string("x0[0]: 1e+200; times N[0][0] = 1e+200, in N x0, it is ") + kBeyond);
  Problem My = SmallProblem();
  My.M = Matrix{{1e-308}};
  My.g = TimeFunction::Constant(Vector::Constant(1, -100));
  EXPECT_THAT(FirstOf(My), AllOf(HasSubstr("M[0]: "), HasSubstr("(N x0 + g)[0] = -99 at t = 0"), HasSubstr(kBeyond)));
}

TEST(NumberRangeTest, NamesWhatAMassMatrixMakesTooLarge) {
  Problem of_A = SmallProblem();
  of_A.E = Matrix{{1e-200}};
  of_A.A = Matrix{{-1e200}};
  EXPECT_EQ(FirstOf(of_A), std::string("A[0][0]: -1e+200; divided by E[0][0] = 1e-200 it is ") + kBeyond);
  Problem of_B = SmallProblem();
  of_B.E = Matrix{{1e-200}};
  of_B.B = Matrix{{1e200}};
  EXPECT_EQ(FirstOf(of_B), std::string("B[0][0]: 1e+200; divided by E[0][0] = 1e-200 it is ") + kBeyond);
  Problem of_f = SmallProblem();
  of_f.E = Matrix{{1e-200}};
  of_f.f = TimeFunction::Constant(Vector::Constant(1, 1e200));
  EXPECT_EQ(FirstOf(of_f), std::string("f[0]: 1e+200; divided by E[0][0] = 1e-200 it is ") + kBeyond);
  // One that is not diagonal.
  Problem coupled = SmallProblem();
  coupled.E = Matrix{{2e-200, 1e-200}, {1e-200, 2e-200}};
  coupled.A = Matrix{{-1e200, 0}, {0, -1e200}};
  coupled.B = Matrix{{1}, {1}};
  coupled.N = Matrix{{1, 1}};
  coupled.f = TimeFunction::Zero(2);
  coupled.x0 = Vector{{1, 1}};
  const absl::StatusOr<Solution> solution = SolveAny(coupled, {});
  EXPECT_THAT(std::string(solution.status().message()), AllOf(HasSubstr("E: too small beside A"), HasSubstr(kBeyond)));
}

// Sparse matrices, with the place of the entries.
TEST(NumberRangeTest, FindsTheEntriesOfSparseMatrices) {
  Problem problem = SmallProblem();
  const Index m = 50;
  SparseMatrix A(m, m), B(m, 1), N(1, m);
  for (Index i = 0; i < m; ++i) A.insert(i, i) = -1;
  B.insert(7, 0) = 1e300;
  N.insert(0, 3) = 1e300;
  problem.A = A;
  problem.B = B;
  problem.N = N;
  problem.f = TimeFunction::Zero(m);
  problem.x0 = Vector::Ones(m);
  EXPECT_THAT(Validate(problem, Options()), IsEmpty());  // entries that do not meet
  B.insert(3, 0) = -1e10;
  problem.B = B;
  EXPECT_THAT(FirstOf(problem), HasSubstr("N[0][3]: 1e+300; times B[3][0] = -1e+10, in N B, it is beyond"));
}

// The rule has no margin: what does not overflow is solved, by the same numbers in other units. x = 2^k x', y = 2^j y'.
TEST(NumberRangeTest, OtherUnitsAreSolvedAsBefore) {
  const absl::StatusOr<Solution> plain = SolveAny(SmallProblem(), {});
  ASSERT_TRUE(plain.ok()) << plain.status();
  ASSERT_EQ(plain->termination, Termination::kReachedEnd);
  for (const int k : {-300, 300}) {
    const double unit = std::ldexp(1, k);
    Problem problem = SmallProblem();
    problem.B = Matrix{{unit}};
    problem.N = Matrix{{1 / unit}};
    problem.x0 = Vector{{unit}};
    ASSERT_THAT(Validate(problem, Options()), IsEmpty());
    const absl::StatusOr<Solution> solution = SolveAny(problem, {});
    ASSERT_TRUE(solution.ok()) << solution.status();
    ASSERT_EQ(solution->termination, Termination::kReachedEnd) << solution->message;
    EXPECT_EQ(solution->x(0, solution->x.cols() - 1), unit * plain->x(0, plain->x.cols() - 1));
  }
}

// Growth that ends where N x overflows, though x is finite.
TEST(NumberRangeTest, AFailedSolveDoesNotBlameTheStateAlone) {
  Problem problem = SmallProblem();
  problem.A = Matrix{{1}};
  problem.N = Matrix{{1e200}};
  problem.g = TimeFunction::Constant(Vector::Constant(1, 0));
  problem.horizon = 400;
  Options options;
  options.method = Method::kTimeStepping;
  options.num_steps = 4000;
  const absl::StatusOr<Solution> solution = SolveAny(problem, options);
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_EQ(solution->termination, Termination::kNonFinite);
  EXPECT_THAT(solution->message, HasSubstr("The state, or a product of it with A, B, N or M, is no longer finite"));
}

// f drives w by N f = 1e310: the start is fine, every later w is not.
TEST(NumberRangeTest, AFailedSolveNamesTheProduct) {
  Problem problem = SmallProblem();
  problem.N = Matrix{{1e160}};
  problem.M = Matrix{{0}};
  problem.B = Matrix{{1e140}};
  problem.g = TimeFunction::Constant(Vector::Constant(1, 0));
  problem.f = TimeFunction::Constant(Vector::Constant(1, -1e150));
  for (const Method method : {Method::kEventDriven, Method::kTimeStepping}) {
    Options options;
    options.method = method;
    if (method == Method::kTimeStepping) options.num_steps = 100;
    const absl::StatusOr<Solution> solution = SolveAny(problem, options);
    ASSERT_TRUE(solution.ok()) << solution.status();
    ASSERT_FALSE(JudgeSolution(*solution).success);
    const bool reached = solution->termination == Termination::kReachedEnd;
    EXPECT_TRUE(reached || solution->termination == Termination::kNonFinite) << solution->message;
    ASSERT_TRUE(!reached || !solution->warnings.empty());
    EXPECT_THAT(reached ? solution->warnings.front() : solution->message,
                AllOf(HasSubstr("of N f is "), HasSubstr(kBeyond)));
  }
}

TEST(NumberRangeTest, ATooLongHorizonIsNamedAsThat) {
  Problem problem = SmallProblem();
  problem.f = TimeFunction::Formulas({"sin(t)"});
  problem.horizon = 1e300;
  const absl::StatusOr<Solution> solution = SolveAny(problem, {});
  ASSERT_TRUE(solution.ok()) << solution.status();
  EXPECT_NE(solution->termination, Termination::kReachedEnd);
  EXPECT_THAT(solution->message, HasSubstr("T = 1e+300 is too long: numbers near it are 1.48702e+284 apart, more than "
                                           "1/\u2016A\u2016 = 1; choose a shorter T."));
  // A long time at rest is none.
  problem.f = TimeFunction::Zero(1);
  problem.g = TimeFunction::Constant(Vector::Constant(1, 1));
  problem.horizon = 1e17;
  const absl::StatusOr<Solution> rest = SolveAny(problem, {});
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_EQ(rest->termination, Termination::kReachedEnd) << rest->message;
  EXPECT_THAT(rest->message, Not(HasSubstr("too long")));
}

TEST(NumberRangeTest, NothingOverflowsInOrdinaryNumbers) {
  const Problem problem = SmallProblem();
  EXPECT_EQ(OverflowAt(problem, problem.x0, Vector::Constant(1, 1), 0), "");
  EXPECT_EQ(UnresolvedHorizon(problem), "");
  EXPECT_THAT(OverflowAt(problem, Vector::Constant(1, 1e308), Vector::Constant(1, 1e308), 1),
              AllOf(HasSubstr("At t = 1 component 0 of "), HasSubstr(kBeyond)));
}

}  // namespace
}  // namespace dlcs
