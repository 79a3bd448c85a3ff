// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "core/models/signorini.h"
#include "google/protobuf/util/message_differencer.h"
#include "server/session/request_check.h"
#include "server/wire/convert.h"
#include "tests/server/test_requests.h"

namespace dlcs {
namespace {

using ::google::protobuf::util::MessageDifferencer;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kLargest = std::numeric_limits<int>::max();

struct Entry {
  int row;
  int column;
  double value;
};

v1::Matrix Sparse(int rows, int columns, const std::vector<Entry>& entries) {
  v1::Matrix matrix;
  matrix.mutable_sparse()->set_rows(rows);
  matrix.mutable_sparse()->set_columns(columns);
  for (const Entry& entry : entries) {
    matrix.mutable_sparse()->add_row_indices(entry.row);
    matrix.mutable_sparse()->add_column_indices(entry.column);
    matrix.mutable_sparse()->add_values(entry.value);
  }
  return matrix;
}

v1::Matrix Sum(const std::vector<v1::Matrix>& factors) {
  v1::Matrix matrix;
  v1::KroneckerSum& sum = *matrix.mutable_kronecker_sum();
  for (const v1::Matrix& factor : factors) *sum.add_factors() = factor;
  return matrix;
}

std::vector<Violation> ViolationsIn(const v1::Matrix& matrix) {
  std::vector<Violation> violations;
  StructuredMatrixFromProto(matrix, "A", violations);
  return violations;
}

TEST(ConvertMatrixTest, ReadsEntriesInAnyOrder) {
  std::vector<Violation> violations;
  const StructuredMatrix matrix =
      StructuredMatrixFromProto(Sparse(2, 3, {{1, 2, 4}, {0, 0, 1}, {1, 0, -2}}), "A", violations);
  EXPECT_THAT(violations, IsEmpty());
  ASSERT_NE(matrix.sparse(), nullptr);
  EXPECT_EQ(matrix.Dense(), (Matrix(2, 3) << 1, 0, 0, -2, 0, 4).finished());
}

TEST(ConvertMatrixTest, ReadsSumsOfDenseAndSparseFactors) {
  std::vector<Violation> violations;
  const StructuredMatrix matrix = StructuredMatrixFromProto(
      Sum({testing::DenseMatrix(2, 2, {1, 2, 3, 4}), Sparse(1, 1, {{0, 0, 10}})}), "A", violations);
  EXPECT_THAT(violations, IsEmpty());
  ASSERT_NE(matrix.kronecker_sum(), nullptr);
  EXPECT_EQ(matrix.Dense(), (Matrix(2, 2) << 11, 2, 3, 14).finished());
}

TEST(ConvertMatrixTest, NamesWhatIsWrong) {
  struct Case {
    v1::Matrix matrix;
    std::string field;
    std::string rule;
  };
  v1::Matrix uneven = Sparse(2, 2, {{0, 0, 1}});
  uneven.mutable_sparse()->add_values(3);
  const v1::Matrix one = Sparse(1, 1, {{0, 0, 1}});
  const std::vector<Case> cases = {
      {v1::Matrix(), "A", "must be one of dense, sparse, kronecker_sum"},
      {Sparse(-1, 2, {}), "A", "must not be negative"},
      {uneven, "A.sparse", "1 row indices, 1 column indices and 2 values; must be as many of each"},
      {Sparse(2, 2, {{0, 0, 1}, {2, 0, 1}}), "A.sparse.row_indices[1]", "2; must be at least 0 and below 2"},
      {Sparse(2, 2, {{0, -1, 1}}), "A.sparse.column_indices[0]", "-1; must be at least 0 and below 2"},
      {Sparse(2, 2, {{1, 0, 1}, {0, 0, 5}, {1, 0, 2}}), "A.sparse.values[2]",
       "row 1, column 0 is that of entry 0 too, counted from 0; every position may occur only once"},
      {Sum({}), "A.kronecker_sum", "no factors"},
      {Sum({one, Sparse(2, 1, {})}), "A.kronecker_sum.factors[1]", "2x1; must be square"},
      {Sum({one, Sum({one})}), "A.kronecker_sum.factors[1]", "must be dense or sparse"},
      {Sum({one, Sparse(1, 1, {{3, 0, 1}})}), "A.kronecker_sum.factors[1].sparse.row_indices[0]", "3; must be"},
      // 2^62 rows, and more than an int64 holds.
      {Sum({Sparse(kLargest, kLargest, {}), Sparse(kLargest, kLargest, {})}), "A", "at most 2147483647 rows"},
      {Sum(std::vector<v1::Matrix>(3, Sparse(kLargest, kLargest, {}))), "A", "at most 2147483647 rows"},
      // A factor without rows makes the whole empty, but the other one must not be made either.
      {Sum({Sparse(0, 0, {}), Sparse(kLargest, kLargest, {})}), "A.kronecker_sum.factors[0]", "0x0; must be square"},
  };
  for (const Case& c : cases) {
    EXPECT_THAT(ViolationsIn(c.matrix),
                Contains(AllOf(Field(&Violation::field, c.field), Field(&Violation::description, HasSubstr(c.rule)))))
        << c.matrix.ShortDebugString();
  }
}

TEST(ConvertMatrixTest, ListsAFewOfManyBadIndices) {
  EXPECT_LT(ViolationsIn(Sparse(1, 1, std::vector<Entry>(1000, {7, 7, 1}))).size(), 100u);
}

TEST(ConvertMatrixTest, RefusesToWriteDownWhatIsTooLarge) {
  std::vector<Violation> violations;
  EXPECT_EQ(MatrixFromProto(Sparse(kLargest, kLargest, {}), "M", violations).size(), 0);
  EXPECT_THAT(violations, ElementsAre(Field(&Violation::description, HasSubstr("entries are possible here"))));
}

TEST(ConvertMatrixTest, StructureSurvivesTheRoundTrip) {
  const auto problem = MakeSignoriniProblem({.cells = 7});
  ASSERT_TRUE(problem.ok());
  const v1::Problem wire = ToProto(*problem);
  EXPECT_EQ(wire.a().kronecker_sum().factors_size(), 2);
  std::vector<Violation> violations;
  const Problem back = ProblemFromProto(wire, violations);
  EXPECT_THAT(violations, IsEmpty());
  EXPECT_EQ(back.A.Dense(), problem->A.Dense());
  EXPECT_EQ(back.f.lift.Dense(), problem->B.Dense());
  EXPECT_EQ(back.g.lift.Dense(), problem->M.Dense());
  EXPECT_TRUE(MessageDifferencer::Equals(ToProto(back), wire));
}

TEST(ConvertMatrixTest, TheWireIsAsSmallAsTheStructure) {
  const auto problem = MakeSignoriniProblem({.cells = 256});
  ASSERT_TRUE(problem.ok());
  const v1::Problem wire = ToProto(*problem);
  EXPECT_LT(wire.ByteSizeLong(), 600'000u);  // 65,025 values of x0 are 520,200 bytes
}

// What a request of a few bytes can ask for.
TEST(ConvertMatrixTest, LimitsAreCheckedBeforeAnythingIsMade) {
  SessionLimits limits;
  limits.max_states = limits.max_constraints = 1000;
  limits.max_dense_states = 1;
  const std::vector<std::function<void(v1::Problem&)>> changes = {
      [](v1::Problem& p) { *p.mutable_a() = Sparse(kLargest, kLargest, {}); },
      [](v1::Problem& p) {
        *p.mutable_a() = Sum({Sparse(2, 2, {}), Sparse(kLargest, kLargest, {})});
      },
      [](v1::Problem& p) { *p.mutable_b() = Sparse(1, kLargest, {}); },
      [](v1::Problem& p) { *p.mutable_b() = Sparse(kLargest, 1, {}); },
      [](v1::Problem& p) { *p.mutable_n() = Sparse(1, kLargest, {}); },
      [](v1::Problem& p) { *p.mutable_m() = Sparse(1, kLargest, {}); },
      [](v1::Problem& p) { *p.mutable_f()->mutable_lift() = Sparse(1, kLargest, {}); },
      [](v1::Problem& p) { *p.mutable_g()->mutable_lift() = Sparse(1, kLargest, {}); },
      [](v1::Problem& p) {
        *p.mutable_a() = testing::DenseMatrix(2, 2, {1, 0, 0, 1});
      },
  };
  const v1::SolveRequest sound = testing::SwitchingRequest(10);
  ASSERT_TRUE(ParseAndValidate(sound.problem(), {}, limits).ok());
  for (const auto& change : changes) {
    v1::Problem problem = sound.problem();
    change(problem);
    EXPECT_EQ(ParseAndValidate(problem, {}, limits).status().code(), absl::StatusCode::kResourceExhausted)
        << problem.ShortDebugString();
  }
}

}  // namespace
}  // namespace dlcs
