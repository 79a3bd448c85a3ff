// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/mode_tile.h"

#include <gtest/gtest.h>

#include "core/linalg/norms.h"
#include "core/propagator/mode_history.h"

namespace dlcs {
namespace {

struct Sums {
  Matrix nodes, middles;
  Matrix past;
};

// The recursion as it is written.
Sums Recur(const ModeRecursion& recursion, const Matrix& inputs, bool forgets_first) {
  const Index modes = inputs.rows(), steps = inputs.cols() - 1;
  Sums sums{Matrix(modes, steps), Matrix(modes, steps), recursion.start};
  sums.past.array().colwise() *= inputs.col(0).array();
  Vector before = inputs.col(0);
  if (forgets_first) before.setZero();
  for (Index j = 1; j <= steps; ++j) {
    const Vector after = inputs.col(j);
    sums.middles.col(j - 1) = recursion.mid_before.cwiseProduct(before) + recursion.mid_after.cwiseProduct(after) +
                              recursion.mid_past.cwiseProduct(sums.past).rowwise().sum();
    sums.past = (recursion.decay.cwiseProduct(sums.past)).colwise() + before;
    sums.nodes.col(j - 1) = recursion.now.cwiseProduct(after) + recursion.past.cwiseProduct(sums.past).rowwise().sum();
    before = after;
  }
  return sums;
}

ModeRecursion RandomRecursion(Index modes, Index terms) {
  const auto some = [&] { return Matrix(Matrix::Random(modes, terms)); };
  return {.decay = some(),
          .start = some(),
          .past = some(),
          .mid_past = some(),
          .now = Vector::Random(modes),
          .mid_before = Vector::Random(modes),
          .mid_after = Vector::Random(modes)};
}

// Modes and exponentials that fill no vector, steps that fill no block.
TEST(ModeTileTest, CarriesAsTheRecursionIsWritten) {
  std::srand(5);
  for (const Index terms : {1, 4, 7}) {
    for (const bool forgets_first : {false, true}) {
      constexpr Index kModes = 21, kSteps = 150;
      ModeRecursion recursion = RandomRecursion(kModes, terms);
      if (forgets_first) recursion.start.setZero();
      const Matrix inputs = Matrix::Random(kModes, kSteps + 1);
      const Sums expected = Recur(recursion, inputs, forgets_first);
      Matrix nodes(kModes, kSteps), middles = nodes, past(kModes, terms);
      for (Index begin = 0; begin < kModes; begin += ModeTile::kModes) {
        const Index count = std::min(ModeTile::kModes, kModes - begin);
        const ModeTile::Terms terms_of_tile(recursion, begin, count);
        ModeTile tile(terms_of_tile, inputs.col(0), forgets_first, ModeTile::kSteps);
        for (Index from = 0; from < kSteps; from += ModeTile::kSteps) {
          const Index steps = std::min(ModeTile::kSteps, kSteps - from);
          tile.Carry(inputs.middleCols(from + 1, steps), ModeTile::Sums::kNodesAndMiddles);
          tile.StoreNodes(nodes.middleCols(from, steps));
          tile.StoreMiddles(middles.middleCols(from, steps));
        }
        past.middleRows(begin, count) = tile.Past();
      }
      EXPECT_LE(MaxAbs(nodes - expected.nodes), 1e-13 * MaxAbs(expected.nodes));
      EXPECT_LE(MaxAbs(middles - expected.middles), 1e-13 * MaxAbs(expected.middles));
      EXPECT_LE(MaxAbs(past - expected.past), 1e-13 * MaxAbs(expected.past));
    }
  }
}

TEST(ModeHistoryTest, IsThatOfTheRecursion) {
  std::srand(7);
  for (const Index modes : {1, 8, 21}) {
    for (const bool forgets_first : {false, true}) {
      constexpr Index kSteps = 30;
      ModeRecursion recursion = RandomRecursion(modes, 5);
      recursion.now.setZero();
      if (forgets_first) recursion.start.setZero();
      const Matrix inputs = Matrix::Random(modes, kSteps + 1);
      const Matrix expected = Recur(recursion, inputs, forgets_first).nodes;
      ModeHistory past(recursion, inputs.col(0), forgets_first);
      for (Index j = 1; j <= kSteps; ++j) {
        EXPECT_LE(MaxAbs(past.sum() - expected.col(j - 1)), 1e-13 * MaxAbs(expected));
        ModeHistory other = past;  // a copy takes nothing along
        other.Push(Vector::Ones(modes));
        past.Push(inputs.col(j));
      }
    }
  }
}

// The same bits for a mode, whatever stands beside it and whichever sums are asked for.
TEST(ModeTileTest, KeepsTheBitsOfAMode) {
  std::srand(6);
  const ModeRecursion recursion = RandomRecursion(20, 6);
  const Matrix inputs = Matrix::Random(20, 31);
  Matrix alone(20, 30), among(20, 30);
  const ModeTile::Terms of_one(recursion, 9, 1), of_many(recursion, 3, 15);
  ModeTile one(of_one, inputs.col(0), false, ModeTile::kSteps), many(of_many, inputs.col(0), false, ModeTile::kSteps);
  one.Carry(inputs.rightCols(30), ModeTile::Sums::kNodes);
  one.StoreNodes(alone);
  many.Carry(inputs.rightCols(30), ModeTile::Sums::kNodesAndMiddles);
  many.StoreNodes(among);
  EXPECT_EQ(alone.row(9), among.row(9));
  EXPECT_EQ(one.Past(), many.Past().row(6));
}

}  // namespace
}  // namespace dlcs
