// SPDX-License-Identifier: Apache-2.0
// A solve that finds its basis again allocates nothing: it is the inner loop of a million steps.

#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <memory>

#include "core/lcp/lcp.h"
#include "tests/support/lcp_problems.h"

extern "C" void* __libc_malloc(std::size_t size);

namespace {
std::atomic<long> allocations{0};
}  // namespace

// Eigen allocates with malloc, operator new with malloc: this sees both.
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}

namespace dlcs {
namespace {

TEST(LcpAllocationTest, CountsAllocations) {
  const long before = allocations;
  const Vector v(1000);
  EXPECT_GT(allocations, before);
}

TEST(LcpAllocationTest, AcceptedGuessesAllocateNothing) {
  testing::LcpGenerator generator(1);
  for (const Index n : {1, 2, 4, 20, 100}) {
    for (const Selection selection : {Selection::kUnique, Selection::kLeastElement, Selection::kAny}) {
      const Matrix M = selection == Selection::kAny ? generator.Skew(n) : generator.MMatrix(n);
      const Matrix K = 1e-2 * Matrix::Identity(n, n);
      const std::unique_ptr<LcpSolver> plain = MakeLcpSolver(M + K, selection);
      const std::unique_ptr<LcpSolver> coupled = MakeCoupledLcpSolver(M, K, selection);
      for (LcpSolver* solver : {plain.get(), coupled.get()}) {
        const Vector q = generator.SolvableQ(M + K, false);
        Basis basis(n, 0);
        Vector y(n);
        const Vector tolerance = Vector::Constant(n, 1e-13);
        ASSERT_EQ(solver->Solve(q, tolerance, basis, y), LcpStatus::kSolved);
        const long before = allocations;
        for (int k = 0; k < 10; ++k) ASSERT_EQ(solver->Solve(q, tolerance, basis, y), LcpStatus::kSolved);
        EXPECT_EQ(allocations, before) << "n = " << n << ", selection " << static_cast<int>(selection);
      }
    }
  }
}

}  // namespace
}  // namespace dlcs
