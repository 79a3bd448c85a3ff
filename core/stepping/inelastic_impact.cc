// SPDX-License-Identifier: Apache-2.0

#include "core/stepping/inelastic_impact.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "core/context/progress.h"
#include "core/discretization/step_cache.h"
#include "core/lcp/basis/tolerance.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

constexpr Index kChunk = 256;

// The quantities that depend only on the step length.
struct ImpactStep {
  ImpactStep(const Problem& problem, double step)
      : scheme(ExponentialPiecewiseConstant(problem, step)), force_response(problem.N * problem.A * scheme.y_after) {}
  Scheme scheme;
  Matrix force_response;  // of the velocity at the end of the step to y
};

class Impacts {
 public:
  explicit Impacts(SolveContext& context)
      : context_(context),
        problem_(context.problem),
        NA_(problem_.N * problem_.A),
        impulse_response_(NA_ * problem_.B.Dense()),
        steps_([this](double step) { return std::make_unique<ImpactStep>(problem_, step); }),
        x_(problem_.x0),
        y_(Vector::Zero(problem_.num_constraints())) {}

  bool ReachEnd() {
    for (Index i = 0; i < impulse_response_.rows(); ++i) {
      if ((impulse_response_.row(i).array() == 0).all()) {
        return context_.Fail(Termination::kUnsupported, 0,
                             "Row " + std::to_string(i) +
                                 " of N A B is zero: no impulse acts on the velocity of "
                                 "(N x + g)[" +
                                 std::to_string(i) + "], its relative degree is more than two.");
      }
    }
    Progress progress(context_);
    for (const Run& run : context_.grid.runs) {
      for (Index done = 0; done < run.steps;) {
        const Index steps = std::min(kChunk, run.steps - done);
        if (context_.stop.stop_requested()) return context_.FailCancelled(context_.grid.times[run.first_node + done]);
        progress.At(context_.grid.times[run.first_node + done]);
        if (!Advance(run, done, steps)) return false;
        done += steps;
      }
    }
    progress.Finish(problem_.horizon);
    return true;
  }

 private:
  // `steps` steps of `run` from step `done` on, filed even where one of them fails.
  bool Advance(const Run& run, Index done, Index steps) {
    Segment segment;
    if (const auto bad = context_.sources.Sample(context_.grid, run, done, steps, segment)) {
      return context_.FailNonFinite(*bad);
    }
    ImpactStep& tools = steps_.At(run.step);
    const double begin = context_.grid.times[segment.first_node];
    if (done == 0 && run.starts_at_break) {
      const Vector slope = (segment.g.col(1) - segment.g.col(0)) / run.step;
      if (!Start(begin, segment.f.col(0), segment.g.col(0), slope)) return false;
    }
    segment.x.resize(problem_.num_states(), steps + 1);
    segment.y = Matrix::Zero(problem_.num_constraints(), steps + 1);
    segment.x.col(0) = x_;
    segment.first_y_is_solution = false;
    Index solved = 0;
    while (solved < steps && Step(tools, segment, solved + 1)) ++solved;
    // y is constant on steps: after a break point it is that of the first step, elsewhere that of the last.
    segment.y.col(0) = done > 0 || !run.starts_at_break || solved == 0 ? y_ : Vector(segment.y.col(1));
    y_ = segment.y.col(solved);
    if (solved < steps) segment.Truncate(solved);
    context_.Add(segment, tools.scheme);
    context_.solution.cost.steps += solved;
    return solved == steps;
  }

  // Contacts at the start of a smooth interval, where f, g and g' may jump.
  bool Start(double time, const Vector& f, const Vector& g, const Vector& g_slope) {
    const Vector gap = problem_.N * x_ + g;
    const Vector tolerance = kMaybeZero * SizeOfSums(problem_.N, x_, g) + allowed_gap_;
    for (Index i = 0; i < gap.size(); ++i) {
      if (gap[i] >= -tolerance[i]) continue;
      return context_.Fail(time == 0 ? Termination::kInconsistentState : Termination::kInfeasible, time,
                           "(N x + g)[" + std::to_string(i) + "] = " + FormatNumber(gap[i]) + " at t = " +
                               FormatNumber(time) + ": an impact changes velocities, it cannot open a gap.");
    }
    contacts_.clear();
    const Vector velocity = Velocity(x_, f, g_slope);
    return Collide(time, (gap.array() <= tolerance.array()).matrix(), velocity, velocity, x_);
  }

  Vector Velocity(const Vector& x, const Vector& f, const Vector& g_slope) const {
    return NA_ * x + problem_.N * f + g_slope;
  }

  // Step `j` of `segment`. Returns false when the solve has ended.
  bool Step(ImpactStep& tools, Segment& segment, Index j) {
    const double time = context_.grid.times[segment.first_node + j];
    const Vector g_slope = (segment.g.col(j) - segment.g.col(j - 1)) / segment.step;
    Vector x = tools.scheme.state * x_ + tools.scheme.f_before * segment.f.col(j - 1) +
               tools.scheme.f_after * segment.f.col(j);
    Vector y = Vector::Zero(problem_.num_constraints());
    const Vector without_y = Velocity(x, segment.f.col(j), g_slope);
    if (!contacts_.empty()) {
      const LcpStatus verdict = SolveOn(contacts_, tools.force_response, without_y, y);
      if (verdict != LcpStatus::kSolved) return FailLcp(context_, verdict, time, "The LCP of the contact forces");
      x += tools.scheme.y_after * y;
    }
    Vector gap = problem_.N * x + segment.g.col(j);
    const Eigen::Array<bool, Eigen::Dynamic, 1> closed = gap.array() <= 0;
    PushOut(segment.g.col(j), gap, x);
    const Vector velocity = Velocity(x, segment.f.col(j), g_slope);
    // At rest the part of the velocity that y causes and the part without y cancel, up to rounding.
    const Vector size = velocity.cwiseAbs().cwiseMax(without_y.cwiseAbs());
    if (!Collide(time, closed, velocity, size, x)) return false;
    if (!x.allFinite()) return FailLcp(context_, LcpStatus::kNonFinite, time, "");
    // If a gap was overshot at its impact and could not be pushed out, that much stays allowed while it is in contact.
    allowed_gap_ = allowed_gap_.cwiseMax((-gap).cwiseMax(0));
    segment.x.col(j) = x_ = x;
    segment.y.col(j) = y;
    return true;
  }

  // Moves `x` along A B, which changes positions as B changes velocities, so that no gap is overshot. If no such move
  // mends all gaps, `x` stays.
  void PushOut(const Eigen::Ref<const Vector>& g, Vector& gap, Vector& x) {
    const Vector tolerance = kMaybeZero * SizeOfSums(problem_.N, x, g);
    std::vector<Index> overshot;
    bool any = false;
    for (Index i = 0; i < gap.size(); ++i) {
      if (gap[i] <= 0) overshot.push_back(i);
      any = any || gap[i] < -tolerance[i];
    }
    if (!any) return;
    Vector p = Vector::Zero(gap.size());
    if (SolveOn(overshot, impulse_response_, gap, p) != LcpStatus::kSolved) return;
    x += problem_.A * Vector(problem_.B * p);
    gap += impulse_response_ * p;
  }

  // Lets the gaps that are `closed` and closing collide: `x` jumps by B p. Then sets the contacts. `size` is that of
  // the numbers that the velocity was summed from.
  bool Collide(double time, const Eigen::Array<bool, Eigen::Dynamic, 1>& closed, Vector velocity, const Vector& size,
               Vector& x) {
    const Vector tolerance = kMaybeZero * SizeOfSums(NA_, x, size);
    std::vector<Index> candidates = contacts_;
    bool impact = false;
    for (Index i = 0; i < velocity.size(); ++i) {
      if (!closed[i] || std::find(contacts_.begin(), contacts_.end(), i) != contacts_.end()) continue;
      candidates.push_back(i);
      impact = impact || velocity[i] < -tolerance[i];
    }
    std::sort(candidates.begin(), candidates.end());
    if (impact) {
      Vector p = Vector::Zero(velocity.size());
      const LcpStatus verdict = SolveOn(candidates, impulse_response_, velocity, p);
      if (verdict != LcpStatus::kSolved) return FailLcp(context_, verdict, time, "The LCP of the impulses");
      const Vector dx = problem_.B * p;
      x += dx;
      velocity += impulse_response_ * p;
      context_.solution.jumps.push_back({time, dx, p});
    }
    contacts_.clear();
    for (const Index i : candidates) {
      if (velocity[i] <= tolerance[i]) contacts_.push_back(i);
    }
    return true;
  }

  // 0 <= y_S ⟂ (q + response y)_S >= 0, the other y_i stay.
  LcpStatus SolveOn(const std::vector<Index>& indices, const Matrix& response, const Vector& q, Vector& y) {
    const Matrix matrix = response(indices, indices);
    const Vector rhs = q(indices);
    const Vector tolerance = Vector::Constant(rhs.size(), kLcpTolerance * MaxAbs(rhs));
    Basis basis(indices.size(), 0);
    Vector solution(rhs.size());
    const LcpStatus verdict = MakeLcpSolver(matrix, Selection::kAny)->Solve(rhs, tolerance, basis, solution);
    ++context_.solution.cost.lcps;
    if (verdict == LcpStatus::kSolved) y(indices) = solution;
    return verdict;
  }

  SolveContext& context_;
  const Problem& problem_;
  const Matrix NA_;
  const Matrix impulse_response_;  // N A B, of the velocity
  StepCache<ImpactStep> steps_;
  Vector x_, y_;  // at the end of the last step
  std::vector<Index> contacts_;
  Vector allowed_gap_ = Vector::Zero(problem_.num_constraints());
};

}  // namespace

bool InelasticImpact(SolveContext& context) { return Impacts(context).ReachEnd(); }

}  // namespace dlcs
