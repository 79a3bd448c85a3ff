// SPDX-License-Identifier: Apache-2.0
#include "server/wire/component_names.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "server/wire/convert.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const ComponentNames kNames{{"iL", "vC"}, {"D1"}};

// The first violation of the names as "field: description"; empty if there is none.
std::string FaultOf(const ComponentNames& names, const FormulaParameters& parameters = {}) {
  std::vector<Violation> violations;
  CheckNames(names, parameters, 2, 1, violations);
  return violations.empty() ? "" : violations[0].field + ": " + violations[0].description;
}

v1::Parameter Parameter(const std::string& name, double value) {
  v1::Parameter parameter;
  parameter.set_name(name);
  parameter.set_value(value);
  return parameter;
}

TEST(CheckNamesTest, TakesAllNamesOrNone) {
  EXPECT_EQ(FaultOf({}), "");
  EXPECT_EQ(FaultOf(kNames), "");
  EXPECT_EQ(FaultOf({{"iL", "vC"}, {}}), "");
  EXPECT_EQ(FaultOf({{"x1", "x2"}, {"y1"}}), "");
  EXPECT_THAT(FaultOf({{"iL"}, {}}), HasSubstr("states: 1 names; must be 2, one for each state, or none"));
  EXPECT_THAT(FaultOf({{}, {"D1", "D2"}}), HasSubstr("pairs: 2 names; must be 1, one for each pair"));
}

TEST(CheckNamesTest, RefusesWhatFormulasKnowAndWhatStandsForTwoThings) {
  for (const char* taken : {"t", "pi", "e", "sin", "max", "2x", "a-b", "", "x 1"}) {
    EXPECT_THAT(FaultOf({{"iL", taken}, {}}), HasSubstr("states[1]: ")) << taken;
    EXPECT_THAT(FaultOf({{}, {taken}}), HasSubstr("pairs[0]: ")) << taken;
  }
  EXPECT_THAT(
      FaultOf({{"x2", "x1"}, {}}),
      HasSubstr("states[0]: \"x2\"; x, y and w with a number are names of components, and that of this one is x1"));
  EXPECT_THAT(FaultOf({{}, {"x1"}}), HasSubstr("that of this one is y1"));
  EXPECT_THAT(FaultOf({{"iL", "w1"}, {}}), HasSubstr("states[1]: \"w1\""));
  EXPECT_THAT(FaultOf({{"iL", "iL"}, {}}), HasSubstr("states[1]: \"iL\"; is already the name of states[0]"));
  EXPECT_THAT(FaultOf({{"iL", "vC"}, {"vC"}}), HasSubstr("pairs[0]: \"vC\"; is already the name of states[1]"));
  EXPECT_THAT(FaultOf({{"R", "vC"}, {}}, {{"R", 1}}),
              HasSubstr("states[0]: \"R\"; is already the name of parameters.R"));
}

TEST(ParametersTest, AreNumbersWithNamesOfTheirOwn) {
  std::vector<Violation> violations;
  google::protobuf::RepeatedPtrField<v1::Parameter> wire;
  *wire.Add() = Parameter("R", 2);
  *wire.Add() = Parameter("omega", 314);
  EXPECT_EQ(ParametersFromProto(wire, "parameters", violations), (FormulaParameters{{"R", 2}, {"omega", 314}}));
  EXPECT_THAT(violations, IsEmpty());
  *wire.Add() = Parameter("R", 3);
  *wire.Add() = Parameter("x1", 3);
  *wire.Add() = Parameter("C", std::numeric_limits<double>::infinity());
  ParametersFromProto(wire, "parameters", violations);
  EXPECT_THAT(violations,
              ElementsAre(Field(&Violation::field, "parameters.R"), Field(&Violation::field, "parameters.C"),
                          Field(&Violation::field, "parameters.x1")));
}

TEST(ParametersTest, ChangeWhereTheyAre) {
  FormulaParameters parameters{{"R", 2}, {"C", 3}};
  google::protobuf::RepeatedPtrField<v1::Parameter> overrides;
  *overrides.Add() = Parameter("R", 5);
  *overrides.Add() = Parameter("L", 5);
  std::vector<Violation> violations;
  ChangeParameters(overrides, "overrides.parameters", parameters, violations);
  EXPECT_EQ(parameters, (FormulaParameters{{"R", 5}, {"C", 3}}));
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].field, "overrides.parameters.L");
  EXPECT_THAT(violations[0].description, HasSubstr("which has C, R"));
}

TEST(NamesInFormulasTest, ReadNumbersForNames) {
  const NamesInFormulas names(kNames, {{"R", 2.5}, {"C", -1e-9}});
  EXPECT_EQ(names.InNumbers("vC*D1 - 2*iL"), "x2*y1 - 2*x1");
  EXPECT_EQ(names.InNumbers("vC2 + 1e5*sin(vC)"), "vC2 + 1e5*sin(x2)");
  EXPECT_EQ(names.InNumbers("-1/R/C"), "-1/2.5/(-1e-09)");
  EXPECT_EQ(NamesInFormulas({{"e3", "vC"}, {}}, {}).InNumbers("2.5e3"), "2.5e3");
  EXPECT_EQ(NamesInFormulas({{"pos", "speed"}, {}}, {}).InNumbers("speed+z"), "x2   +z");  // at position 7 as before
  EXPECT_EQ(NamesInFormulas({}, {}).InNumbers("x1"), "x1");
}

TEST(WithNamesTest, PutsNamesBehindIndices) {
  EXPECT_EQ(WithNames("(N x + g)[0] = -1 at t = 0", kNames), "(N x + g)[0] (D1) = -1 at t = 0");
  EXPECT_EQ(WithNames("x0[1]", kNames), "x0[1] (vC)");
  EXPECT_EQ(WithNames("f[0], \"1/t\", is inf; x[1] and y[0]", kNames),
            "f[0] (iL), \"1/t\", is inf; x[1] (vC) and y[0] (D1)");
  EXPECT_EQ(WithNames("max[0] members[1] x[7] x[a] x[", kNames), "max[0] members[1] x[7] x[a] x[");
  EXPECT_EQ(WithNames("x[1]", {}), "x[1]");
}

TEST(AddNamesTest, NamesRowsAndColumnsOfMatrices) {
  std::vector<Violation> violations = {{"A[1][0]", "nan"}, {"B[0][0]", "nan"}, {"N[0][1]", "inf; see x0[0]"},
                                       {"M[0][0]", "nan"}, {"A", "2x1"},       {"T", "-1"}};
  AddNames(kNames, violations);
  EXPECT_EQ(violations[0].field, "A[1][0] (vC, iL)");
  EXPECT_EQ(violations[1].field, "B[0][0] (iL, D1)");
  EXPECT_EQ(violations[2].field, "N[0][1] (D1, vC)");
  EXPECT_EQ(violations[2].description, "inf; see x0[0] (iL)");
  EXPECT_EQ(violations[3].field, "M[0][0] (D1, D1)");
  EXPECT_EQ(violations[4].field, "A");
  EXPECT_EQ(violations[5].field, "T");
}

v1::EntryFormula EntryOf(int index, const std::string& formula) {
  v1::EntryFormula entry;
  entry.set_index(index);
  entry.set_formula(formula);
  return entry;
}

TEST(EntryFormulasTest, AreEvaluatedWithTheParameters) {
  const FormulaParameters parameters{{"R", 2}, {"C", 0.25}};
  v1::Matrix wire = testing::DenseMatrix(2, 2, {-1, 0, 0, 4});
  *wire.mutable_dense()->add_formulas() = EntryOf(1, "-1/R/C");
  *wire.mutable_dense()->add_formulas() = EntryOf(2, "sqrt(C)*pi");
  std::vector<Violation> violations;
  const Matrix matrix = MatrixFromProto(wire, "A", violations, &parameters);
  EXPECT_THAT(violations, IsEmpty());
  EXPECT_EQ(matrix(0, 1), -2);
  EXPECT_EQ(matrix(1, 0), 0.5 * 3.14159265358979323846);
  EXPECT_EQ(matrix(1, 1), 4);

  v1::Matrix sparse;
  v1::SparseMatrix& entries = *sparse.mutable_sparse();
  entries.set_rows(3);
  entries.set_columns(3);
  for (const int k : {2, 0}) {
    entries.add_row_indices(k);
    entries.add_column_indices(0);
    entries.add_values(7);
  }
  *entries.add_formulas() = EntryOf(0, "R**3");
  const StructuredMatrix read = StructuredMatrixFromProto(sparse, "A", violations, &parameters);
  EXPECT_THAT(violations, IsEmpty());
  EXPECT_TRUE(read.sparse() != nullptr);
  EXPECT_EQ(read.Dense()(2, 0), 8);
  EXPECT_EQ(read.Dense()(0, 0), 7);
}

TEST(EntryFormulasTest, SayWhatIsWrongWithThem) {
  const FormulaParameters parameters{{"R", 2}, {"zero", 0}};
  const auto fault = [&](int index, const std::string& formula, const FormulaParameters* with) {
    v1::Matrix wire = testing::DenseMatrix(1, 2, {1, 2});
    *wire.mutable_dense()->add_formulas() = EntryOf(index, formula);
    std::vector<Violation> violations;
    MatrixFromProto(wire, "A", violations, with);
    return violations.empty() ? "" : violations[0].field + ": " + violations[0].description;
  };
  EXPECT_EQ(fault(1, "R", &parameters), "");
  EXPECT_THAT(fault(1, "1/L", &parameters), HasSubstr("A[0][1]: \"1/L\": at position 3"));
  EXPECT_THAT(fault(0, "R*t", &parameters), HasSubstr("A[0][0]: \"R*t\"; depends on t"));
  EXPECT_THAT(fault(0, "1/zero", &parameters), HasSubstr("A[0][0]: \"1/zero\"; is inf and must be finite"));
  EXPECT_THAT(fault(2, "R", &parameters), HasSubstr("A.formulas[0].index: 2; must be at least 0, below 2"));
  EXPECT_THAT(fault(0, "1", nullptr), HasSubstr("only matrices of a problem may have formulas as entries"));
}

// x' = -x/(R C) + y, w = N x + M y + amplitude.
v1::Problem Circuit() {
  v1::Problem problem = testing::SwitchingRequest(10).problem();
  *problem.add_parameters() = Parameter("R", 2);
  *problem.add_parameters() = Parameter("amplitude", 0.5);
  *problem.mutable_a()->mutable_dense()->add_formulas() = EntryOf(0, "-1/R");
  problem.mutable_g()->mutable_pieces(0)->mutable_formulas()->set_formulas(0, "amplitude*cos(3*t)");
  problem.add_state_names("vC");
  problem.add_pair_names("D1");
  return problem;
}

TEST(ProblemParametersTest, ReachMatricesAndFormulas) {
  std::vector<Violation> violations;
  const Problem problem = ProblemFromProto(Circuit(), violations);
  EXPECT_THAT(violations, IsEmpty());
  EXPECT_EQ(problem.A.Dense()(0, 0), -0.5);
  EXPECT_THAT(Validate(problem), IsEmpty());
  auto g = TimeFunctionEvaluator::Create(problem.g, 1);
  ASSERT_TRUE(g.ok()) << g.status();
  Vector value(1);
  g->Evaluate(0, Side::kRight, value);
  EXPECT_EQ(value[0], 0.5);
}

// Outputs are shown in place of states and pairs, so "vC" may be the one or the other.
TEST(ProblemOutputsTest, MayHaveTheNamesOfStatesAndPairs) {
  v1::Problem problem = Circuit();
  for (const char* name : {"vC", "D1", "t"}) problem.mutable_outputs()->add_names(name);
  std::vector<Violation> violations;
  const Problem read = ProblemFromProto(problem, violations);
  EXPECT_THAT(violations, IsEmpty());
  EXPECT_THAT(Validate(read), IsEmpty());
  EXPECT_EQ(read.outputs.names.size(), 3u);
}

TEST(ProblemParametersTest, OfAMemberChangeItsFormulasButNoMatrix) {
  v1::EnsembleMember member;
  *member.add_parameters() = Parameter("amplitude", 3);
  std::vector<Violation> violations;
  const EnsembleMember read = MemberFromProto(member, Circuit(), "members[4]", violations);
  EXPECT_THAT(violations, IsEmpty());
  ASSERT_TRUE(read.g);
  auto g = TimeFunctionEvaluator::Create(*read.g, 1);
  ASSERT_TRUE(g.ok()) << g.status();
  Vector value(1);
  g->Evaluate(0, Side::kRight, value);
  EXPECT_EQ(value[0], 3);
  *member.add_parameters() = Parameter("R", 1);
  MemberFromProto(member, Circuit(), "members[4]", violations);
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].field, "members[4].parameters");
  EXPECT_THAT(violations[0].description, HasSubstr("change A, which all members of an ensemble share"));
}

TEST(ComponentNamedTest, FindsWhatIsDisplayed) {
  for (const ComponentNames& names :
       {kNames, ComponentNames{}, ComponentNames{{}, {"D1"}, {"v(out)", "x1"}}, ComponentNames{{"x1", "x2"}, {"y1"}},
        ComponentNames{{"iL", "vC"}, {}, {"x1", "w(D1)"}}}) {
    for (const ComponentKind kind : kComponentKinds) {
      const Index size = kind == ComponentKind::kState    ? 2
                         : kind == ComponentKind::kOutput ? static_cast<Index>(names.outputs.size())
                                                          : 1;
      for (Index i = 0; i < size; ++i) {
        const std::string name = DisplayName({kind, i}, names);
        const bool is_of_state = kind == ComponentKind::kOutput && name == "x1" && names.states.empty();
        const Component expected = is_of_state ? Component{ComponentKind::kState, 0} : Component{kind, i};
        EXPECT_EQ(ComponentNamed(name, names, 2, 1), expected) << name;
      }
    }
  }
}

TEST(ComponentNamedTest, KnowsEveryComponentByItsNumberToo) {
  EXPECT_EQ(ComponentNamed("x2", kNames, 2, 1), (Component{ComponentKind::kState, 1}));
  EXPECT_EQ(ComponentNamed("w1", kNames, 2, 1), (Component{ComponentKind::kSlack, 0}));
  for (const char* none : {"x0", "x3", "y2", "w", "", "w()", "z1", "x18446744073709551616", "w(vC)"}) {
    EXPECT_EQ(ComponentNamed(none, kNames, 2, 1), std::nullopt) << none;
  }
}

TEST(ComponentNamedTest, SaysWhatThereIsInstead) {
  EXPECT_EQ(NoComponentNamed("VC", kNames, 2, 1),
            "\"VC\"; is no state, pair or output of the problem, which has iL, vC, D1, w(D1); did you mean vC?");
  EXPECT_EQ(NoComponentNamed("voltage", kNames, 2, 1),
            "\"voltage\"; is no state, pair or output of the problem, which has iL, vC, D1, w(D1)");
  EXPECT_THAT(NoComponentNamed("x_3000", {}, 5000, 10),
              HasSubstr("which has x1, x2, x3, x4, x5, x6, x7, x8 and 5012 more; did you mean x3000?"));
}

}  // namespace
}  // namespace dlcs
