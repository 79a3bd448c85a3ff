// SPDX-License-Identifier: Apache-2.0
#include "server/wire/convert.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <utility>

#include "google/protobuf/util/message_differencer.h"
#include "tests/server/test_requests.h"
#include "tests/support/problems.h"

namespace dlcs {
namespace {

using ::google::protobuf::util::MessageDifferencer;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::FieldsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Two states, one pair, every kind of time function.
Problem EveryKindOfPiece() {
  Problem problem;
  problem.A.MutableDense().resize(2, 2);
  problem.A.MutableDense() << 1, 2, 3, 4;
  problem.B.MutableDense().resize(2, 1);
  problem.B.MutableDense() << 5, 6;
  problem.N.MutableDense().resize(1, 2);
  problem.N.MutableDense() << 7, 8;
  problem.M.MutableDense().resize(1, 1);
  problem.M.MutableDense() << 9;
  Matrix samples(2, 3);
  samples << 1, 2, 3, 4, 5, 6;
  Matrix linear(2, 2);
  linear << 10, 20, 30, 40;
  problem.f.pieces = {{0, ConstantFunction{Vector::LinSpaced(2, 0.1, 0.2)}},
                      {1, FormulaFunction{{"sin(t)", "t**2"}}},
                      {2, SampledFunction{{2, 2.5, 3}, samples}},
                      {3, PiecewisePolynomial{{3, 3.5, 4}, {linear, Matrix::Constant(2, 1, 7)}}}};
  problem.g = TimeFunction::Constant(Vector::Constant(1, -1));
  problem.x0 = Vector::LinSpaced(2, -1, 1);
  problem.horizon = 4;
  problem.break_points = {0.5, 1.5};
  problem.rule = SolutionRule::kLeastElement;
  problem.E = Matrix{{2, 1}, {0, 3}};
  return problem;
}

TEST(ConvertTest, MatricesAreRowMajorOnTheWire) {
  const v1::Problem wire = ToProto(EveryKindOfPiece());
  EXPECT_THAT(wire.a().dense().values(), ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(wire.n().dense().values(), ElementsAre(7, 8));
  EXPECT_EQ(wire.n().dense().rows(), 1);
  EXPECT_EQ(wire.n().dense().columns(), 2);
}

TEST(ConvertTest, SamplesAndPolynomialsHaveTheComponentFastest) {
  const v1::TimeFunction wire = ToProto(EveryKindOfPiece().f);
  EXPECT_THAT(wire.pieces(2).samples().values(), ElementsAre(1, 4, 2, 5, 3, 6));
  EXPECT_THAT(wire.pieces(3).polynomial().coefficients(0).values(), ElementsAre(10, 30, 20, 40));
}

TEST(ConvertTest, ProblemSurvivesTheRoundTrip) {
  const Problem problem = EveryKindOfPiece();
  const v1::Problem wire = ToProto(problem);
  std::vector<Violation> violations;
  const Problem back = ProblemFromProto(wire, violations);
  EXPECT_THAT(violations, IsEmpty());
  EXPECT_EQ(back.A.Dense(), problem.A.Dense());
  EXPECT_EQ(back.N.Dense(), problem.N.Dense());
  EXPECT_EQ(back.E.Dense(), problem.E.Dense());
  EXPECT_EQ(back.rule, problem.rule);
  EXPECT_EQ(std::get<SampledFunction>(back.f.pieces[2].function).values,
            std::get<SampledFunction>(problem.f.pieces[2].function).values);
  EXPECT_TRUE(MessageDifferencer::Equals(ToProto(back), wire)) << wire.DebugString();
}

TEST(ConvertTest, OutputsAndMeasurementsSurviveTheRoundTrip) {
  Problem problem = testing::ExampleFourOne();
  const Index m = problem.num_states(), n = problem.num_constraints();
  problem.outputs.names = {"a", "b"};
  problem.outputs.C = Matrix::Random(2, m);
  problem.outputs.D = Matrix::Random(2, n);
  problem.outputs.h = TimeFunction::Formulas({"t", "2"});
  problem.outputs.hidden = 1;
  problem.outputs.limits = {{1, 7}};
  problem.measurements = {{.name = "mean", .outputs = {0, 1}, .begin = 0.25, .end = 0.5},
                          {.name = "late",
                           .kind = MeasurementKind::kDelay,
                           .outputs = {},
                           .end = {},
                           .at = MeasurementInstant{.time = 0.5, .outputs = {}},
                           .until = MeasurementInstant{.time = {},
                                                       .outputs = {1},
                                                       .level = 2,
                                                       .direction = CrossingDirection::kFalling,
                                                       .number = -1,
                                                       .after = 0.1}}};
  v1::Problem wire = ToProto(problem);
  std::vector<Violation> violations;
  const Problem read = ProblemFromProto(wire, violations);
  EXPECT_TRUE(violations.empty());
  EXPECT_TRUE(Validate(read).empty());
  EXPECT_EQ(ToProto(read).SerializeAsString(), wire.SerializeAsString());
  // Shapes are compared before anything is allocated.
  wire.mutable_outputs()->mutable_c()->mutable_sparse()->set_rows(2'000'000'000);
  wire.mutable_outputs()->clear_d();
  violations.clear();
  EXPECT_TRUE(ProblemFromProto(wire, violations).outputs.D.IsZero());
  ASSERT_EQ(violations.size(), 1);
  EXPECT_EQ(violations[0].field, "outputs.C");
  wire.mutable_measurements(0)->set_kind(static_cast<v1::MeasurementKind>(99));
  violations.clear();
  ProblemFromProto(wire, violations);
  EXPECT_EQ(violations.back().field, "measurements[0].kind");
}

TEST(ConvertTest, EveryRuleAndItsSelectorSurviveTheRoundTrip) {
  Problem problem = EveryKindOfPiece();
  for (const SolutionRule rule :
       {SolutionRule::kAuto, SolutionRule::kUnique, SolutionRule::kLeastElement, SolutionRule::kHiddenLeastElement,
        SolutionRule::kLeastNorm, SolutionRule::kMinimizer, SolutionRule::kSparsest}) {
    problem.rule = rule;
    std::vector<Violation> violations;
    const Problem back = ProblemFromProto(ToProto(problem), violations);
    EXPECT_THAT(violations, IsEmpty());
    EXPECT_EQ(back.rule, rule);
    EXPECT_FALSE(back.selector);
  }
  problem.selector = Selector{Matrix::Constant(2, 1, 3), Vector::LinSpaced(2, 1, 2)};
  std::vector<Violation> violations;
  const Problem back = ProblemFromProto(ToProto(problem), violations);
  EXPECT_THAT(violations, IsEmpty());
  ASSERT_TRUE(back.selector);
  EXPECT_EQ(back.selector->C, problem.selector->C);
  EXPECT_EQ(back.selector->b, problem.selector->b);
}

TEST(ConvertTest, ReadsANonlinearProblem) {
  v1::NonlinearProblem wire;
  wire.add_f("x2");
  wire.add_f("-x1");
  wire.add_g("y1+x1");
  wire.add_x0(1);
  wire.add_x0(2);
  wire.set_horizon(3);
  wire.add_break_points(0.5);
  std::vector<Violation> violations;
  NonlinearProblem problem = NonlinearProblemFromProto(wire, violations);
  EXPECT_THAT(violations, IsEmpty());
  EXPECT_THAT(problem.f, ElementsAre("x2", "-x1"));
  EXPECT_THAT(problem.g, ElementsAre("y1+x1"));
  EXPECT_EQ(problem.x0, Vector::LinSpaced(2, 1, 2));
  EXPECT_EQ(problem.horizon, 3);
  EXPECT_THAT(problem.break_points, ElementsAre(0.5));
  EXPECT_FALSE(problem.W);
  *wire.mutable_w() = testing::DenseMatrix(2, 2, {1, 2, 3, 4});
  problem = NonlinearProblemFromProto(wire, violations);
  EXPECT_EQ((*problem.W)(0, 1), 2);
  *wire.mutable_w() = testing::DenseMatrix(2, 2, {1, 2, 3});
  NonlinearProblemFromProto(wire, violations);
  EXPECT_THAT(violations, ElementsAre(Field(&Violation::field, "W")));
}

TEST(ConvertTest, OptionsSurviveTheRoundTrip) {
  Options options;
  options.method = Method::kWuChenIteration;
  options.num_steps = 77;
  options.output_times = {0.25, 1};
  options.output_times_only = true;
  options.theta = 0.5;
  options.step_solver = StepSolver::kNewton;
  options.average_y = true;
  options.kernel = KernelSource::kContour;
  options.interpolation = Interpolation::kCubicSpline;
  options.contour = ContourChoice::kRemark24;
  options.window_steps = Options::kWholeHorizon;
  options.iteration_tolerance = 1e-9;
  options.max_iterations = 12;
  options.num_contour_nodes = 31;
  options.contour_gamma = 0.7;
  options.contour_mu = 2;
  options.contour_step = 0.3;
  options.contour_for_initial_state = true;
  options.project_initial_state = true;
  options.inelastic_impact = true;
  options.estimate_error = true;
  options.error_tolerance = 1e-7;
  options.absolute_tolerance = 0;
  options.absolute_tolerances = {{{ComponentKind::kState, 1}, 1e-9},
                                 {{ComponentKind::kPair, 0}, 1e-10},
                                 {{ComponentKind::kSlack, 1}, 1e-11},
                                 {{ComponentKind::kOutput, 0}, 1e-12}};
  options.num_threads = 3;
  const ComponentNames names{{}, {"D1", "D2"}, {"v(out)"}};
  std::vector<Violation> violations;
  const Options back = OptionsFromProto(ToProto(options, names), names, 2, 2, violations);
  EXPECT_THAT(violations, IsEmpty());
  EXPECT_EQ(back.method, options.method);
  EXPECT_EQ(back.num_steps, options.num_steps);
  EXPECT_EQ(back.output_times, options.output_times);
  EXPECT_TRUE(back.output_times_only);
  EXPECT_TRUE(back.inelastic_impact);
  EXPECT_EQ(back.step_solver, StepSolver::kNewton);
  EXPECT_TRUE(back.average_y);
  EXPECT_EQ(back.kernel, KernelSource::kContour);
  EXPECT_EQ(back.interpolation, Interpolation::kCubicSpline);
  EXPECT_EQ(back.contour, ContourChoice::kRemark24);
  EXPECT_EQ(back.window_steps, options.window_steps);
  EXPECT_EQ(back.iteration_tolerance, options.iteration_tolerance);
  EXPECT_EQ(back.error_tolerance, 1e-7);
  EXPECT_EQ(back.absolute_tolerance, 0);
  ASSERT_EQ(back.absolute_tolerances.size(), 4u);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(back.absolute_tolerances[k].component, options.absolute_tolerances[k].component) << k;
    EXPECT_EQ(back.absolute_tolerances[k].tolerance, options.absolute_tolerances[k].tolerance) << k;
  }
  EXPECT_EQ(back.num_threads, options.num_threads);
  EXPECT_TRUE(MessageDifferencer::Equals(ToProto(back, names), ToProto(options, names)));
}

TEST(ConvertTest, AbsoluteTolerancesAreOfComponentsThatAreThereEachOnce) {
  const ComponentNames names{{"iL", "vC"}, {"D1"}, {"v(out)"}};
  v1::SolveOptions options;
  for (const char* name : {"iL", "vc", "w(D1)", "x1", "i(out)"}) options.add_absolute_tolerances()->set_name(name);
  std::vector<Violation> violations;
  EXPECT_EQ(OptionsFromProto(options, names, 2, 1, violations).absolute_tolerances.size(), 3u);
  EXPECT_THAT(violations,
              ElementsAre(FieldsAre("absolute_tolerances[1].name",
                                    "\"vc\"; is no state, pair or output of the problem, which has iL, vC, D1, w(D1), "
                                    "v(out); did you mean vC?"),
                          FieldsAre("absolute_tolerances[3].name", "\"x1\"; given twice; keep one of them"),
                          FieldsAre("absolute_tolerances[4].name", "\"i(out)\"; is no state, pair or output either")));
}

TEST(ConvertTest, UnsetOptionsAreTheDefaultsOfTheEngine) {
  std::vector<Violation> violations;
  const Options options = OptionsFromProto(v1::SolveOptions(), {}, 2, 2, violations);
  EXPECT_THAT(violations, IsEmpty());
  const Options defaults;
  EXPECT_EQ(options.num_steps, defaults.num_steps);
  EXPECT_EQ(options.step, defaults.step);
  EXPECT_EQ(options.iteration_tolerance, defaults.iteration_tolerance);
  EXPECT_EQ(options.num_contour_nodes, defaults.num_contour_nodes);
  EXPECT_FALSE(options.output_times_only);
}

TEST(ConvertTest, NodesOfTheGridSurviveTheRoundTrip) {
  Options options;
  options.grid_times = {0.1, 0.25, 1};
  std::vector<Violation> violations;
  const Options back = OptionsFromProto(ToProto(options), {}, 2, 2, violations);
  EXPECT_THAT(violations, IsEmpty());
  EXPECT_EQ(back.grid_times, options.grid_times);
  EXPECT_EQ(back.num_steps, 0);

  v1::SolveOptions none;
  none.mutable_grid_times();
  EXPECT_TRUE(OptionsFromProto(none, {}, 2, 2, violations).grid_times.empty());
  EXPECT_THAT(violations, ElementsAre(Field(&Violation::field, "grid_times")));
}

TEST(ConvertTest, RefusesChoicesOfANewerVersion) {
  v1::SolveOptions options;
  options.set_step_solver(static_cast<v1::StepSolver>(77));
  options.set_kernel(static_cast<v1::KernelSource>(78));
  options.set_interpolation(static_cast<v1::Interpolation>(79));
  options.mutable_contour()->set_choice(static_cast<v1::ContourChoice>(80));
  std::vector<Violation> violations;
  OptionsFromProto(options, {}, 2, 2, violations);
  ASSERT_THAT(violations,
              ElementsAre(Field(&Violation::field, "step_solver"), Field(&Violation::field, "kernel"),
                          Field(&Violation::field, "contour.choice"), Field(&Violation::field, "interpolation")));
  EXPECT_THAT(violations[0].description, HasSubstr("77"));
}

TEST(ConvertTest, MissingPartsAreNamedAllAtOnce) {
  std::vector<Violation> violations;
  ProblemFromProto(v1::Problem(), violations);
  std::vector<std::string> fields;
  for (const Violation& violation : violations) fields.push_back(violation.field);
  EXPECT_THAT(fields, ElementsAre("A", "B", "N", "M", "f", "g"));
}

TEST(ConvertTest, CountsThatDoNotMatchAreNamedWithTheNumbers) {
  v1::SolveRequest request = testing::SwitchingRequest(10);
  *request.mutable_problem()->mutable_m() = testing::DenseMatrix(2, 3, {1, 2, 3, 4, 5});
  std::vector<Violation> violations;
  ProblemFromProto(request.problem(), violations);
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].field, "M");
  EXPECT_THAT(violations[0].description, HasSubstr("5 values; 2 x 3 needs 6"));
}

TEST(ConvertTest, ProductOfHugeShapesDoesNotOverflow) {
  v1::Matrix matrix;
  matrix.mutable_dense()->set_rows(std::numeric_limits<int>::max());
  matrix.mutable_dense()->set_columns(std::numeric_limits<int>::max());
  std::vector<Violation> violations;
  EXPECT_EQ(MatrixFromProto(matrix, "A", violations).size(), 0);
  EXPECT_THAT(violations, ElementsAre(Field(&Violation::field, "A")));
}

TEST(ConvertTest, NonFiniteNumbersTravelForTheEngineToJudge) {
  v1::Matrix matrix = testing::DenseMatrix(1, 2, {std::numeric_limits<double>::quiet_NaN(), 1});
  std::vector<Violation> violations;
  const Matrix back = MatrixFromProto(matrix, "A", violations);
  EXPECT_THAT(violations, IsEmpty());
  EXPECT_TRUE(std::isnan(back(0, 0)));
}

TEST(ConvertTest, ChunkHoldsTheTimesAskedFor) {
  Solution solution;
  solution.times = {0, 1, 2, 3};
  solution.x = Matrix::Random(2, 4);
  solution.y = Matrix::Random(1, 4);
  solution.w = Matrix::Random(1, 4);
  const v1::TrajectoryChunk chunk = ChunkToProto(solution, 1, 2);
  EXPECT_EQ(chunk.first(), 1);
  EXPECT_THAT(chunk.times(), ElementsAre(1, 2));
  EXPECT_THAT(chunk.x(), ElementsAre(solution.x(0, 1), solution.x(1, 1), solution.x(0, 2), solution.x(1, 2)));
  EXPECT_THAT(chunk.y(), ElementsAre(solution.y(0, 1), solution.y(0, 2)));
  EXPECT_THAT(chunk.w(), ElementsAre(solution.w(0, 1), solution.w(0, 2)));
}

TEST(ConvertTest, LeftLimitsTravelWithTheChunkThatHoldsTheirTime) {
  Solution solution;
  solution.times = {0, 1, 2, 3};
  solution.x = Matrix::Random(2, 4);
  solution.y = Matrix::Random(1, 4);
  solution.w = Matrix::Random(1, 4);
  solution.left_limits = {{1, Vector::Constant(1, 5), Vector::Constant(1, 50)},
                          {3, Vector::Constant(1, 6), Vector::Constant(1, 60)}};
  const v1::TrajectoryChunk chunk = ChunkToProto(solution, 2, 2);
  ASSERT_EQ(chunk.left_limits_size(), 1);
  EXPECT_EQ(chunk.left_limits(0).index(), 3);
  EXPECT_THAT(chunk.left_limits(0).y(), ElementsAre(6));
  EXPECT_THAT(chunk.left_limits(0).w(), ElementsAre(60));
}

TEST(ConvertTest, SwitchingTimesAreToldUpToABound) {
  Solution solution;
  solution.switching_times.push_back({0.25, 1e-12, {1, 3}, {0}, SwitchingKind::kSwitch});
  const v1::Summary one = SummaryToProto(solution);
  ASSERT_EQ(one.switching_times_size(), 1);
  EXPECT_EQ(one.switching_times(0).time(), 0.25);
  EXPECT_THAT(one.switching_times(0).entering(), ElementsAre(1, 3));
  EXPECT_THAT(one.switching_times(0).leaving(), ElementsAre(0));
  EXPECT_EQ(one.switching_times(0).kind(), v1::SWITCHING_KIND_SWITCH);
  EXPECT_EQ(one.switching_times(0).error(), 1e-12);
  solution.switching_times.resize(12345);
  const v1::Summary many = SummaryToProto(solution);
  EXPECT_EQ(many.switching_times_size(), 10000);
  EXPECT_EQ(many.switchings(), 12345);
}

TEST(ConvertTest, FailureTimeIsAbsentWhereThereIsNone) {
  Solution solution;
  EXPECT_FALSE(SummaryToProto(solution).has_failure_time());
  solution.failure_time = 0.4375;
  EXPECT_EQ(SummaryToProto(solution).failure_time(), 0.4375);
}

TEST(ConvertTest, NewtonsMethodIsToldWhereItRan) {
  Solution solution;
  EXPECT_FALSE(SummaryToProto(solution).has_newton());
  solution.cost.newton_iterations = 12;
  solution.cost.most_newton_iterations = 3;
  solution.cost.substituted_steps = 2;
  solution.newton = {.time = 0.5, .residuals = {1, 1e-3, 0}, .contraction = std::nullopt};
  v1::Summary summary = SummaryToProto(solution);
  EXPECT_EQ(summary.cost().newton_iterations(), 12);
  EXPECT_EQ(summary.cost().most_newton_iterations(), 3);
  EXPECT_EQ(summary.cost().substituted_steps(), 2);
  EXPECT_EQ(summary.newton().time(), 0.5);
  EXPECT_THAT(summary.newton().residuals(), ElementsAre(1, 1e-3, 0));
  EXPECT_FALSE(summary.newton().has_contraction());
  solution.newton->contraction = 0.25;
  EXPECT_EQ(SummaryToProto(solution).newton().contraction(), 0.25);
}

TEST(ConvertTest, KernelAndContourAreToldWhereTheyServed) {
  Solution solution;
  EXPECT_FALSE(SummaryToProto(solution).has_kernel());
  EXPECT_FALSE(SummaryToProto(solution).has_contour());
  solution.kernel.emplace();
  solution.kernel->blocks_by_contour = 4;
  solution.kernel->fallback = "inaccurate";
  solution.contour.emplace();
  solution.contour->nodes = 25;
  solution.contour->separated = 2;
  solution.contour->choice = "Remark 2.4";
  const v1::Summary summary = SummaryToProto(solution);
  EXPECT_EQ(summary.kernel().blocks_by_contour(), 4);
  EXPECT_EQ(summary.kernel().fallback(), "inaccurate");
  EXPECT_EQ(summary.contour().nodes(), 25);
  EXPECT_EQ(summary.contour().separated(), 2);
  EXPECT_EQ(summary.contour().choice(), "Remark 2.4");
}

TEST(ConvertTest, APeriodicSolutionIsToldWithItsStability) {
  Solution solution;
  solution.measurements = {{.name = "mean", .value = 2, .time = {}, .reason = "", .note = "over one period"}};
  EXPECT_FALSE(SummaryToProto(solution).has_periodic());
  PeriodicRecord& record = solution.periodic.emplace();
  record.period = 2;
  record.multipliers = {{0.5, 0.25}};
  v1::PeriodicSolution wire = SummaryToProto(solution).periodic();
  EXPECT_EQ(wire.stability(), v1::STABILITY_UNSPECIFIED);
  EXPECT_FALSE(wire.has_growth());
  EXPECT_TRUE(wire.mean_outputs().empty());
  record.growth = -0.44;
  record.mean_outputs = Vector{{3, 4}};
  for (const auto& [stability, on_the_wire] : {std::pair(Stability::kStable, v1::STABILITY_STABLE),
                                               {Stability::kUnstable, v1::STABILITY_UNSTABLE},
                                               {Stability::kUndetermined, v1::STABILITY_UNDETERMINED}}) {
    record.stability = stability;
    wire = SummaryToProto(solution).periodic();
    EXPECT_EQ(wire.stability(), on_the_wire);
  }
  EXPECT_EQ(wire.growth(), -0.44);
  EXPECT_EQ(wire.multipliers(0).imaginary(), 0.25);
  EXPECT_THAT(wire.mean_outputs(), ::testing::ElementsAre(3, 4));
  EXPECT_EQ(SummaryToProto(solution).measurements(0).note(), "over one period");
}

TEST(ConvertTest, OptionNamesAreThoseOfTheWire) {
  EXPECT_EQ(WireOptionName("num_steps"), "steps");
  EXPECT_EQ(WireOptionName("contour_mu"), "contour.mu");
  EXPECT_EQ(WireOptionName("contour"), "contour.choice");
  EXPECT_EQ(WireOptionName("output_times[3]"), "output_times[3]");
  EXPECT_EQ(WireOptionName("step"), "step");
}

}  // namespace
}  // namespace dlcs
