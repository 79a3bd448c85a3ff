// SPDX-License-Identifier: Apache-2.0
// Time per LCP in a sequence of related ones: same M, q moving smoothly, each solve warm from the last basis,
// as methods that march or iterate ask for them. Each benchmark checks the certificate min(y, q + M y) of what it
// times.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include "core/lcp/batch.h"
#include "core/lcp/dense/lemke.h"
#include "core/lcp/lcp.h"
#include "core/lcp/structured/sparse_solver.h"
#include "core/lcp/structured/splitting_solver.h"
#include "core/linalg/norms.h"
#include "core/matrix_classes/sparse_class.h"
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

// Whether y solves LCP(q, M) as LcpSolver promises; ends the benchmark where it does not. M may be dense or sparse.
template <typename M>
bool Certified(benchmark::State& state, const M& matrix, const Vector& q, const Vector& y) {
  const Vector My = matrix * y;
  const double norm = MaxAbs(Vector(matrix.cwiseAbs() * Vector::Ones(q.size())));
  const bool good = NaturalResidual(y, q + My) <= 1e-12 * (1 + MaxAbs(q) + norm * MaxAbs(y));
  if (!good) state.SkipWithError("the certificate fails");
  return good;
}

template <typename M>
void Report(benchmark::State& state, LcpSolver& solver, const M& matrix, const Matrix& sequence, bool warm) {
  const Index n = sequence.rows();
  const Vector tolerance = Vector::Constant(n, 1e-13);
  Basis basis(n, 0);
  Vector y(n);
  const auto solve = [&](Index j) {
    if (!warm) std::fill(basis.begin(), basis.end(), std::uint8_t{0});
    return solver.Solve(sequence.col(j), tolerance, basis, y) == LcpStatus::kSolved;
  };
  Index j = 0;
  for (auto _ : state) {
    if (!solve(j)) state.SkipWithError("not solved");
    benchmark::DoNotOptimize(y.data());
    j = j + 1 < sequence.cols() ? j + 1 : 0;
  }
  for (j = 0; j < sequence.cols(); ++j) {
    if (!solve(j) || !Certified(state, matrix, sequence.col(j), y)) return;
  }
}

void BM_Unique(benchmark::State& state) {
  const Matrix M = MakeMatrix(static_cast<Family>(state.range(0)), state.range(1));
  const auto solver = MakeLcpSolver(M, Selection::kUnique);
  Report(state, *solver, M, MakeSequence(state.range(1), 400), true);
}
BENCHMARK(BM_Unique)->ArgsProduct({{kTridiagonal, kDenseMMatrix, kDensePositiveDefinite}, {4, 16, 64, 255}});

// The same q again: what a solve costs that finds its basis.
void BM_UniqueSameBasis(benchmark::State& state) {
  const Matrix M = MakeMatrix(static_cast<Family>(state.range(0)), state.range(1));
  const auto solver = MakeLcpSolver(M, Selection::kUnique);
  Report(state, *solver, M, MakeSequence(state.range(1), 1), true);
}
BENCHMARK(BM_UniqueSameBasis)->ArgsProduct({{kTridiagonal, kDensePositiveDefinite}, {1, 2, 4, 16, 64, 255}});

void BM_LeastElement(benchmark::State& state) {
  const Matrix M = MakeMatrix(static_cast<Family>(state.range(0)), state.range(1));
  const auto solver = MakeLcpSolver(M, Selection::kLeastElement);
  Report(state, *solver, M, MakeSequence(state.range(1), 400), state.range(2) != 0);
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

// Another random game of n x n strategies each time, with costs from 1 to `most`. Time per game.
void BM_Game(benchmark::State& state) {
  const Index n = state.range(0), most = state.range(1);
  testing::LcpGenerator generator(5);
  const Vector q = Vector::Constant(2 * n, -1), tolerance = Vector::Zero(2 * n);
  for (auto _ : state) {
    Matrix M = Matrix::Zero(2 * n, 2 * n);
    for (Index j = 0; j < n; ++j) {
      for (Index i = 0; i < n; ++i) {
        M(i, n + j) = static_cast<double>(generator.Integer(1, most));
        M(n + j, i) = static_cast<double>(generator.Integer(1, most));
      }
    }
    Basis basis(2 * n, 0);
    Vector y(2 * n);
    const std::unique_ptr<LcpSolver> solver = MakeLcpSolver(M, Selection::kAny);
    const bool solved = solver->Solve(q, tolerance, basis, y) == LcpStatus::kSolved;
    if (!solved || !Certified(state, M, q, y)) {
      state.SkipWithError("not solved");
      return;
    }
  }
}
BENCHMARK(BM_Game)->ArgsProduct({{7, 14, 50, 100}, {2, 11, 1000000}})->Unit(benchmark::kMillisecond);

// A marched step of a small system, guess right: the inner loop of a million steps.
void BM_CoupledSameBasis(benchmark::State& state) {
  const Index n = state.range(0);
  const Selection selection = state.range(1) ? Selection::kLeastElement : Selection::kAny;
  testing::LcpGenerator generator(3);
  const Matrix M = state.range(1) ? generator.MMatrix(n) : generator.Skew(n);
  const Matrix K = 1e-3 * Matrix::Identity(n, n);
  const auto solver = MakeCoupledLcpSolver(M, K, selection);
  const Matrix coupled = M + K;
  Report(state, *solver, coupled, generator.SolvableQ(coupled, false), true);
}
BENCHMARK(BM_CoupledSameBasis)->ArgsProduct({{1, 2, 3, 4}, {0, 1}});

// The same with a guess that is always wrong: every pair sticks.
void BM_CoupledCold(benchmark::State& state) {
  const Index n = state.range(0);
  testing::LcpGenerator generator(3);
  const Matrix M = generator.Skew(n);
  const Matrix K = 1e-3 * Matrix::Identity(n, n);
  const auto solver = MakeCoupledLcpSolver(M, K, Selection::kAny);
  const Matrix coupled = M + K;
  Report(state, *solver, coupled, -coupled * Vector::Ones(n), false);
}
BENCHMARK(BM_CoupledCold)->DenseRange(1, 4);

// The LCPs of an iterate: all times in one call, the guess of each is the solution at the time before. One thread. The
// time is that of one LCP.
void BM_TridiagonalBatch(benchmark::State& state) {
  const Index n = state.range(0);
  const Matrix M = MakeMatrix(kTridiagonal, n), q = MakeSequence(n, 400);
  const Vector tolerance = Vector::Constant(n, 1e-13);
  LcpBatch batch(M, Selection::kUnique);
  Workers workers(1);
  Matrix y = Matrix::Zero(n, q.cols());
  batch.Solve(q, tolerance, workers, {}, y);
  Matrix guess = y;
  guess.rightCols(q.cols() - 1) = y.leftCols(q.cols() - 1);
  for (auto _ : state) {
    y = guess;
    if (batch.Solve(q, tolerance, workers, {}, y).verdict != LcpStatus::kSolved) state.SkipWithError("not solved");
  }
  state.counters["per_lcp"] = benchmark::Counter(
      static_cast<double>(q.cols()), benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  for (Index j = 0; j < q.cols() && Certified(state, M, q.col(j), y.col(j)); ++j) continue;
}
BENCHMARK(BM_TridiagonalBatch)->Arg(4)->Arg(16)->Arg(64)->Arg(255);

// (e^z - 1 - z) / z², for z < 0: by its series where the difference would cancel.
double Phi2(double z) {
  if (z < -1) return (std::expm1(z) / z - 1) / z;
  double sum = 0, term = 0.5;
  for (int j = 3; j < 24; ++j, term *= z / (j - 1)) sum += term;
  return sum;
}

// M + K_0 of (exp-PL) for the Signorini problem with h = 0.01, from the eigenvectors of the second differences: K_0 =
// -2 h c/Δx² S diag(k) S, k_b = Σ_a s_a1² φ_2(h c (λ_a + λ_b)).
Matrix CoupledSignorini(Index cells, double c) {
  const Index n = cells - 1;
  const double h = 0.01, dx = 1.0 / static_cast<double>(cells);
  Matrix S(n, n);
  Vector lambda(n), k = Vector::Zero(n);
  for (Index i = 0; i < n; ++i) {
    const double angle = static_cast<double>(i + 1) * std::numbers::pi * dx;
    lambda[i] = -4 / (dx * dx) * std::pow(std::sin(angle / 2), 2);
    for (Index j = 0; j < n; ++j) {
      const Index turns = (i + 1) * (j + 1) % (2 * cells);  // whole ones left out before they are rounded
      S(i, j) = std::sqrt(2 * dx) * std::sin(static_cast<double>(turns) * std::numbers::pi * dx);
    }
  }
  for (Index b = 0; b < n; ++b) {
    for (Index a = 0; a < n; ++a) {
      const double z = h * c * (lambda[a] + lambda[b]);
      k[b] += S(a, 0) * S(a, 0) * Phi2(z);
    }
  }
  Matrix M = MakeMatrix(kTridiagonal, n);
  M -= 2 * h * c / (dx * dx) * S * k.asDiagonal() * S;
  return M;
}

// A marched step of the Signorini problem from an extrapolated y: c = 2e-4, or 2e-2.
void BM_SplittingSignorini(benchmark::State& state) {
  const Matrix K = CoupledSignorini(state.range(0), state.range(1) ? 2e-2 : 2e-4);
  std::optional<BandSplitting> split = SplitOffBand(K, 0.9);
  if (!split) return state.SkipWithError("not split");
  const double rate = split->rate;
  const Index band = split->B->bandwidth(), bandwidth = split->bandwidth;
  SplittingLcpSolver solver(*std::move(split));
  const Index n = K.rows();
  const Matrix q = MakeSequence(n, 400);
  const Vector tolerance = Vector::Constant(n, 1e-13);
  Matrix y = Matrix::Zero(n, q.cols());
  Vector guess = Vector::Zero(n);
  Index j = 0, iterations = 0;
  for (auto _ : state) {
    if (j >= 3) guess = 3 * (y.col(j - 1) - y.col(j - 2)) + y.col(j - 3);
    y.col(j) = guess;
    if (solver.Solve(q.col(j), tolerance, y.col(j)) != SplittingVerdict::kSolved) state.SkipWithError("not solved");
    iterations += solver.iterations();
    j = j + 1 < q.cols() ? j + 1 : 0;
  }
  state.counters["iterations"] =
      benchmark::Counter(static_cast<double>(iterations), benchmark::Counter::kAvgIterations);
  state.counters["rate"] = rate;
  state.counters["band"] = static_cast<double>(band);
  state.counters["bandwidth"] = static_cast<double>(bandwidth);
  for (Index i = 0; i < std::min<Index>(q.cols(), state.iterations()); ++i) {
    if (!Certified(state, K, q.col(i), y.col(i))) return;
  }
}
BENCHMARK(BM_SplittingSignorini)->ArgsProduct({{40, 64, 128, 256}, {0, 1}});

// -Δ by five points on a square, `across` points each way.
SparseMatrix Laplacian(Index across) {
  SparseMatrix D(across, across);
  for (Index i = 0; i < across; ++i) {
    D.insert(i, i) = 2;
    if (i > 0) D.insert(i, i - 1) = D.insert(i - 1, i) = -1;
  }
  D.makeCompressed();
  return KroneckerSum{{D, D}}.Assemble();
}

// A membrane over obstacles that move: n = across².
void BM_Sparse(benchmark::State& state) {
  const SparseMatrix M = Laplacian(state.range(0));
  const auto solver = MakeSparseLcpSolver(M, Selection::kUnique);
  Report(state, *solver, M, MakeSequence(M.rows(), 10), true);
}
BENCHMARK(BM_Sparse)->Arg(45)->Arg(141)->Unit(benchmark::kMillisecond);

void BM_ClassifySparse(benchmark::State& state) {
  const SparseMatrix M = Laplacian(state.range(0));
  for (auto _ : state) {
    if (!ClassifySparse(M).p.yes()) state.SkipWithError("not recognized");
  }
}
BENCHMARK(BM_ClassifySparse)->Arg(45)->Arg(141)->Unit(benchmark::kMillisecond);

// The yardstick for dense matrices: a tableau of all variables, kept from one solve to the next and pivoted in place.
// It drifts, and its bits depend on all that was solved before, so it is no solver of ours.
class KeptTableau {
 public:
  explicit KeptTableau(const Matrix& M) : pivoted_(M), inverse_(Matrix::Identity(M.rows(), M.rows())) {}

  // (y_S, w elsewhere) of the basis it ends with; false when that takes too long.
  bool Solve(const Vector& q, const Basis& basis_in, Vector& basic) {
    basis = basis_in;
    for (int round = 0; round < 100; ++round) {
      basic.noalias() = inverse_ * q;
      bool feasible = true;
      for (Index i = 0; i < q.size(); ++i) {
        if (basic[i] >= -1e-12) continue;
        feasible = false;
        Exchange(i);
      }
      if (feasible) return true;
    }
    return false;
  }

  Basis basis;

 private:
  void Exchange(Index k) {
    const double pivot = pivoted_(k, k);
    row_ = pivoted_.row(k) / pivot;
    image_row_ = inverse_.row(k) / pivot;
    column_ = pivoted_.col(k);
    column_[k] = 0;
    pivoted_.noalias() -= column_ * row_.transpose();
    inverse_.noalias() -= column_ * image_row_.transpose();
    pivoted_.row(k) = -row_;
    inverse_.row(k) = -image_row_;
    pivoted_.col(k) = column_ / pivot;
    pivoted_(k, k) = 1 / pivot;
    basis[k] ^= 1;
  }

  Matrix pivoted_, inverse_;
  Vector row_, image_row_, column_;
};

void BM_KeptTableau(benchmark::State& state) {
  const Index n = state.range(1);
  const Matrix M = MakeMatrix(static_cast<Family>(state.range(0)), n), q = MakeSequence(n, 400);
  KeptTableau tableau(M);
  Basis basis(n, 0);
  Vector basic(n);
  Index j = 0;
  const auto solve = [&](Index column) {
    const bool solved = tableau.Solve(q.col(column), basis, basic);
    basis = tableau.basis;
    return solved;
  };
  for (auto _ : state) {
    if (!solve(j)) state.SkipWithError("not solved");
    j = j + 1 < q.cols() ? j + 1 : 0;
  }
  Vector y = Vector::Zero(n);
  for (j = 0; j < q.cols(); ++j) {
    if (!solve(j)) return state.SkipWithError("not solved");
    for (Index i = 0; i < n; ++i) y[i] = basis[i] ? std::max(0.0, basic[i]) : 0;
    if (!Certified(state, M, q.col(j), y)) return;
  }
}
BENCHMARK(BM_KeptTableau)->ArgsProduct({{kDenseMMatrix, kDensePositiveDefinite}, {4, 16, 64, 255}});

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
BENCHMARK(BM_Clone)->ArgsProduct({{static_cast<long>(Selection::kUnique), static_cast<long>(Selection::kLeastElement),
                                   static_cast<long>(Selection::kAny)},
                                  {4, 255}});

}  // namespace
}  // namespace dlcs

BENCHMARK_MAIN();
