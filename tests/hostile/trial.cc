// SPDX-License-Identifier: Apache-2.0
#include "tests/hostile/trial.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <stop_token>
#include <thread>

#include "core/outputs/output_evaluator.h"
#include "core/problem/verdict.h"
#include "core/solve.h"

namespace dlcs::hostile {

namespace {

constexpr double kFloor = 16 * 0x1p-52;  // of errors and figures

// Requests a stop after some seconds, unless it is destroyed before.
class Deadline {
 public:
  explicit Deadline(double seconds)
      : thread_([this, seconds] {
          std::unique_lock lock(mutex_);
          if (!done_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return is_done_; }))
            source_.request_stop();
        }) {}
  ~Deadline() {
    {
      const std::lock_guard lock(mutex_);
      is_done_ = true;
    }
    done_.notify_all();
    thread_.join();
  }
  std::stop_token token() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  std::mutex mutex_;
  std::condition_variable done_;
  bool is_done_ = false;
  std::thread thread_;
};

Index ColumnAt(const Solution& solution, double time) {
  const auto found = std::lower_bound(solution.times.begin(), solution.times.end(), time);
  return found != solution.times.end() && *found == time ? found - solution.times.begin() : -1;
}

// What the engine names a component.
std::optional<NamedComponent> NamedOf(const Solution& solution, const Component& component) {
  const auto& named = solution.accuracy.named;
  const auto found =
      std::find_if(named.begin(), named.end(), [&](const NamedComponent& of) { return of.component == component; });
  return found != named.end() ? std::optional(*found) : std::nullopt;
}

// Whether the engine reports that it switches at this time, within the error of the time of the switch, or of a double.
// There y, w and outputs may jump, and be those of the other side.
bool MaySwitchAt(double time, const Solution& solution) {
  constexpr double kUlps = 4 * std::numeric_limits<double>::epsilon();
  return std::any_of(solution.switching_times.begin(), solution.switching_times.end(), [time](const SwitchingTime& at) {
    return std::abs(time - at.time) <= std::max(at.error, kUlps * time);
  });
}

// Whether the solution and the reference have different pairs active at the k-th time. If x is right, y is not unique
// there: the certificate holds the solution to the LCP.
bool HasOtherPairs(const Solution& solution, const Reference& reference, size_t k, double tolerance) {
  const Index column = ColumnAt(solution, reference.times[k]);
  if (column < 0) return false;
  const auto at = static_cast<Index>(k);
  for (Index i = 0; i < reference.y.rows(); ++i) {
    const double y = tolerance * reference.size_y(i), w = tolerance * reference.size_w(i);
    if (solution.y(i, column) > y && reference.w(i, at) > w) return true;
    if (solution.w(i, column) > w && reference.y(i, at) > y) return true;
  }
  return false;
}

// Adds the components of one kind: `values` against `expected`, columns at the times of the reference.
void AddErrors(ComponentKind kind, const Matrix& values, const Solution& solution, const Reference& reference,
               const Eigen::MatrixXd& expected, const Eigen::VectorXd& sizes, double tolerance,
               std::vector<ComponentError>& errors) {
  for (Index i = 0; i < expected.rows(); ++i) {
    ComponentError error{{kind, i}, 0, 0, sizes(i), NamedOf(solution, {kind, i})};
    for (size_t k = 0; k < reference.times.size(); ++k) {
      const Index column = ColumnAt(solution, reference.times[k]);
      if (column < 0 || std::isnan(expected(i, static_cast<Index>(k)))) continue;
      if (kind != ComponentKind::kState &&
          (MaySwitchAt(reference.times[k], solution) || HasOtherPairs(solution, reference, k, tolerance))) {
        continue;
      }
      const double difference = std::abs(values(i, column) - expected(i, static_cast<Index>(k)));
      if (difference <= error.error) continue;
      error.error = difference;
      error.time = reference.times[k];
    }
    errors.push_back(error);
  }
}

// Raises the error of `trial` to the largest of all components, relative to the size of each. An error of a component
// that is named as zero or negligible counts by how much it is of twice its rounding, which is what its name promises.
void CompareAll(const System& system, const Solution& solution, const Reference& reference, double tolerance,
                Trial& trial) {
  constexpr double kZero = 1e-28;  // what 106 bits leave of a zero, beside the largest component
  trial.error = trial.error_of_figure = kFloor;
  const std::vector<ComponentError> errors = ErrorsOf(system, solution, reference, tolerance);
  for (const ComponentError& of : errors) {
    double largest = 0;
    for (const ComponentError& other : errors) {
      if (other.component.kind == of.component.kind) largest = std::max(largest, other.own);
    }
    if (!(of.error > kZero * largest)) continue;
    const bool is_small = of.named && of.named->knowledge != Knowledge::kMissed;
    double relative = of.own > 0 ? of.error / of.own : std::numeric_limits<double>::infinity();
    if (is_small) {
      relative = tolerance * of.error / (2 * of.named->rounding);
    } else {
      trial.error_of_figure = std::max(*trial.error_of_figure, relative);
    }
    if (relative <= *trial.error) continue;
    trial.error = relative;
    trial.component = NumberedName(of.component) + (is_small ? " (named)" : "");
    trial.time = of.time;
  }
}

// What rounding in 106 bits may be of the reference, relative to the size of the smallest state: sums lose 1e-31 of
// their terms, and where one state grows by 1e26, others that it does not move in exact numbers take that from it.
double RoundingOf(const Reference& reference) {
  constexpr double kOfTerms = 1e-31;
  return kOfTerms * reference.size.maxCoeff() / reference.size.cwiseMax(std::numeric_limits<double>::min()).minCoeff();
}

// The error that the engine estimates; absent if it has no estimate.
std::optional<double> FigureOf(const Solution& solution) {
  if (solution.accuracy.source == AccuracySource::kNotEstimated || std::isnan(solution.accuracy.error))
    return std::nullopt;
  return std::max(solution.accuracy.error, kFloor);
}

// The active set that the engine reports behind `time`, as bits; nothing if coupled steps were taken.
std::optional<unsigned> ReportedActive(const Solution& solution, double time) {
  unsigned active = 0;
  bool is_known = true;
  for (const SwitchingTime& event : solution.switching_times) {
    if (event.time > time) break;
    for (const Index i : event.entering) active |= 1u << i;
    for (const Index i : event.leaving) active &= ~(1u << i);
    if (event.kind == SwitchingKind::kCoupledStepsBegin) is_known = false;
    if (event.kind == SwitchingKind::kCoupledStepsEnd) is_known = true;
  }
  return is_known ? std::optional<unsigned>(active) : std::nullopt;
}

Reference ReplayOf(const System& system, const Solution& solution, const std::vector<double>& times) {
  Replay replay;
  for (const SwitchingTime& event : solution.switching_times) {
    if (event.time > 0 && event.time < system.horizon && event.kind != SwitchingKind::kBreakPoint)
      replay.decisions.push_back(event.time);
  }
  std::vector<double> ends = replay.decisions;
  for (const SmoothInterval& interval : SmoothIntervals(system)) ends.push_back(ToDouble(interval.end));
  std::sort(ends.begin(), ends.end());
  replay.probe_time = [&solution, &system, ends](double time) {
    auto end = std::upper_bound(ends.begin(), ends.end(), time + 1e-13 * system.horizon);
    const double until = end == ends.end() ? system.horizon : *end;
    const auto node = std::lower_bound(solution.times.begin(), solution.times.end(), time + 0.1 * (until - time));
    return node == solution.times.end() ? solution.times.back() : *node;
  };
  replay.reported = [&solution](double time) {
    constexpr double kSameTime = 4e-16;
    return ReportedActive(solution, time * (1 + kSameTime));
  };
  replay.choose = [&solution](double, double probe, const std::vector<Eigen::VectorXd>& states) {
    const Index column = ColumnAt(solution, probe);
    const Eigen::VectorXd size = solution.x.rowwise().lpNorm<Eigen::Infinity>();
    int best = -1;
    double least = std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < states.size(); ++k) {
      double distance = 0;
      for (Index i = 0; i < size.size(); ++i) {
        if (size(i) > 0) distance = std::max(distance, std::abs(states[k](i) - solution.x(i, column)) / size(i));
      }
      if (distance < least) {
        least = distance;
        best = static_cast<int>(k);
      }
    }
    return best;
  };
  return Refer(system, times, {}, &replay);
}

}  // namespace

const char* Name(Judgment judgment) {
  switch (judgment) {
    case Judgment::kRight:
      return "right";
    case Judgment::kWrong:
      return "WRONG";
    case Judgment::kRefusedWithNeed:
      return "refused with need";
    case Judgment::kRefused:
      return "REFUSED";
    case Judgment::kNotJudged:
      return "not judged";
  }
  return "";
}

std::vector<double> ComparisonTimes(const System& system) {
  std::vector<double> times;
  for (int k = 1; k <= 16; ++k) times.push_back(system.horizon * k / 16);
  for (int k = 1; k <= 6; ++k) times.push_back(system.horizon * std::pow(10.0, -k));
  std::sort(times.begin(), times.end());
  return times;
}

Reference ReferenceOf(const System& system) {
  constexpr size_t kMostEvents = 12;
  // Of the time of an event: nearer behind it what a shift by some ulps of that time explains is no error.
  constexpr double kBehind = 1.5e-4;
  if (system.several_solutions) return {};
  std::vector<double> times = ComparisonTimes(system);
  Reference reference = Refer(system, times);
  const std::vector<double>& events = reference.event_times;
  for (size_t part = 0; part < std::min(kMostEvents, events.size()); ++part) {
    const size_t k = part * events.size() / std::min(kMostEvents, events.size());
    const double end = k + 1 < events.size() ? events[k + 1] : reference.end;
    const double soon = events[k] * (1 + kBehind);
    for (const double time : {soon, events[k] + (end - events[k]) / 2}) {
      if (time >= soon && time < end) times.push_back(time);
    }
  }
  if (times.size() == reference.times.size()) return reference;
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return Refer(system, times);
}

absl::StatusOr<Solution> SolveFor(const System& system, const Options& options, double seconds) {
  Observer observer;
  const Deadline deadline(seconds);
  return Solve(ToProblem(system), options, observer, deadline.token());
}

std::vector<ComponentError> ErrorsOf(const System& system, const Solution& solution, const Reference& reference,
                                     double tolerance) {
  std::vector<ComponentError> errors;
  AddErrors(ComponentKind::kState, solution.x, solution, reference, reference.x, reference.size, tolerance, errors);
  const TrajectoryErrors& estimated = solution.accuracy.errors;
  if (estimated.y.size() > 0) {  // else nothing is said of y and w
    AddErrors(ComponentKind::kPair, solution.y, solution, reference, reference.y, reference.size_y, tolerance, errors);
    AddErrors(ComponentKind::kSlack, solution.w, solution, reference, reference.w, reference.size_w, tolerance, errors);
  }
  if (estimated.outputs.size() > 0) {
    auto evaluator = OutputEvaluator::Create(ToProblem(system));
    const Matrix outputs = evaluator->Columns(solution, 0, static_cast<Index>(solution.times.size()));
    AddErrors(ComponentKind::kOutput, outputs, solution, reference, reference.outputs, reference.size_outputs,
              tolerance, errors);
  }
  return errors;
}

Options OptionsFor(const Asked& asked, const std::vector<double>& times, bool times_only) {
  Options options;
  options.error_tolerance = asked.tolerance;
  options.num_steps = asked.steps;
  options.method = asked.method;
  options.output_times = times;
  options.output_times_only = times_only;
  options.num_threads = 1;
  return options;
}

Trial Try(const System& system, const Reference& reference, const Asked& asked, double seconds) {
  Trial trial;
  const std::vector<double> times = system.several_solutions ? ComparisonTimes(system) : reference.times;
  const Options options = OptionsFor(asked, times, !system.several_solutions);

  const auto begin = std::chrono::steady_clock::now();
  const absl::StatusOr<Solution> solved = SolveFor(system, options, seconds);
  trial.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!solved.ok()) {
    trial.verdict = std::string(solved.status().message());
    trial.judgment = Judgment::kRefused;
    return trial;
  }
  const Solution& solution = *solved;
  const Verdict verdict = JudgeSolution(solution);
  trial.verdict = std::string(MethodName(solution.method)) + ": " + verdict.text + ". " + solution.message;
  trial.figure = FigureOf(solution);
  const bool reached = solution.termination == Termination::kReachedEnd;
  trial.reached_end = reached;
  trial.is_good_verdict = verdict.kind == VerdictKind::kSolved;

  if (system.several_solutions) {
    if (!reached) return trial;  // there may be none
    const Reference replayed = ReplayOf(system, solution, times);
    if (replayed.status == Reference::Status::kGivenUp) return trial;
    CompareAll(system, solution, replayed, asked.error(), trial);
    if (*trial.error <= asked.error() && replayed.status == Reference::Status::kReached) {
      trial.judgment = Judgment::kRight;
    } else if (trial.is_good_verdict && solution.method == Method::kEventDriven) {
      trial.judgment = Judgment::kWrong;
      trial.verdict += " [replayed to " + std::to_string(replayed.end) + " " + replayed.reason + "]";
    }
    return trial;
  }

  if (reference.status == Reference::Status::kGivenUp) return trial;
  CompareAll(system, solution, reference, asked.error(), trial);
  if (reference.status == Reference::Status::kNoMode) {
    const bool ends_there = !reached && std::abs(solution.failure_time - reference.end) <= 1e-3 * system.horizon;
    trial.judgment = ends_there ? Judgment::kRight : Judgment::kNotJudged;
    return trial;
  }
  if (asked.steps > 0 && reached) {
    trial.judgment = trial.figure && *trial.figure < *trial.error / 10 ? Judgment::kWrong : Judgment::kRight;
  } else if (trial.is_good_verdict) {
    trial.judgment = *trial.error <= asked.error() ? Judgment::kRight : Judgment::kWrong;
  } else {
    trial.judgment = Judgment::kRefused;
  }
  if (trial.judgment != Judgment::kRight) {
    ReferenceLimits limits;
    limits.seconds = 5;
    trial.condition = Condition(system, times, reference, asked.error(), limits);
    if (trial.judgment == Judgment::kRefused && *trial.condition > asked.error())
      trial.judgment = Judgment::kRefusedWithNeed;
    if (trial.judgment == Judgment::kWrong && RoundingOf(reference) > *trial.error)
      trial.judgment = Judgment::kNotJudged;
  }
  return trial;
}

}  // namespace dlcs::hostile
