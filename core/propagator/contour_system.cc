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

namespace dlcs {
namespace {

// e^{-38} = 3e-17; the poles of ramps at zero, close to the contour, add two orders.
constexpr double kFarAccuracy = 38;
constexpr double kNearAccuracy = 44;
// Columns of a lift that are solved for with those of B; of wider ones the rank of ψ is used.
constexpr Index kNarrowLift = 16;
// The number of right-hand sides solved together.
constexpr Index kColumnsAtOnce = 8;
// Sums of states that are formed at the same time, where they fit; a cut that does not depend on the threads.
constexpr Index kPartialSums = 4;
constexpr double kPartialSumBytes = 1e9;

// The factors of zE - A: twice as many numbers as the Cholesky factor, complex, with their indices and some room.
double FactorBytes(const Sector& sector) { return 1.3 * 2 * sector.factor_nonzeros * 20; }

// The size of the cache that holds values for some step lengths if the caller provides none.
constexpr double kOwnSetupBytes = 1e8;

SetupKey KeyOf(const Problem& problem, const Sector& sector, bool with_lift) {
  SetupKey key("contour");
  key.Add(problem.A).Add(problem.B).Add(problem.N).Add(problem.E).Add(sector.angle).Add(sector.shift);
  if (with_lift) key.Add(problem.f.lift);
  return key;
}

bool KeepsLift(const Problem& problem) { return problem.f.is_lifted() && problem.f.lift.cols() <= kNarrowLift; }

// To all processes, from the one that owns the part.
void ShareMatrix(Team& team, Index part, Eigen::MatrixXcd& matrix) {
  team.Share(team.OwnerOf(part), reinterpret_cast<double*>(matrix.data()), 2 * matrix.size());
}

double BytesOf(const TransferValues& values) {
  double bytes = 0;
  for (const Eigen::MatrixXcd& value : values) bytes += 16.0 * static_cast<double>(value.size());
  return bytes;
}

Matrix Beside(const Matrix& left, const Matrix& right) {
  Matrix both(left.rows(), left.cols() + right.cols());
  both << left, right;
  return both;
}

}  // namespace

std::unique_ptr<ContourSystem> ContourSystem::Create(const Problem& problem, const Options& options,
                                                     std::string& why_not, SetupCache* setups) {
  const auto sector = FindSector(problem.A.Sparse(), problem.horizon, problem.E.Sparse());
  if (!sector) {
    const std::string of = problem.has_mass() ? "the pencil (A, E), whose E must be symmetric positive definite," : "A";
    why_not = "no sector holds the field of values of " + of +
              " that is narrow enough for a contour up to T = " + FormatNumber(problem.horizon) +
              ": solutions grow too much, or oscillate too fast for their decay";
    return nullptr;
  }
  const double columns = static_cast<double>(problem.num_constraints() + kNarrowLift);
  const double m = static_cast<double>(problem.num_states());
  const int threads = Workers(options.num_threads).max_threads();
  const double each = FactorBytes(*sector) + 6 * 16 * m * kColumnsAtOnce, all = 8 * m * columns;
  // As many at once as fit into half of the memory, so that factors can be kept in the rest.
  const double fitting = std::floor((options.max_memory / 2 - all) / each);
  const int at_once = static_cast<int>(std::clamp(fitting, 1.0, static_cast<double>(threads)));
  const double needed = at_once * each + all;
  if (needed > options.max_memory) {
    why_not = "the sparse factors on a contour need some " + FormatNumber(needed) +
              " bytes, more than max_memory = " + FormatNumber(options.max_memory);
    return nullptr;
  }
  // Takes half of the remaining memory. The states and the trajectory need the rest.
  return std::unique_ptr<ContourSystem>(
      new ContourSystem(problem, *sector, needed, (options.max_memory - needed) / 2, at_once, threads, setups));
}

ContourSystem::ContourSystem(const Problem& problem, const Sector& sector, double needed_bytes, double kept_bytes,
                             int at_once, int threads, SetupCache* setups)
    : N_(problem.N.Sparse()),
      B_(problem.B.Sparse()),
      E_(problem.E),
      lift_(problem.f.lift),
      keeps_lift_(KeepsLift(problem)),
      x0_(problem.x0),
      horizon_(problem.horizon),
      sector_(sector),
      needed_bytes_(needed_bytes),
      kept_bytes_(kept_bytes),
      resolvent_(problem.A.Sparse(), problem.E.Sparse(), kept_bytes),
      matrices_(KeyOf(problem, sector, keeps_lift_)),
      setups_(setups, kOwnSetupBytes),
      few_workers_(at_once < threads ? std::make_unique<Workers>(at_once) : nullptr),
      at_once_(at_once),
      team_(Team::Current()) {}

StepContours ContourSystem::MakeContours(double step, Index steps) const {
  const double angle = sector_.angle, shift = sector_.shift * step;
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
  const double values = nodes * 16 * static_cast<double>(N_.rows()) * columns;
  return needed_bytes_ + std::min(kept_bytes_, nodes * FactorBytes(sector_)) + values;
}

std::vector<TransferValues> ContourSystem::Visit(double step, const StepContours& contours,
                                                 const std::vector<Matrix>& groups, Workers& workers,
                                                 const std::stop_token& stop) {
  std::vector<TransferValues> values;
  for (const Matrix& columns : groups) {
    values.emplace_back(static_cast<std::size_t>(contours.size()), Eigen::MatrixXcd(N_.rows(), columns.cols()));
  }
  (few_workers_ ? *few_workers_ : workers).ForBlocks(contours.size(), 1, [&](Index, Index p, Index) {
    if (stop.stop_requested() || !team_.Owns(p)) return;
    const ContourNode& node = contours.node(p);
    const auto factor = resolvent_.At(node.z / step);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      for (Index begin = 0; begin < groups[g].cols(); begin += kColumnsAtOnce) {
        const Index count = std::min(kColumnsAtOnce, groups[g].cols() - begin);
        const Eigen::MatrixXcd solved = factor->Solve(groups[g].middleCols(begin, count).cast<Complex>());
        values[g][static_cast<std::size_t>(p)].middleCols(begin, count) = node.weight * (N_.cast<Complex>() * solved);
      }
    }
  });
  if (stop.stop_requested()) values.clear();
  for (TransferValues& of_group : values) {
    for (Index p = 0; p < contours.size(); ++p) ShareMatrix(team_, p, of_group[static_cast<std::size_t>(p)]);
  }
  return values;
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
        const Matrix inputs = keeps_lift_ ? Beside(Matrix(B_), Matrix(lift_.Sparse())) : Matrix(B_);
        auto values = Visit(step, made->contours, {inputs, Weighted(x0_)}, workers, stop);
        if (values.empty()) return {};
        made->of_start = std::move(values[1]);
        const double bytes = BytesOf(values[0]);
        return {std::make_shared<const TransferValues>(std::move(values[0])), bytes};
      });
  if (!made->of_inputs) return nullptr;
  if (made->of_start.empty()) {  // others have made the rest
    auto values = Visit(step, made->contours, {Weighted(x0_)}, workers, stop);
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
  if (MaxAbs(sources.psi) == 0) return {Matrix(x0_.size(), 0), Matrix(0, sources.psi.cols())};
  if (keeps_lift_) return {Matrix(), sources.psi};
  LowRank factors = FactorByRank(sources.psi);
  if (lift_.size() > 0) factors.columns = lift_ * factors.columns;
  return {std::move(factors.columns), std::move(factors.rows)};
}

FreeMotion ContourSystem::Move(const Vector& x, const RunSources& sources, Hold /*hold*/, Workers& workers,
                               const std::stop_token& stop) {
  const Index steps = sources.psi.cols() - 1, n = N_.rows();
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
    visited = Visit(known->step, known->contours, unknown, workers, stop);
    if (visited.empty()) return motion;
  }

  TransferValues of_x = known_start ? known->of_start : std::move(visited.back());
  for (Eigen::MatrixXcd& value : of_x) value /= known->step;  // dz in units of one over the step
  const NodesAndMiddles decay = Decay(known->contours, of_x, steps, workers);
  motion.nodes.col(0) = N_ * x;
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
  const Index m = x.size(), n = B_.cols(), outputs = static_cast<Index>(nodes.size());
  Matrix no_states = Matrix::Zero(m, outputs);
  const StepValues* known = At(sources.step, sources.psi.cols() - 1, workers, stop);
  if (!known) return no_states;
  const double h = known->step;
  const StepContours& contours = known->contours;
  Sources split = Split(sources);
  if (split.columns.size() == 0 && split.signal.rows() > 0) split.columns = Matrix(lift_.Sparse());
  const Index r = split.columns.cols();
  const Matrix columns = Beside(Beside(Matrix(B_), split.columns), Weighted(x));

  const Index parts = 8.0 * kPartialSums * static_cast<double>(m * outputs) <= kPartialSumBytes ? kPartialSums : 1;
  std::vector<Matrix> sums(static_cast<std::size_t>(parts), no_states);
  // The nodes that Visit() gives to this process, whose factors may be kept.
  const Index stride = parts * team_.size();
  (few_workers_ ? *few_workers_ : workers).ForBlocks(parts, 1, [&](Index part, Index, Index) {
    Matrix& sum = sums[static_cast<std::size_t>(part)];
    Eigen::MatrixXcd excited(n + r + 1, outputs);
    for (Index p = part * team_.size() + team_.rank(); p < contours.size() && !stop.stop_requested(); p += stride) {
      const ContourNode& node = contours.node(p);
      const bool is_near = contours.is_near(p);
      ExciteByPulses(node.z, is_near, hold, y, nodes, excited.topRows(n));
      ExciteByPulses(node.z, is_near, Hold::kLinear, split.signal, nodes, excited.middleRows(n, r));
      for (Index k = 0; k < outputs; ++k) {
        const auto steps = static_cast<double>(nodes[static_cast<std::size_t>(k)]);
        excited(n + r, k) = is_near ? Complex(0) : std::exp(steps * node.z) / h;
      }
      excited *= node.weight;
      const auto factor = resolvent_.At(node.z / h);
      const Index solves = std::min(outputs, excited.rows());
      for (Index first = 0; first < solves; first += kColumnsAtOnce) {
        const Index count = std::min(kColumnsAtOnce, solves - first);
        if (outputs <= excited.rows()) {
          sum.middleCols(first, count) += factor->Solve(columns * excited.middleCols(first, count)).real();
        } else {
          const Eigen::MatrixXcd solved = factor->Solve(columns.middleCols(first, count).cast<Complex>());
          const Eigen::MatrixXcd part_excited = excited.middleRows(first, count);
          sum.noalias() += solved.real() * Matrix(part_excited.real());
          sum.noalias() -= solved.imag() * Matrix(part_excited.imag());
        }
      }
    }
  });
  for (std::size_t part = 1; part < sums.size(); ++part) sums[0] += sums[part];
  if (team_.is_alone()) return std::move(sums[0]);
  Matrix states = std::move(no_states);
  for (int rank = 0; rank < team_.size(); ++rank) {
    Matrix of_rank = sums[0];
    team_.Share(rank, of_rank.data(), of_rank.size());
    states += of_rank;
  }
  return states;
}

PropagatorRecord ContourSystem::record() const {
  PropagatorRecord record;
  record.used = PropagatorKind::kContour;
  record.reason = "A is sparse, m = " + std::to_string(x0_.size()) + ", with " + std::to_string(N_.rows()) +
                  " constraints; its field of values lies in a sector of angle " + FormatNumber(sector_.angle) +
                  " from " + FormatNumber(sector_.shift);
  if (few_workers_) {
    const std::string count = at_once_ == 1 ? "one factorization" : std::to_string(at_once_) + " factorizations";
    record.reason += "; max_memory allows " + count + " at a time";
  }
  record.factorizations = static_cast<Index>(team_.Sum(static_cast<double>(resolvent_.factorizations())));
  for (const auto& values : steps_) {
    record.terms += values->contours.size();
    record.error = std::max(record.error, std::exp(values->contours.log_loss) * std::numeric_limits<double>::epsilon());
  }
  return record;
}

}  // namespace dlcs
