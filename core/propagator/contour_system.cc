// SPDX-License-Identifier: Apache-2.0
#include "core/propagator/contour_system.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/discretization/step_cache.h"
#include "core/format_number.h"
#include "core/laplace/range_contour.h"
#include "core/linalg/low_rank.h"
#include "core/linalg/norms.h"
#include "core/parallel/team.h"
#include "core/propagator/factored_nodes.h"

namespace dlcs {
namespace {

// e^{-38} = 3e-17; the poles of ramps at zero, close to the contour, add two orders.
constexpr double kFarAccuracy = 38;
constexpr double kNearAccuracy = 44;
// The size of the cache that holds values for some step lengths if the caller provides none.
constexpr Index kOwnSetupBytes = 100'000'000;

SetupKey KeyOf(const Problem& problem, const Sector& sector, bool with_lift) {
  SetupKey key("contour");
  key.Add(problem.A).Add(problem.B).Add(problem.N).Add(problem.E).Add(sector.angle).Add(sector.shift);
  if (with_lift) key.Add(problem.f.lift);
  return key;
}

bool KeepsLift(const Problem& problem) { return problem.f.is_lifted() && problem.f.lift.cols() <= kNarrowLift; }

double BytesOf(const TransferValues& values) {
  double bytes = 0;
  for (const Eigen::MatrixXcd& value : values) bytes += 16.0 * static_cast<double>(value.size());
  return bytes;
}

// Of groups, whose values have their own bits and stay with the solve: its steps alone tell them apart.
SetupKey KeyOfOneSolve() { return SetupKey("contour of a solve"); }

Matrix Beside(const Matrix& left, const Matrix& right) {
  Matrix both(left.rows(), left.cols() + right.cols());
  both << left, right;
  return both;
}

}  // namespace

std::unique_ptr<ContourSystem> ContourSystem::Create(const Problem& problem, const Options& options,
                                                     std::string& why_not, SetupCache* setups) {
  std::unique_ptr<NodeSolver> nodes;
  NodeSolverGroups* const groups = Team::Current().node_solver_groups();
  if (groups) {
    nodes = groups->MakeSolver(problem, options, why_not);
  } else {
    nodes = FactoredNodes::Create(problem, options, why_not);
  }
  if (!nodes) return nullptr;
  SetupKey key = groups ? KeyOfOneSolve() : KeyOf(problem, nodes->sector(), KeepsLift(problem));
  return std::unique_ptr<ContourSystem>(
      new ContourSystem(problem, std::move(nodes), std::move(key), groups ? nullptr : setups));
}

ContourSystem::ContourSystem(const Problem& problem, std::unique_ptr<NodeSolver> nodes, SetupKey matrices,
                             SetupCache* setups)
    : nodes_(std::move(nodes)),
      constraints_(problem.num_constraints()),
      B_(nodes_->OwnRows(problem.B)),
      E_(problem.E),
      lift_(problem.f.lift),
      keeps_lift_(KeepsLift(problem)),
      x0_(problem.x0),
      horizon_(problem.horizon),
      matrices_(std::move(matrices)),
      setups_(setups, kOwnSetupBytes) {
  if (keeps_lift_) own_lift_ = nodes_->OwnRows(lift_);
}

StepContours ContourSystem::MakeContours(double step, Index steps) const {
  const double angle = nodes_->sector().angle, shift = nodes_->sector().shift * step;
  StepContours contours;
  // All runs of this step fit the horizon, and a longer contour costs little.
  contours.longest = std::max(steps, static_cast<Index>(std::ceil(horizon_ / step * (1 - 1e-9))));
  const auto near = FindSectorContour(0.5, 2, kNearAccuracy, angle, shift);
  const auto far = FindSectorContour(0.5, static_cast<double>(contours.longest + 1), kFarAccuracy, angle, shift);
  contours.near = near.value().Nodes();  // FindSector() leaves room for both
  contours.far = far.value().Nodes();
  contours.log_loss = std::max(near->log_loss, far->log_loss);
  return contours;
}

double ContourSystem::PredictBytes(const Grid& grid) const {
  std::vector<double> lengths;
  double nodes = 0;
  for (const Run& run : grid.runs) {
    const auto is_known = [&](double length) { return IsSameStep(length, run.step); };
    if (std::any_of(lengths.begin(), lengths.end(), is_known)) continue;
    if (lengths.size() == kCachedSteps) break;  // no more are kept
    lengths.push_back(run.step);
    nodes += static_cast<double>(MakeContours(run.step, run.steps).size());
  }
  const double columns = static_cast<double>(B_.cols() + (keeps_lift_ ? lift_.cols() : 0) + 1);
  return nodes_->PredictBytes(nodes) + nodes * 16 * static_cast<double>(constraints_) * columns;
}

const ContourSystem::StepValues* ContourSystem::At(double step, Index steps, Workers& workers,
                                                   const std::stop_token& stop) {
  for (const auto& values : steps_) {
    if (IsSameStep(values->step, step) && values->contours.longest >= steps) return values.get();
  }
  auto made = std::make_unique<StepValues>();
  made->step = step;
  made->contours = MakeContours(step, steps);
  SetupKey key = matrices_;
  made->of_inputs = setups_->Get<TransferValues>(
      key.Add(step).Add(made->contours.longest), [&]() -> SetupCache::Made<TransferValues> {
        const Matrix inputs = keeps_lift_ ? Beside(Matrix(B_), Matrix(own_lift_)) : Matrix(B_);
        auto values = nodes_->Values(step, made->contours, {inputs, Weighted(x0_)}, workers, stop);
        if (values.empty()) return {};
        made->of_start = std::move(values[1]);
        const double bytes = BytesOf(values[0]);
        return {std::make_shared<const TransferValues>(std::move(values[0])), bytes};
      });
  if (!made->of_inputs) return nullptr;
  if (made->of_start.empty()) {  // others have made the rest
    auto values = nodes_->Values(step, made->contours, {Weighted(x0_)}, workers, stop);
    if (values.empty()) return nullptr;
    made->of_start = std::move(values[0]);
  }
  if (steps_.size() == kCachedSteps) steps_.erase(steps_.begin());
  return steps_.emplace_back(std::move(made)).get();
}

TransferValues ContourSystem::Part(const TransferValues& values, Index first, Index count) {
  TransferValues part;
  for (const Eigen::MatrixXcd& value : values) part.emplace_back(value.middleCols(first, count));
  return part;
}

std::shared_ptr<const ReducedKernel> ContourSystem::MakeKernel(double step, Hold hold, Index longest_window,
                                                               Workers& workers, const std::stop_token& stop) {
  for (const KeptKernel& kept : kernels_) {
    if (IsSameStep(kept.step, step) && kept.hold == hold) return kept.kernel;
  }
  const StepValues* values = At(step, longest_window, workers, stop);
  if (!values) return nullptr;
  const ContourResponse response(values->contours, Part(*values->of_inputs, 0, B_.cols()), hold);
  auto kernel = std::make_shared<const ContourKernel>(step, values->contours.longest, response);
  if (kernels_.size() == kCachedSteps) kernels_.erase(kernels_.begin());
  kernels_.push_back({step, hold, kernel});
  return kernel;
}

ContourSystem::Sources ContourSystem::Split(const RunSources& sources) const {
  if (MaxAbs(sources.psi) == 0) return {Matrix(B_.rows(), 0), Matrix(0, sources.psi.cols())};
  if (keeps_lift_) return {Matrix(), sources.psi};
  LowRank factors = FactorByRank(sources.psi);
  if (lift_.size() > 0) factors.columns = lift_ * factors.columns;
  return {nodes_->OwnRows(std::move(factors.columns)), std::move(factors.rows)};
}

FreeMotion ContourSystem::Move(const Vector& x, const RunSources& sources, Hold /*hold*/, Workers& workers,
                               const std::stop_token& stop) {
  const Index steps = sources.psi.cols() - 1, n = constraints_;
  FreeMotion motion{.nodes = Matrix(n, steps + 1), .middles = Matrix(n, steps), .modes = {}};
  const StepValues* known = At(sources.step, steps, workers, stop);
  if (!known) return motion;
  const Sources split = Split(sources);
  const bool known_start = x == x0_, known_lift = split.columns.size() == 0 && split.signal.rows() > 0;
  std::vector<Matrix> unknown;
  if (!known_lift && split.columns.cols() > 0) unknown.push_back(split.columns);
  if (!known_start) unknown.push_back(Weighted(x));
  std::vector<TransferValues> visited;
  if (!unknown.empty()) {
    visited = nodes_->Values(known->step, known->contours, unknown, workers, stop);
    if (visited.empty()) return motion;
  }

  TransferValues of_x = known_start ? known->of_start : std::move(visited.back());
  for (Eigen::MatrixXcd& value : of_x) value /= known->step;  // dz in units of one over the step
  const NodesAndMiddles decay = Decay(known->contours, of_x, steps, workers);
  motion.nodes.col(0) = nodes_->Observe(x);
  motion.nodes.rightCols(steps) = decay.nodes;
  motion.middles = decay.middles;
  if (split.signal.rows() == 0) return motion;
  const TransferValues of_f =
      known_lift ? Part(*known->of_inputs, B_.cols(), split.signal.rows()) : std::move(visited.front());
  const NodesAndMiddles forced = ContourResponse(known->contours, of_f, Hold::kLinear).Respond(split.signal, workers);
  motion.nodes.rightCols(steps) += forced.nodes;
  motion.middles += forced.middles;
  return motion;
}

namespace {

// What a train with the columns of `signal` says at contour node z and the wanted grid nodes: rows are its components.
void ExciteByPulses(Complex z, bool is_near, Hold hold, const Eigen::Ref<const Matrix>& signal,
                    const std::vector<Index>& nodes, Eigen::Ref<Eigen::MatrixXcd> excited) {
  if (is_near) {
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const Index j = nodes[k];
      auto column = excited.col(static_cast<Index>(k));
      column = NearPulse(hold, z, 0) * signal.col(j).cast<Complex>();
      if (IsFarAtNextNode(hold)) continue;
      column += (j == 1 ? NearStart(z, 1) : NearPulse(hold, z, 1)) * signal.col(j - 1);
    }
    return;
  }
  PulseTrain train({z}, hold, signal.col(0));
  Index at = 1;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    for (; at < nodes[k]; ++at) train.Push(signal.col(at));
    excited.col(static_cast<Index>(k)) = train.far();
  }
}

}  // namespace

Matrix ContourSystem::States(const Vector& x, const RunSources& sources, const Matrix& y, Hold hold,
                             const std::vector<Index>& nodes, Workers& workers, const std::stop_token& stop) {
  const Index n = B_.cols(), outputs = static_cast<Index>(nodes.size());
  const StepValues* known = At(sources.step, sources.psi.cols() - 1, workers, stop);
  if (!known) return Matrix::Zero(x.size(), outputs);
  const double h = known->step;
  const StepContours& contours = known->contours;
  Sources split = Split(sources);
  if (split.columns.size() == 0 && split.signal.rows() > 0) split.columns = Matrix(own_lift_);
  const Index r = split.columns.cols();
  const Matrix columns = Beside(Beside(Matrix(B_), split.columns), Weighted(x));
  const auto excite = [&](Index p, Eigen::Ref<Eigen::MatrixXcd> excited) {
    const ContourNode& node = contours.node(p);
    const bool is_near = contours.is_near(p);
    ExciteByPulses(node.z, is_near, hold, y, nodes, excited.topRows(n));
    ExciteByPulses(node.z, is_near, Hold::kLinear, split.signal, nodes, excited.middleRows(n, r));
    for (Index k = 0; k < outputs; ++k) {
      const auto steps = static_cast<double>(nodes[static_cast<std::size_t>(k)]);
      excited(n + r, k) = is_near ? Complex(0) : std::exp(steps * node.z) / h;
    }
    excited *= node.weight;
  };
  return nodes_->States(h, contours, columns, outputs, excite, workers, stop);
}

PropagatorRecord ContourSystem::record() const {
  PropagatorRecord record;
  record.used = PropagatorKind::kContour;
  const Sector& sector = nodes_->sector();
  record.reason = "A is sparse, m = " + std::to_string(x0_.size()) + ", with " + std::to_string(constraints_) +
                  " constraints; its field of values lies in a sector of angle " + FormatNumber(sector.angle) +
                  " from " + FormatNumber(sector.shift);
  nodes_->Report(record);
  for (const auto& values : steps_) {
    record.terms += values->contours.size();
    record.error = std::max(record.error, std::exp(values->contours.log_loss) * std::numeric_limits<double>::epsilon());
  }
  return record;
}

}  // namespace dlcs
