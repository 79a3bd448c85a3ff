// SPDX-License-Identifier: Apache-2.0
#include "core/ensemble.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <new>
#include <stdexcept>
#include <thread>

#include "core/models/signorini.h"
#include "core/parallel/parallel.h"
#include "core/solve.h"
#include "tests/support/problems.h"
#include "tests/support/solving.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;

std::map<Index, Solution> SolveAll(const Problem& base, const std::vector<EnsembleMember>& members,
                                   const Options& options, SetupCache* setups = nullptr) {
  std::map<Index, Solution> solutions;
  const absl::Status status = SolveEnsemble(
      base, members, options, [&](Index k, Solution solution) { solutions.emplace(k, std::move(solution)); }, {},
      setups);
  EXPECT_TRUE(status.ok()) << status;
  return solutions;
}

std::vector<EnsembleMember> Variations(const Problem& base) {
  std::vector<EnsembleMember> members(6);
  members[1].x0 = Vector(base.x0 * 0.5);
  members[2].horizon = base.horizon / 2;
  members[3].f = TimeFunction::Zero(base.num_states());
  members[4].break_points = std::vector<double>{0.3 * base.horizon};
  members[5].g = base.g;
  return members;
}

// Whatever is shared, each member has the bits of its own solve, on any number of threads.
TEST(EnsembleTest, MembersHaveTheBitsOfTheirOwnSolves) {
  for (const Method method : {Method::kExponentialIntegrator, Method::kLaplaceIteration, Method::kTimeStepping}) {
    for (const Problem& base :
         {testing::FourVariableEasy(), *MakeSignoriniProblem({.cells = 12, .coefficient = 2e-3})}) {
      const std::vector<EnsembleMember> members = Variations(base);
      Options options;
      options.num_steps = 64;
      options.method = method;
      options.num_threads = 2;
      SetupCache setups(1e8);
      const auto solutions = SolveAll(base, members, options, &setups);
      ASSERT_EQ(solutions.size(), members.size());
      for (const auto& [k, solution] : solutions) {
        Observer silent;
        const auto own = Solve(MemberProblem(base, members[static_cast<std::size_t>(k)]), options, silent, {});
        ASSERT_TRUE(own.ok());
        EXPECT_EQ(solution.termination, own->termination) << k;
        EXPECT_EQ(solution.x, own->x) << k;
        EXPECT_EQ(solution.y, own->y) << k;
      }
      EXPECT_GT(setups.statistics().hits, 0);
    }
  }
}

TEST(EnsembleTest, NamesTheMemberThatBreaksARule) {
  const Problem base = testing::FourVariableEasy();
  std::vector<EnsembleMember> members(3);
  members[1].x0 = Vector::Zero(2);
  members[2].horizon = -1;
  const auto message = [&](const std::vector<EnsembleMember>& of) {
    return std::string(SolveEnsemble(base, of, {}, [](Index, Solution) { FAIL(); }, {}).message());
  };
  EXPECT_THAT(message(members), HasSubstr("members[1].x0: 2 components"));
  EXPECT_THAT(message(members), HasSubstr("members[2].T: -1"));
  EXPECT_EQ(message({}), "members: empty; an ensemble has at least one");
}

// A horizon of a member's own may leave a break point or an output time of the others outside.
TEST(EnsembleTest, NamesTheMemberWhoseHorizonBreaksWhatAllShare) {
  Problem base = testing::FourVariableEasy();
  base.break_points = {0.5 * base.horizon};
  Options options;
  options.output_times = {base.horizon};
  options.output_times_only = true;
  std::vector<EnsembleMember> members(2);
  members[1].horizon = 0.25 * base.horizon;
  const std::vector<Violation> violations = Validate(base, members, options);
  ASSERT_EQ(violations.size(), 2U);
  EXPECT_EQ(violations[0].field, "members[1]");
  EXPECT_THAT(violations[0].description, HasSubstr("break_points[0]: "));
  EXPECT_THAT(violations[1].description, HasSubstr("output_times[0]: "));
}

TEST(EnsembleTest, MistakesOfTheBaseAreSaidOnceAlsoWhereTheFirstMemberMendsThem) {
  Problem base = testing::FourVariableEasy();
  base.x0 = Vector::Zero(1);
  std::vector<EnsembleMember> members(3);
  members[0].x0 = Vector::Zero(base.num_states());
  const std::vector<Violation> violations = Validate(base, members, {});
  ASSERT_EQ(violations.size(), 1U);
  EXPECT_EQ(violations[0].field, "x0");
}

TEST(EnsembleTest, MembersThatMayNotBeginAreNotHeardOf) {
  const Problem base = testing::FourVariableEasy();
  Options options;
  options.num_steps = 20;
  std::vector<Index> finished;
  const absl::Status status = SolveEnsemble(
      base, std::vector<EnsembleMember>(6), options, [&](Index k, Solution) { finished.push_back(k); }, {}, nullptr,
      [](Index k) { return k % 2 == 0; });
  EXPECT_TRUE(status.ok());
  EXPECT_THAT(finished, ::testing::UnorderedElementsAre(0, 2, 4));
}

TEST(OwnThreadsTest, EachIsCalledOnceAndWhatOneThrowsIsThrownAgain) {
  std::vector<std::atomic<int>> calls(100);
  ForEachOnOwnThreads(100, 4, [&](Index k) { ++calls[static_cast<std::size_t>(k)]; });
  for (const std::atomic<int>& count : calls) EXPECT_EQ(count, 1);
  std::atomic<int> begun = 0;
  EXPECT_THROW(ForEachOnOwnThreads(1000, 2,
                                   [&](Index k) {
                                     ++begun;
                                     if (k == 3) throw std::runtime_error("broken");
                                   }),
               std::runtime_error);
  EXPECT_GE(begun, 4);
  ForEachOnOwnThreads(0, 0, [](Index) { FAIL(); });
}

TEST(EnsembleTest, AFailedMemberIsASolutionAndAStopEndsTheRest) {
  const Problem base = testing::FourVariableEasy();
  std::vector<EnsembleMember> members(20);
  Options options;
  options.num_steps = 50;
  options.num_threads = 1;
  std::stop_source stop;
  Index solved = 0, cancelled = 0;
  const absl::Status status = SolveEnsemble(
      base, members, options,
      [&](Index, Solution solution) {
        if (solution.termination == Termination::kCancelled) {
          ++cancelled;
        } else if (++solved == 3) {
          stop.request_stop();
        }
      },
      stop.get_token());
  EXPECT_TRUE(status.ok());
  EXPECT_EQ(solved, 3);
  EXPECT_EQ(cancelled, 17);
}

TEST(SetupCacheTest, KeepsWithinItsBoundTheValuesUsedLast) {
  SetupCache cache(1000);
  int made = 0;
  const auto get = [&](double name, double bytes) {
    return *cache.Get<double>(SetupKey("number").Add(name), [&]() -> SetupCache::Made<double> {
      ++made;
      return {std::make_shared<const double>(2 * name), bytes};
    });
  };
  EXPECT_EQ(get(1, 300), 2);
  EXPECT_EQ(get(2, 300), 4);
  EXPECT_EQ(get(1, 300), 2);
  EXPECT_EQ(made, 2);
  EXPECT_EQ(get(3, 600), 6);  // drops 2, the one not used for longest
  EXPECT_EQ(get(1, 300), 2);
  EXPECT_EQ(made, 3);
  EXPECT_EQ(get(2, 300), 4);
  EXPECT_EQ(made, 4);
  EXPECT_EQ(get(4, 1e6), 8);  // larger than the bound: handed out all the same
  const SetupCache::Statistics statistics = cache.statistics();
  EXPECT_EQ(statistics.hits, 2);
  EXPECT_EQ(statistics.misses, 5);
  EXPECT_EQ(statistics.values, 1);
}

TEST(SetupCacheTest, ManyThreadsShareOneMaking) {
  SetupCache cache(1e6);
  std::atomic<int> made = 0;
  std::vector<std::thread> threads;
  for (int k = 0; k < 8; ++k) {
    threads.emplace_back([&] {
      for (int i = 0; i < 100; ++i) {
        const auto value = cache.Get<int>(SetupKey("i").Add(Index{i}), [&]() -> SetupCache::Made<int> {
          ++made;
          std::this_thread::yield();
          return {std::make_shared<const int>(i), 8};
        });
        EXPECT_EQ(*value, i);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(made, 100);
  EXPECT_EQ(cache.statistics().hits, 700);
}

TEST(SetupCacheTest, NullIsNotKept) {
  SetupCache cache(1e6);
  int asked = 0;
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(
        cache.Get<int>(SetupKey("x"), [&]() -> SetupCache::Made<int> { return ++asked, SetupCache::Made<int>{}; }),
        nullptr);
  }
  EXPECT_EQ(asked, 2);
  EXPECT_EQ(cache.statistics().values, 0);
}

TEST(SetupCacheTest, AfterAMakerThatThrowsTheNextOneMakes) {
  SetupCache cache(1e6);
  const auto get = [&](bool fails) {
    return cache.Get<int>(SetupKey("x"), [&]() -> SetupCache::Made<int> {
      if (fails) throw std::bad_alloc();
      return {std::make_shared<const int>(7), 4};
    });
  };
  EXPECT_THROW(get(true), std::bad_alloc);
  EXPECT_EQ(*get(false), 7);
}

TEST(SetupCacheTest, KeysTellStructuresApart) {
  SparseMatrix sparse(2, 2);
  sparse.insert(0, 1) = 3;
  const Matrix dense(sparse);
  const auto key = [](const StructuredMatrix& matrix) { return SetupKey("m").Add(matrix).bytes(); };
  EXPECT_NE(key(sparse), key(dense));
  EXPECT_NE(key(KroneckerSum{{sparse}}), key(sparse));
  EXPECT_EQ(key(dense), key(Matrix(dense)));
  EXPECT_NE(SetupKey("m").Add(Matrix(Matrix::Zero(2, 3))).bytes(),
            SetupKey("m").Add(Matrix(Matrix::Zero(3, 2))).bytes());
}

}  // namespace
}  // namespace dlcs
