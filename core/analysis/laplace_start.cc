// SPDX-License-Identifier: Apache-2.0
#include "core/analysis/laplace_start.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "core/discretization/grid.h"
#include "core/discretization/scheme.h"
#include "core/discretization/sources.h"
#include "core/lcp/basis/tolerance.h"
#include "core/lcp/batch.h"
#include "core/lcp/dense/feasible_ball.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr Index kSteps = 256;

// Fills x^1 of `segment` from its first column `x`, for y^1 = SOL(N x0 + g, M); cuts the segment before the first node
// whose LCP has no solution. Returns whether any node is left.
bool FirstIterate(const Problem& problem, const Scheme& scheme, LcpBatch& batch, Workers& workers, const Vector& x,
                  Segment& segment) {
  const Matrix constant = problem.x0.replicate(1, segment.steps + 1);
  const Vector tolerance = kLcpTolerance * SizeOfSums(problem.N, constant, segment.g);
  for (LcpBatchOutcome outcome{.verdict = LcpStatus::kInfeasible}; outcome.verdict != LcpStatus::kSolved;) {
    const Matrix q = problem.N * constant.leftCols(segment.steps + 1) + segment.g;
    segment.y = Matrix::Zero(q.rows(), q.cols());
    outcome = batch.Solve(q, tolerance, workers, {}, segment.y);
    if (outcome.verdict == LcpStatus::kSolved) break;
    if (outcome.column == 0) return false;
    segment.x = segment.y;  // any shape that can be cut
    segment.Truncate(outcome.column - 1);
  }
  segment.x.resize(problem.num_states(), segment.steps + 1);
  segment.x.col(0) = x;
  Propagate(scheme, segment);
  return true;
}

// Follows (3.6) along the nodes; both intervals end where their condition fails first.
class Follower {
 public:
  Follower(const Problem& problem, double radius, double rate, GuaranteedStart& start)
      : problem_(problem), radius_(radius), rate_(rate), start_(start) {}

  bool any_left() const { return printed_ || from_x0_; }

  void Visit(double t, const Vector& x, const Vector& g, const Vector& g0) {
    drift_ = NanMax(drift_, MaxAbs(g - g0));
    first_move_ = NanMax(first_move_, MaxAbs(x - problem_.x0));
    const double beta = FeasibleStateRadius(radius_, drift_, problem_.N);
    const double a = t * rate_;
    printed_ = printed_ && SatisfiesThreeSix(first_move_, a, beta);
    from_x0_ = from_x0_ && first_move_ * std::exp(a) < beta;
    if (printed_) {
      start_.t_star = t;
      start_.beta = beta;
      start_.first_move = first_move_;
    }
    if (from_x0_) start_.t_star_from_x0 = t;
  }

 private:
  const Problem& problem_;
  double radius_, rate_;
  GuaranteedStart& start_;
  double drift_ = 0, first_move_ = 0;
  bool printed_ = true, from_x0_ = true;
};

}  // namespace

bool SatisfiesThreeSix(double first_move, double a, double beta) {
  if (std::isinf(beta)) return std::isfinite(first_move);  // every q is feasible
  if (!(first_move + beta * a < beta)) return false;       // k = 1, so a < 1 from here on
  double sum = 0, term = 1;
  for (int k = 1; k <= 30; ++k) {
    sum += term;
    term *= a / k;
    if (!(first_move * sum + beta * term < beta)) return false;
  }
  return true;
}

GuaranteedStart MeasureGuaranteedStart(const Problem& problem, Selection selection, double rate) {
  GuaranteedStart start;
  auto sources = Sources::Create(problem);
  if (!sources.ok()) {
    start.failure = std::string(sources.status().message());
    return start;
  }
  Options options;
  options.num_steps = kSteps;
  const Grid grid = MakeGrid(problem.horizon, BreakPoints(problem), options);
  Workers workers(1);
  LcpBatch batch(problem.M, selection);
  std::optional<Follower> follower;
  Vector x = problem.x0, g0;
  for (const Run& run : grid.runs) {
    Segment segment;
    if (const auto bad = sources->Sample(grid, run, 0, run.steps, segment)) {
      start.failure = bad->message;
      return start;
    }
    if (!follower) {
      g0 = segment.g.col(0);
      start.radius = LargestFeasibleBall(problem.N * problem.x0 + g0, problem.M).radius;
      if (!start.radius || *start.radius < 0) {
        start.failure = start.radius ? "LCP(N x0 + g(0), M) has no solution" : "the linear program for ρ failed";
        return start;
      }
      follower.emplace(problem, *start.radius, rate, start);
    }
    // Beyond the ball LCPs may have no solution: then the interval has ended before.
    if (!FirstIterate(problem, ExponentialPiecewiseLinear(problem, run.step), batch, workers, x, segment)) return start;
    for (Index k = 0; k <= segment.steps && follower->any_left(); ++k) {
      follower->Visit(grid.times[run.first_node + k], segment.x.col(k), segment.g.col(k), g0);
    }
    if (!follower->any_left() || segment.steps < run.steps) return start;
    x = segment.x.col(run.steps);
  }
  return start;
}

}  // namespace dlcs
