// SPDX-License-Identifier: Apache-2.0
// Time per LCP in a sequence of related ones: same M, q moving smoothly, each solve warm from the last basis,
// as methods that march or iterate ask for them.

#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <vector>

#include "core/lcp/lcp.h"
#include "core/lcp/lemke.h"
#include "tests/support/lcp_problems.h"

namespace dlcs {
namespace {

enum Family { kTridiagonal, kDenseMMatrix, kDensePositiveDefinite };

Matrix MakeMatrix(Family family, Index n) {
  testing::LcpGenerator generator(7);
  switch (family) {
    case kTridiagonal: {
      Matrix M = 4 * Matrix::Identity(n, n);
      M.diagonal(1).setConstant(-1);
      M.diagonal(-1).setConstant(-1);
      return M;
    }
    case kDenseMMatrix:
      return generator.MMatrix(n);
    case kDensePositiveDefinite:
      return generator.PositiveDefinite(n);
  }
  return {};
}

// About 1.5 % of the entries change sign from one column to the next.
Matrix MakeSequence(Index n, Index length) {
  testing::LcpGenerator generator(11);
  Matrix q(n, length);
  for (Index i = 0; i < n; ++i) {
    const double amplitude = generator.Uniform(0.5, 1.5);
    const double phase = generator.Uniform(0, 6.28);
    const double frequency = generator.Uniform(1.4, 2.6);
    for (Index j = 0; j < length; ++j) {
      q(i, j) = amplitude * std::sin(0.02 * frequency * static_cast<double>(j) + phase) + 0.1;
    }
  }
  return q;
}

void Report(benchmark::State& state, LcpSolver& solver, const Matrix& sequence, bool warm) {
  const Index n = sequence.rows();
  const Vector tolerance = Vector::Constant(n, 1e-13);
  Basis basis(n, 0);
  Vector y(n);
  Index j = 0;
  for (auto _ : state) {
    if (!warm) std::fill(basis.begin(), basis.end(), std::uint8_t{0});
    if (solver.Solve(sequence.col(j), tolerance, basis, y) != LcpVerdict::kSolved)
      state.SkipWithError("not solved");
    benchmark::DoNotOptimize(y.data());
    j = j + 1 < sequence.cols() ? j + 1 : 0;
  }
}

void BM_Unique(benchmark::State& state) {
  const Matrix M = MakeMatrix(static_cast<Family>(state.range(0)), state.range(1));
  const auto solver = MakeLcpSolver(M, Selection::kUnique);
  Report(state, *solver, MakeSequence(state.range(1), 400), true);
}
BENCHMARK(BM_Unique)->ArgsProduct({{kTridiagonal, kDenseMMatrix, kDensePositiveDefinite}, {4, 16, 64, 255}});

// The same q again: what a solve costs that finds its basis.
void BM_UniqueSameBasis(benchmark::State& state) {
  const Matrix M = MakeMatrix(static_cast<Family>(state.range(0)), state.range(1));
  const auto solver = MakeLcpSolver(M, Selection::kUnique);
  Report(state, *solver, MakeSequence(state.range(1), 1), true);
}
BENCHMARK(BM_UniqueSameBasis)->ArgsProduct({{kTridiagonal, kDensePositiveDefinite}, {1, 2, 4, 16, 64, 255}});

void BM_LeastElement(benchmark::State& state) {
  const Matrix M = MakeMatrix(static_cast<Family>(state.range(0)), state.range(1));
  const auto solver = MakeLcpSolver(M, Selection::kLeastElement);
  Report(state, *solver, MakeSequence(state.range(1), 400), state.range(2) != 0);
}
BENCHMARK(BM_LeastElement)->ArgsProduct({{kTridiagonal, kDenseMMatrix}, {4, 16, 64, 255}, {0, 1}});

// From w = q to a basis, without the check of the basis.
void BM_Lemke(benchmark::State& state) {
  const Index n = state.range(0);
  ScaledLcp lcp(MakeMatrix(kDensePositiveDefinite, n));
  const Matrix sequence = MakeSequence(n, 400);
  const Vector tolerance = Vector::Constant(n, 1e-13);
  Lemke lemke(n);
  Basis basis(n, 0);
  Index j = 0;
  for (auto _ : state) {
    lcp.Load(sequence.col(j), tolerance);
    if (lemke.Run(lcp, 1e-11, basis) != LemkeEnd::kBasis) state.SkipWithError("no basis");
    j = j + 1 < sequence.cols() ? j + 1 : 0;
  }
}
BENCHMARK(BM_Lemke)->Arg(4)->Arg(16)->Arg(64)->Arg(255);

// A marched step of a small system, guess right: the inner loop of a million steps.
void BM_CoupledSameBasis(benchmark::State& state) {
  const Index n = state.range(0);
  const Selection selection = state.range(1) ? Selection::kLeastElement : Selection::kAny;
  testing::LcpGenerator generator(3);
  const Matrix M = state.range(1) ? generator.MMatrix(n) : generator.Skew(n);
  const auto solver = MakeCoupledLcpSolver(M, 1e-3 * Matrix::Identity(n, n), selection);
  const Matrix q = generator.SolvableQ(M + 1e-3 * Matrix::Identity(n, n), false);
  Report(state, *solver, q, true);
}
BENCHMARK(BM_CoupledSameBasis)->ArgsProduct({{1, 2, 3, 4}, {0, 1}});

// The same with a guess that is always wrong: every pair sticks.
void BM_CoupledCold(benchmark::State& state) {
  const Index n = state.range(0);
  testing::LcpGenerator generator(3);
  const Matrix M = generator.Skew(n);
  const Matrix K = 1e-3 * Matrix::Identity(n, n);
  const auto solver = MakeCoupledLcpSolver(M, K, Selection::kAny);
  Report(state, *solver, -(M + K) * Vector::Ones(n), false);
}
BENCHMARK(BM_CoupledCold)->DenseRange(1, 4);

void BM_Clone(benchmark::State& state) {
  const Index n = state.range(1);
  const auto solver = MakeLcpSolver(MakeMatrix(kDenseMMatrix, n), static_cast<Selection>(state.range(0)));
  const Vector q = -Vector::Ones(n);
  const Vector tolerance = Vector::Constant(n, 1e-13);
  Basis basis(n, 0);
  Vector y(n);
  solver->Solve(q, tolerance, basis, y);
  for (auto _ : state) benchmark::DoNotOptimize(solver->Clone());
}
BENCHMARK(BM_Clone)->ArgsProduct({{0, 1, 2}, {4, 255}});

}  // namespace
}  // namespace dlcs

BENCHMARK_MAIN();
