// SPDX-License-Identifier: Apache-2.0
#include "core/context/reduced_run.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/context/consistency.h"
#include "core/linalg/norms.h"
#include "core/parallel/stop_scope.h"

namespace dlcs {
namespace {

// A transform spreads the rounding of every row to all others. With this part, the tolerance of LCPs is 1e-15 of the
// largest row: nine roundings of it, and a factor of 4 still leaves some.
constexpr double kMixing = 1e-2;

// The nonzero rows of a lift. The others are zero in every product.
StructuredMatrix NonzeroRows(const SparseMatrix& lift) {
  std::vector<Index> row_of(static_cast<std::size_t>(lift.rows()), -1);
  std::vector<Eigen::Triplet<double>> entries;
  Index rows = 0;
  for (Index c = 0; c < lift.outerSize(); ++c) {
    for (SparseMatrix::InnerIterator entry(lift, c); entry; ++entry) {
      Index& row = row_of[static_cast<std::size_t>(entry.row())];
      if (row < 0) row = rows++;
      entries.emplace_back(row, c, entry.value());
    }
  }
  SparseMatrix kept(rows, lift.cols());
  kept.setFromTriplets(entries.begin(), entries.end());
  return kept;
}

bool AreSameFormulas(const TimeFunction& one, const TimeFunction& other) {
  if (one.pieces.size() != 1 || other.pieces.size() != 1) return false;
  const auto* formulas = std::get_if<FormulaFunction>(&one.pieces[0].function);
  const auto* others = std::get_if<FormulaFunction>(&other.pieces[0].function);
  return formulas && others && formulas->formulas == others->formulas && formulas->parameters == others->parameters;
}

// ψ and g at nodes and middles. Lifts are multiplied for all times at once, and a ψ that f and g share is evaluated
// once.
class ReducedSources {
 public:
  explicit ReducedSources(const Problem& problem)
      : lift_(problem.f.is_lifted() ? NonzeroRows(problem.f.lift.Sparse()) : StructuredMatrix()),
        g_lift_(problem.g.lift),
        shared_(problem.g.is_lifted() && AreSameFormulas(problem.f, problem.g)),
        psi_(*TimeFunctionEvaluator::Create(problem.f.Inner(), problem.f.inner_size(problem.num_states()),
                                            AxisOf(problem))) {
    if (shared_) return;
    g_.emplace(*TimeFunctionEvaluator::Create(problem.g.Inner(), problem.g.inner_size(problem.num_constraints()),
                                              AxisOf(problem)));
  }

  // Fills sources, g, g_mid and f_defect of `run`; returns where a value was not finite.
  std::optional<Sources::NonFinite> Sample(const Grid& grid, ReducedRun& run) {
    const Index steps = run.steps();
    run.sources.step = run.run.step;
    Samples psi = SamplesOf(psi_, grid, run);
    if (shared_) {
      run.g = g_lift_ * psi.nodes;
      run.g_mid = g_lift_ * psi.middles;
    } else {
      Samples g = SamplesOf(*g_, grid, run);
      run.g = g_lift_.size() > 0 ? Matrix(g_lift_ * g.nodes) : std::move(g.nodes);
      run.g_mid = g_lift_.size() > 0 ? Matrix(g_lift_ * g.middles) : std::move(g.middles);
    }
    Matrix& missed = psi.middles;
    missed -= (psi.nodes.leftCols(steps) + psi.nodes.rightCols(steps)) / 2;
    run.f_defect = lift_.size() > 0 ? MaxAbs(lift_ * missed) : MaxAbs(missed);
    run.sources.psi = std::move(psi.nodes);
    const auto is_finite = [](const Matrix& values) { return std::isfinite(MaxAbs(values)); };
    if (std::isfinite(run.f_defect) && is_finite(run.g) && is_finite(run.g_mid)) return std::nullopt;
    return Sources::NonFinite{run.Time(grid, 0),
                              "f or g has no finite value between t = " + FormatNumber(run.Time(grid, 0)) + " and " +
                                  FormatNumber(run.Time(grid, steps))};
  }

 private:
  struct Samples {
    Matrix nodes, middles;
  };
  static Samples SamplesOf(TimeFunctionEvaluator& function, const Grid& grid, const ReducedRun& run) {
    const Index steps = run.steps();
    Samples samples{Matrix(function.size(), steps + 1), Matrix(function.size(), steps)};
    for (Index j = 0; j <= steps; ++j) {
      LookForStop();
      function.Evaluate(run.Time(grid, j), j == 0 ? Side::kRight : Side::kLeft, samples.nodes.col(j));
      if (j == 0) continue;
      const double middle = (run.Time(grid, j - 1) + run.Time(grid, j)) / 2;
      function.Evaluate(middle, Side::kRight, samples.middles.col(j - 1));
    }
    return samples;
  }

  StructuredMatrix lift_, g_lift_;
  bool shared_;
  TimeFunctionEvaluator psi_;
  std::optional<TimeFunctionEvaluator> g_;  // where it is not that of f
};

// The nodes of `run` in 1..steps whose states are needed: those of the output, and the last.
std::vector<Index> NodesWanted(const Grid& grid, const Run& run, Index steps) {
  std::vector<Index> wanted;
  const auto first = std::upper_bound(grid.output_nodes.begin(), grid.output_nodes.end(), run.first_node);
  for (auto node = first; node != grid.output_nodes.end() && *node <= run.first_node + steps; ++node) {
    wanted.push_back(*node - run.first_node);
  }
  const bool ends_grid = run.first_node + steps == grid.num_steps();
  if (!ends_grid && steps > 0 && (wanted.empty() || wanted.back() != steps)) wanted.push_back(steps);
  return wanted;
}

// Certifies y of `run` at the nodes and middles of the first `steps` steps. N x is formed anew, for all of them at once
// and not as the method went. Uses up run.free.
void Certify(SolveContext& context, ReducedRun& run, Index steps, Hold hold) {
  const Problem& problem = context.problem;
  CertificateBuilder& certificate = context.certificate;
  const bool linear = hold == Hold::kLinear;
  if (linear) {
    const auto y = run.y.col(0);
    certificate.AddNodes(y, run.free.nodes.col(0) + run.g.col(0) + problem.M * y);
  }
  const Motion motion = run.kernel->MoveThroughout(std::move(run.free), run.y.leftCols(steps + 1), context.workers);
  Matrix w, y_mid;
  for (Index begin = 0; begin < steps; begin += kColumnsPerBlock) {
    LookForStop();
    const Index count = std::min(kColumnsPerBlock, steps - begin);
    const auto of_steps = [&](const Matrix& values) { return values.middleCols(begin, count); };
    const auto after_steps = [&](const Matrix& values) { return values.middleCols(begin + 1, count); };
    const auto y = after_steps(run.y);
    w.noalias() = problem.M * y;
    w += of_steps(motion.nodes) + after_steps(run.g);
    certificate.AddNodes(y, w);

    y_mid = y;
    if (linear) y_mid = (y_mid + of_steps(run.y)) / 2;
    w.noalias() = problem.M * y_mid;
    w += of_steps(motion.middles) + of_steps(run.g_mid);
    certificate.AddMidpoints(y_mid, w, run.f_defect);
  }
}

// Files y and `states` at `nodes`.
void File(SolveContext& context, const ReducedRun& run, const std::vector<Index>& nodes, const Matrix& states,
          const Eigen::Ref<const Vector>& start) {
  const Problem& problem = context.problem;
  CertificateBuilder& certificate = context.certificate;
  const Matrix& y = run.y;
  // States are made in another way than N x was: they are its witnesses.
  const Vector w_of_start = problem.N * start + run.g.col(0) + problem.M * y.col(0);
  context.recorder.Begin(run.run.first_node, y.col(0), w_of_start);
  const auto is_output = [&](Index node) {
    return std::binary_search(context.grid.output_nodes.begin(), context.grid.output_nodes.end(), node);
  };
  if (is_output(run.run.first_node)) context.recorder.Take(run.run.first_node, start, y.col(0), w_of_start);
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    LookForStop();
    const Index j = nodes[k];
    const auto x = states.col(static_cast<Index>(k));
    const Vector w_of_state = problem.N * x + run.g.col(j) + problem.M * y.col(j);
    certificate.AddNodes(y.col(j), w_of_state);
    Vector slope = problem.A * x;
    slope += problem.B * y.col(j);
    const auto psi = run.sources.psi.col(j);
    slope += problem.f.is_lifted() ? Vector(problem.f.lift * psi) : Vector(psi);
    certificate.AddStates(x, slope);
    const Index node = run.run.first_node + j;
    if (is_output(node)) context.recorder.Take(node, x, y.col(j), w_of_state);
  }
}

}  // namespace

Vector ReducedRun::Sizes() const {
  const auto size_of = [](const Matrix& values) {
    Vector size = Vector::Zero(values.rows());
    RaiseRowMaxAbs(values, size);
    return size;
  };
  Vector sizes = size_of(free.nodes) + size_of(g);
  return (sizes.array() + kMixing * MaxAbs(sizes)).matrix();
}

bool SolveRunByRun(SolveContext& context, Hold hold, const CarryMethod& carry,
                   const std::function<Index(ReducedRun&)>& solve) {
  const Problem& problem = context.problem;
  Propagator& system = *context.choices.propagator;
  Cost& cost = context.solution.cost;
  ReducedSources sampler(problem);
  Vector x = problem.x0;
  Vector y = Vector::Zero(problem.num_constraints());
  bool y_is_solution = false;
  std::size_t at = 0;  // the run, the y that are found in it, and N x behind them
  Matrix y_found;
  Vector N_x;
  const auto carry_all = [&](StateArchive& state) {
    state(at, x, y, y_is_solution, y_found, N_x);
    carry(state);
  };
  if (!ResumeFromCheckpoint(context, carry_all)) return false;
  // Kernels are kept, and the first run with a length of steps decides how its kernel is made.
  for (std::size_t earlier = 0; earlier < at; ++earlier) {
    const Run& run = context.grid.runs[earlier];
    system.MakeKernel(run.step, hold, run.steps, context.workers, context.stop);
  }

  for (; at < context.grid.runs.size(); ++at) {
    const Run& grid_run = context.grid.runs[at];
    ReducedRun run{.run = grid_run, .sources = {}, .g = {}, .g_mid = {}, .free = {}, .kernel = {}, .y = {}};
    const double setup_begin = context.Seconds();
    if (const auto bad = sampler.Sample(context.grid, run)) return context.FailNonFinite(*bad);
    const double begin = run.Time(context.grid, 0);
    const bool has_begun = y_found.cols() > 0;
    if (!has_begun && grid_run.starts_at_break) {
      if (!StartInterval(context, begin, run.g.col(0), x, y, y_is_solution)) return false;
      const bool needs_y = hold == Hold::kLinear;
      if (needs_y && !y_is_solution) return FailLcp(context, LcpStatus::kInfeasible, begin, "LCP(N x + g, M)");
    }

    run.kernel = system.MakeKernel(grid_run.step, hold, run.steps(), context.workers, context.stop);
    if (run.kernel) run.free = system.Move(x, run.sources, hold, context.workers, context.stop);
    if (context.stop.stop_requested()) return context.FailCancelled(begin);
    if (!std::isfinite(MaxAbs(run.free.nodes))) {
      return context.Fail(Termination::kNonFinite, begin,
                          "The state grows beyond the range of numbers after t = " + FormatNumber(begin) + ".");
    }
    run.y.resize(y.size(), run.steps() + 1);
    run.y.col(0) = y;
    cost.seconds_setup += context.Seconds() - setup_begin;

    if (has_begun) {
      run.y.leftCols(y_found.cols()) = y_found;
      run.N_x = N_x;
      run.first_step = y_found.cols() - 1;
    }
    run.offer_checkpoint = [&](Index done, const Vector& N_x_behind) {
      OfferCheckpoint(context, run.Time(context.grid, done), [&](StateArchive& state) {
        y_found = run.y.leftCols(done + 1);
        N_x = N_x_behind;
        carry_all(state);
      });
    };
    const auto counted = [&cost] { return cost.seconds_lcp + cost.seconds_linear; };
    const double solve_begin = context.Seconds(), counted_before = counted();
    const Index steps = solve(run);
    y_found.resize(y.size(), 0);
    cost.seconds_linear += context.Seconds() - solve_begin - (counted() - counted_before);
    if (steps > 0) {
      const double states_begin = context.Seconds();
      const std::vector<Index> nodes = NodesWanted(context.grid, grid_run, steps);
      Matrix states;
      if (!nodes.empty()) {
        states = system.States(x, run.sources, run.y.leftCols(steps + 1), hold, nodes, context.workers, context.stop);
        if (context.stop.stop_requested()) return context.FailCancelled(begin);
      }
      if (hold == Hold::kConstant && !y_is_solution) run.y.col(0) = run.y.col(1);
      const double certificate_begin = context.Seconds();
      cost.seconds_linear += certificate_begin - states_begin;
      Certify(context, run, steps, hold);
      File(context, run, nodes, states, x);
      if (!nodes.empty() && nodes.back() == steps) x = states.col(states.cols() - 1);
      y = run.y.col(steps);
      cost.seconds_certificate += context.Seconds() - certificate_begin;
    }
    if (steps < run.steps()) return false;
  }
  context.solution.propagator = system.record();
  return true;
}

}  // namespace dlcs
