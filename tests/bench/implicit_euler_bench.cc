// SPDX-License-Identifier: Apache-2.0
// The parabolic Signorini problem (core/models/signorini.h), T = 4, J = 400, on one thread: the engine's methods beside
// implicit Euler done well for this problem, once with a sparse Cholesky factor and once with sine transforms.
//
//     implicit_euler_bench [--quick] [Google Benchmark's flags]
//
// A line is METHOD/COEFFICIENT/CELLS; total_ms is processor time. Both forms of implicit Euler are spared what they
// could be made to pay for: M^h is formed by sine transforms, and its LCPs are solved by tridiagonal ones
// (core/lcp/splitting_solver.h), as the march does.
//
// Checks: the engine's answers have their certificates; the march and the iteration agree on y(T), the iteration to
// what (4.8) of [Wu & Chen] leaves; the two forms of implicit Euler agree to 1e-9, and with the march to its first
// order.

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/lcp/splitting_solver.h"
#include "core/linalg/norms.h"
#include "core/linalg/wide_loops.h"
#include "core/models/signorini.h"
#include "core/realisation/factor_transform.h"
#include "core/solve.h"
#include "tests/bench/bench_support.h"

namespace dlcs::bench {
namespace {

constexpr Index kSteps = 400;
constexpr double kHorizon = 4;

struct Setting {
  double coefficient;
  Index cells;
};

SignoriniModel ModelOf(const Setting& setting) {
  SignoriniModel model;
  model.coefficient = setting.coefficient;
  model.cells = setting.cells;
  model.horizon = kHorizon;
  return model;
}

// What the two forms of implicit Euler share: x⁺ = R (x + h B (y + ψ)), R = (I - hA)⁻¹, with y from LCP(N R (x + h B ψ)
// + g, M^h). Mode (a, b) of the grid, a along x1 and b along x2, is multiplied by R_ab.
class Euler {
 public:
  explicit Euler(const Problem& problem)
      : size_(problem.num_constraints()),
        step_(kHorizon / kSteps),
        weight_(problem.B.Sparse().coeff(0, 0)),
        transform_(*FactorTransform::Create(problem.A.kronecker_sum()->factors[0])),
        along_(transform_.Forward(Vector::Unit(size_, 0))),
        M_(problem.M.Dense()),
        psi_(SampleObstacle(problem)) {
    const Vector& lambda = transform_.eigenvalues();
    R_.resize(size_, size_);  // (b, a)
    for (Index a = 0; a < size_; ++a) R_.col(a) = (1 - step_ * (lambda[a] + lambda.array())).inverse();
    const Vector now = -2 * step_ * weight_ * (R_ * along_.cwiseAbs2());
    const Matrix identity = Matrix::Identity(size_, size_);
    const Matrix coupled = M_ + transform_.Backward(now.asDiagonal() * transform_.Forward(identity));
    const auto splitting = SplitOffTridiagonal(coupled, 0.8);
    if (!splitting) throw std::runtime_error("M^h is far from tridiagonal");
    solver_ = std::make_unique<SplittingLcpSolver>(splitting->T, splitting->remainder);
    tolerance_ = Vector::Constant(size_, 1e-13);
    y_ = Matrix::Zero(size_, kSteps + 1);
  }

  const Matrix& y() const { return y_; }  // of the last run, columns 1 ... kSteps

 protected:
  static Matrix SampleObstacle(const Problem& problem) {
    TimeFunction psi = problem.g;
    psi.lift = StructuredMatrix();
    auto evaluator = TimeFunctionEvaluator::Create(psi, problem.num_constraints());
    Matrix samples(problem.num_constraints(), kSteps + 1);
    for (Index j = 0; j <= kSteps; ++j) {
      evaluator->Evaluate(kHorizon * static_cast<double>(j) / kSteps, Side::kLeft, samples.col(j));
    }
    return samples;
  }

  // y_j from N R (x + h B ψ_j).
  void SolveLcp(const Vector& N_x, Index j) {
    const Vector q = N_x + M_.diagonal().cwiseProduct(psi_.col(j)) - Neighbours(psi_.col(j));
    Vector y = j < 4 ? Vector(y_.col(j - 1)) : Vector(3 * (y_.col(j - 1) - y_.col(j - 2)) + y_.col(j - 3));
    if (solver_->Solve(q, tolerance_, y) != SplittingVerdict::kSolved) throw std::runtime_error("an LCP is not solved");
    y_.col(j) = y;
  }

  Index size_;
  double step_, weight_;
  FactorTransform transform_;
  Vector along_;  // e_1 in modes
  Matrix M_, psi_, R_, y_;

 private:
  static Vector Neighbours(const Vector& v) {
    Vector sum = Vector::Zero(v.size());
    sum.head(v.size() - 1) += v.tail(v.size() - 1);
    sum.tail(v.size() - 1) += v.head(v.size() - 1);
    return sum;
  }

  std::unique_ptr<SplittingLcpSolver> solver_;
  Vector tolerance_;
};

// The state on the grid, two solves with a sparse Cholesky factor a step.
class CholeskyEuler : public Euler {
 public:
  explicit CholeskyEuler(const Problem& problem)
      : Euler(problem), B_(problem.B.Sparse()), N_(problem.N.Sparse()), x_(problem.x0) {
    SparseMatrix identity(x_.size(), x_.size());
    identity.setIdentity();
    factor_.compute(identity - step_ * problem.A.Sparse());
  }

  // The first `steps` steps.
  void Run(Index steps) {
    for (Index j = 1; j <= steps; ++j) {
      x_ += step_ * (B_ * psi_.col(j));
      SolveLcp(N_ * factor_.solve(x_), j);
      x_ += step_ * (B_ * y_.col(j));
      x_ = factor_.solve(x_).eval();
    }
  }

 private:
  SparseMatrix B_, N_;
  Vector x_;
  Eigen::SimplicialLLT<SparseMatrix> factor_;
};

// The state in modes: one pass over it and two sine transforms a step.
class SineEuler : public Euler {
 public:
  explicit SineEuler(const Problem& problem) : Euler(problem), modes_(size_, size_) {
    const Eigen::Map<const Matrix> x0(problem.x0.data(), size_, size_);  // (x1, x2)
    modes_ = transform_.Forward(transform_.Forward(x0).transpose());     // (b, a)
  }

  void Run() {
    FactorTransform::Workspace workspace;
    const Matrix psi = transform_.Forward(psi_);
    const Vector response = R_ * along_.cwiseAbs2();
    Vector input = Vector::Zero(size_), seen(size_);
    for (Index j = 1; j <= kSteps; ++j) {
      // x <- R (x + h B (y + ψ)) of the step before, and N R x for this one.
      seen.setZero();
      Advance(j > 1, input, seen);
      Vector N_x = -2 * (seen + step_ * weight_ * response.cwiseProduct(psi.col(j)));
      transform_.BackwardInPlace(N_x, workspace);
      SolveLcp(N_x, j);
      input = y_.col(j);
      transform_.ForwardInPlace(input, workspace);
      input = step_ * weight_ * (input + psi.col(j));
    }
    Advance(true, input, seen);
  }

 private:
  void Advance(bool moves, const Vector& input_modes, Vector& seen_modes) {
    const Index size = size_;
    RunWide([=, u = input_modes.data(), sum = seen_modes.data(), x_all = modes_.data(), r_all = R_.data(),
             along = along_.data()]() DLCS_WIDE {
      double* __restrict seen = sum;
      const double* __restrict input = u;
      for (Index a = 0; a < size; ++a) {
        double* __restrict x = x_all + a * size;
        const double* __restrict r = r_all + a * size;
        const double weight = along[a];
        if (moves) {
          for (Index b = 0; b < size; ++b) {
            const double next = r[b] * (x[b] + weight * input[b]);
            x[b] = next;
            seen[b] += weight * (r[b] * next);
          }
        } else {
          for (Index b = 0; b < size; ++b) seen[b] += weight * (r[b] * x[b]);
        }
      }
    });
  }

  Matrix modes_;
};

Options OptionsFor(Method method, const Setting& setting, bool whole_window) {
  Options options;
  options.method = method;
  options.num_steps = kSteps;
  options.num_threads = 1;
  options.output_times = {kHorizon};
  options.output_times_only = true;
  if (method == Method::kLaplaceIteration) {
    const auto cells = static_cast<double>(setting.cells);
    options.tolerance = std::min(kHorizon / kSteps, 1 / (cells * cells)) / 10;  // (4.8)
    if (whole_window) options.window_steps = Options::kWholeHorizon;
  }
  return options;
}

// Of the processor: other programs do not count.
double Seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// y(T) of the march and all y of implicit Euler in modes, made once for each setting.
struct Reference {
  Vector y_end;
  Matrix euler_y;
};
const Reference& ReferenceOf(benchmark::State& state, const Setting& setting) {
  static std::map<std::pair<double, Index>, Reference> kept;
  Reference& reference = kept[{setting.coefficient, setting.cells}];
  if (reference.y_end.size() == 0) {
    const Problem problem = MakeSignoriniProblem(ModelOf(setting)).value();
    if (const auto march = SolveOrSkip(state, problem, OptionsFor(Method::kExponentialMarch, setting, false))) {
      reference.y_end = march->y.rightCols(1);
    }
    SineEuler euler(problem);
    euler.Run();
    reference.euler_y = euler.y();
  }
  return reference;
}

// Fails NaN, too.
void ExpectAtMost(benchmark::State& state, double error, double most, const char* what) {
  state.counters["difference"] = error;
  if (!(error <= most)) state.SkipWithError(what);
}

void RunEngine(benchmark::State& state, const Setting& setting, Method method, bool whole_window) {
  const Problem problem = MakeSignoriniProblem(ModelOf(setting)).value();
  const Options options = OptionsFor(method, setting, whole_window);
  const Reference& reference = ReferenceOf(state, setting);
  std::optional<Solution> best;
  double total = 1e9;
  for (auto _ : state) {
    Observer observer;
    const double begin = Seconds();
    auto solution = Solve(problem, options, observer, {});
    if (!solution.ok() || solution->termination != Termination::kConverged) return state.SkipWithError("not solved");
    const double seconds = Seconds() - begin;
    if (seconds < total) best = *std::move(solution);
    total = std::min(total, seconds);
  }
  const bool iterates = method == Method::kLaplaceIteration;
  const double allowed = iterates ? 100 * options.tolerance : 1e-9;
  ExpectAtMost(state, MaxAbs(best->y.rightCols(1) - reference.y_end), allowed, "differs from the march");
  if (!iterates && !WhatIsWrong(*best).empty()) state.SkipWithError("its certificate fails");
  const Cost& cost = best->cost;
  state.counters["iterations"] = static_cast<double>(cost.iterations);
  state.counters["setup_ms"] = 1e3 * cost.seconds_setup;
  state.counters["lcp_ms"] = 1e3 * cost.seconds_lcp;
  state.counters["linear_ms"] = 1e3 * cost.seconds_linear;
  state.counters["total_ms"] = 1e3 * total;
}

void RunSine(benchmark::State& state, const Setting& setting) {
  const Problem problem = MakeSignoriniProblem(ModelOf(setting)).value();
  const Reference& reference = ReferenceOf(state, setting);
  double setup = 1e9, total = 1e9;
  for (auto _ : state) {
    const double begin = Seconds();
    SineEuler euler(problem);
    setup = std::min(setup, Seconds() - begin);
    euler.Run();
    total = std::min(total, Seconds() - begin);
    benchmark::DoNotOptimize(euler.y().data());
  }
  constexpr double kFirstOrder = 1e-2;
  ExpectAtMost(state, MaxAbs(reference.euler_y.rightCols(1) - reference.y_end), kFirstOrder, "far from the march");
  state.counters["setup_ms"] = 1e3 * setup;
  state.counters["total_ms"] = 1e3 * total;
}

// With --quick the first `steps` steps only, and the time extrapolated.
void RunCholesky(benchmark::State& state, const Setting& setting, Index steps) {
  const Problem problem = MakeSignoriniProblem(ModelOf(setting)).value();
  const Reference& reference = ReferenceOf(state, setting);
  double setup = 1e9, marching = 1e9, error = 0;
  for (auto _ : state) {
    const double begin = Seconds();
    CholeskyEuler euler(problem);
    setup = std::min(setup, Seconds() - begin);
    const double marched = Seconds();
    euler.Run(steps);
    marching = std::min(marching, (Seconds() - marched) * kSteps / static_cast<double>(steps));
    error = MaxAbs(euler.y().middleCols(1, steps) - reference.euler_y.middleCols(1, steps));
  }
  ExpectAtMost(state, error, 1e-9, "the two forms of implicit Euler differ");
  state.counters["setup_ms"] = 1e3 * setup;
  state.counters["total_ms"] = 1e3 * (setup + marching);
  state.counters["steps"] = static_cast<double>(steps);
}

}  // namespace
}  // namespace dlcs::bench

int main(int argc, char** argv) {
  using namespace dlcs::bench;
  using dlcs::Method;
  const bool quick = TakeFlag(argc, argv, "--quick");
  for (const double coefficient : {2e-4, 2e-2}) {
    for (const dlcs::Index cells : {40, 64, 128, 256}) {
      const Setting setting{coefficient, cells};
      const std::string name = std::string(coefficient < 1e-3 ? "/2e-4/" : "/2e-2/") + std::to_string(cells);
      const auto add = [&](const std::string& method, const std::function<void(benchmark::State&)>& run) {
        auto* bench = benchmark::RegisterBenchmark((method + name).c_str(), [run](benchmark::State& state) {
          try {
            run(state);
          } catch (const std::runtime_error& error) {
            state.SkipWithError(error.what());
          }
        });
        bench->Unit(benchmark::kMillisecond)->MinTime(quick ? 0.02 : 0.5);
      };
      add("march", [=](benchmark::State& state) { RunEngine(state, setting, Method::kExponentialMarch, false); });
      add("iteration, whole window",
          [=](benchmark::State& state) { RunEngine(state, setting, Method::kLaplaceIteration, true); });
      add("iteration, windows",
          [=](benchmark::State& state) { RunEngine(state, setting, Method::kLaplaceIteration, false); });
      add("implicit Euler, sine transform", [=](benchmark::State& state) { RunSine(state, setting); });
      const dlcs::Index steps = quick && cells >= 128 ? 20 : kSteps;
      add("implicit Euler, sparse Cholesky", [=](benchmark::State& state) { RunCholesky(state, setting, steps); });
    }
  }
  return RunAll(argc, argv);
}
