// SPDX-License-Identifier: Apache-2.0
#include "core/outputs/measure_outputs.h"

#include <algorithm>
#include <boost/math/quadrature/gauss.hpp>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "core/context/limit_watch.h"
#include "core/format_number.h"
#include "core/outputs/monotone_parts.h"
#include "core/outputs/output_curves.h"
#include "core/parallel/stop_scope.h"
#include "core/problem/formula.h"

namespace dlcs {
namespace {

std::vector<Index> OutputsOf(const Measurement& one) {
  std::vector<Index> outputs = one.outputs;
  for (const auto* instant : {&one.at, &one.until}) {
    if (*instant) outputs.insert(outputs.end(), (*instant)->outputs.begin(), (*instant)->outputs.end());
  }
  return outputs;
}

// Some limits and measurements of a problem, and the outputs that they need, once each.
struct MeterBatch {
  std::set<Index> outputs;
  std::vector<const OutputLimit*> limits;
  std::vector<std::size_t> measurements;
};

// So many outputs have curves of some 64 MB at most.
double MostAtOnce(const Solution& solution) {
  constexpr Index kBatchBytes = 64'000'000;
  const std::size_t pieces = std::max({solution.pieces.size(), solution.times.size(), std::size_t{1}});
  return static_cast<double>(kBatchBytes) / (static_cast<double>(pieces) * kLegendreSize * sizeof(double));
}

std::vector<MeterBatch> BatchesOf(const Problem& problem, const Solution& solution) {
  const double most = MostAtOnce(solution);
  std::vector<MeterBatch> batches(1);
  const auto add = [&](const std::vector<Index>& outputs) -> MeterBatch& {
    if (!batches.back().outputs.empty() && static_cast<double>(batches.back().outputs.size() + outputs.size()) > most) {
      batches.emplace_back();
    }
    batches.back().outputs.insert(outputs.begin(), outputs.end());
    return batches.back();
  };
  for (const OutputLimit& limit : problem.outputs.limits) add({limit.output}).limits.push_back(&limit);
  for (std::size_t k = 0; k < problem.measurements.size(); ++k) {
    if (problem.measurements[k].kind == MeasurementKind::kFormula) continue;
    add(OutputsOf(problem.measurements[k])).measurements.push_back(k);
  }
  return batches;
}

// What each output of a batch without measurements may reach before its limits matter; empty of others.
Vector LevelsOf(const MeterBatch& batch) {
  if (!batch.measurements.empty()) return {};
  Vector levels = Vector::Constant(static_cast<Index>(batch.outputs.size()), HUGE_VAL);
  for (const OutputLimit* limit : batch.limits) {
    const auto place = std::distance(batch.outputs.begin(), batch.outputs.find(limit->output));
    levels[place] = std::min(levels[place], kReachedLimit * limit->value);
  }
  return levels;
}

// What a measurement found, or why it found nothing.
struct Found {
  std::optional<double> value, time = {};
  std::string reason = {};
  std::string note = {};
};
Found None(std::string reason) { return {std::nullopt, std::nullopt, std::move(reason)}; }

// An extreme value and when.
struct Extreme {
  double value = 0;
  double time = 0;
};

class OutputMeter {
 public:
  OutputMeter(const Problem& problem, const Solution& solution, const std::optional<PeriodicExtension>& extension,
              std::vector<Index> rows, std::vector<CurvePiece> curves)
      : problem_(problem), extension_(extension), rows_(std::move(rows)), curves_(std::move(curves)) {
    reached_ = curves_.empty() ? 0 : curves_.back().end;
    has_polynomials_ = !solution.pieces.empty();
    ends_early_ = solution.termination != Termination::kReachedEnd;
  }

  Found Measure(const Measurement& one) const {
    std::vector<Index> outputs = one.outputs;
    if (one.at) outputs.insert(outputs.end(), one.at->outputs.begin(), one.at->outputs.end());
    if (one.until) outputs.insert(outputs.end(), one.until->outputs.begin(), one.until->outputs.end());
    if (std::string overflow = Overflow(outputs); !overflow.empty()) return None(std::move(overflow));
    if (extension_ && ends_early_) return None("no periodic solution was found.");
    switch (one.kind) {
      case MeasurementKind::kValue:
      case MeasurementKind::kSlope:
        return MeasureAt(one);
      case MeasurementKind::kTime: {
        const Found at = Find(*one.at);
        return {at.value, at.value, at.reason, at.note};
      }
      case MeasurementKind::kDelay: {
        const Found at = Find(*one.at), until = Find(*one.until);
        if (!at.value) return None("no begin: " + at.reason);
        if (!until.value) return None("no end: " + until.reason);
        if (extension_ && !extension_->has_clock && (one.at->time || one.until->time)) return None(NoClock());
        return {*until.value - *at.value, extension_ ? extension_->InPeriod(*at.value) : *at.value};
      }
      default:
        return MeasureWindow(one);
    }
  }

  // Adds to `reached` when |z| of the output first reaches the limit: when the polynomials do, or between which times.
  void Compare(const OutputLimit& limit, std::vector<std::string>& reached) const {
    const double level = kReachedLimit * limit.value;
    const std::vector<Index> outputs = {limit.output};
    for (const CurvePiece& piece : curves_) {
      LookForStop();
      if (piece.z.row(RowOf(limit.output)).cwiseAbs().sum() < level) continue;  // since no P_k exceeds 1
      const std::vector<Place> places = PlacesOf(outputs, piece);
      for (std::size_t k = 0; k < places.size(); ++k) {
        if (!ReachesLimit(places[k].value, limit)) continue;
        if (k == 0) return NoteReachedLimit(problem_, limit, piece.begin, piece.begin, reached);
        if (!has_polynomials_) return NoteReachedLimit(problem_, limit, piece.begin, piece.end, reached);
        const int side = places[k].value < 0 ? -1 : 1;
        const double time = TimeOfSide(outputs, side * level, side, places[k - 1], places[k]);
        return NoteReachedLimit(problem_, limit, time, time, reached);
      }
    }
  }

 private:
  // A place on a piece, and the quantity there.
  struct Place {
    const CurvePiece* piece;
    double s;
    double value;
  };

  // The value or the slope at an instant.
  Found MeasureAt(const Measurement& one) const {
    const Found at = Find(*one.at);
    if (!at.value) return at;
    if (extension_ && !extension_->has_clock && one.at->time) return None(NoClock());
    const double time = extension_ ? extension_->InPeriod(*at.value) : *at.value;
    const double value = one.kind == MeasurementKind::kValue ? ValueAt(one.outputs, time) : SlopeAt(one.outputs, time);
    return {value, time, "", at.note};
  }

  // What covers some time.
  Found MeasureWindow(const Measurement& one) const {
    const double end = one.end.value_or(problem_.horizon);
    if (curves_.empty() || (ends_early_ && end > reached_)) return None(EndsAt());
    ExtendedWindow window{.whole = 0, .parts = {{one.begin, end}}, .length = end - one.begin, .note = ""};
    if (extension_) {
      auto found = extension_->WindowOf(one);
      if (const auto* fault = std::get_if<std::string>(&found)) return None(*fault);
      window = std::get<ExtendedWindow>(std::move(found));
    }
    const auto integral = [&](int power) {
      double sum = window.whole > 0 ? window.whole * Integral(one.outputs, 0, reached_, power) : 0;
      for (const ExtendedWindow::Part& part : window.parts) sum += Integral(one.outputs, part.begin, part.end, power);
      return sum;
    };
    const auto largest = [&](double sign) {
      if (window.whole > 0) return Largest(one.outputs, 0, reached_, sign);
      Extreme extreme = Largest(one.outputs, window.parts.front().begin, window.parts.front().end, sign);
      for (const ExtendedWindow::Part& part : window.parts) {
        const Extreme other = Largest(one.outputs, part.begin, part.end, sign);
        if (other.value > extreme.value) extreme = other;
      }
      return extreme;
    };
    switch (one.kind) {
      case MeasurementKind::kAverage:
        return {integral(1) / window.length, {}, "", window.note};
      case MeasurementKind::kRms:
        return {std::sqrt(std::max(0.0, integral(2) / window.length)), {}, "", window.note};
      case MeasurementKind::kIntegral:
        return {integral(1), {}, "", window.note};
      case MeasurementKind::kMinimum: {
        const Extreme least = largest(-1);
        return {-least.value, least.time, "", window.note};
      }
      case MeasurementKind::kMaximum: {
        const Extreme most = largest(1);
        return {most.value, most.time, "", window.note};
      }
      default:  // kPeakToPeak
        return {largest(1).value + largest(-1).value, {}, "", window.note};
    }
  }

  std::string NoClock() const {
    return "a time means nothing in the period " + FormatNumber(extension_->period) +
           " of the oscillation, which may begin anywhere.";
  }

  Index RowOf(Index output) const { return std::lower_bound(rows_.begin(), rows_.end(), output) - rows_.begin(); }

  std::string NameOf(const std::vector<Index>& outputs) const {
    std::string name;
    for (const Index output : outputs) {
      name += (name.empty() ? "" : " * ") + problem_.outputs.names[static_cast<std::size_t>(output)];
    }
    return name;
  }

  // Where one of `outputs` is no number of double precision; empty if it is one everywhere.
  std::string Overflow(const std::vector<Index>& outputs) const {
    for (const CurvePiece& piece : curves_) {
      for (const Index output : outputs) {
        if (piece.z.row(RowOf(output)).allFinite()) continue;
        return NameOf({output}) + " is not finite from t = " + FormatNumber(piece.begin) + " on.";
      }
    }
    return "";
  }

  std::string EndsAt() const { return "the trajectory ends at t = " + FormatNumber(reached_) + "."; }

  double ValueIn(const std::vector<Index>& outputs, const CurvePiece& piece, double s) const {
    const LegendreVector at = LegendreValues(s);
    double product = 1;
    for (const Index output : outputs) product *= piece.z.row(RowOf(output)).dot(at);
    return product;
  }

  LegendreSeries FactorsOf(const std::vector<Index>& outputs, const CurvePiece& piece) const {
    LegendreSeries factors(static_cast<Index>(outputs.size()), kLegendreSize);
    for (Index k = 0; k < factors.rows(); ++k) {
      factors.row(k) = piece.z.row(RowOf(outputs[static_cast<std::size_t>(k)]));
    }
    return factors;
  }

  // Both ends of the piece, and places between them that cut it into parts on which the quantity is monotone
  // or lies below or above `range`.
  std::vector<Place> PlacesOf(const std::vector<Index>& outputs, const CurvePiece& piece, ValueRange range = {}) const {
    std::vector<Place> places;
    for (const double s : MonotoneParts(FactorsOf(outputs, piece), range)) {
      places.push_back({&piece, s, ValueIn(outputs, piece, s)});
    }
    return places;
  }

  // The first piece that ends after `time`, or the last.
  std::vector<CurvePiece>::const_iterator PieceAt(double time) const {
    const auto piece = std::upper_bound(curves_.begin(), curves_.end(), time,
                                        [](double t, const CurvePiece& one) { return t < one.end; });
    return piece == curves_.end() ? std::prev(piece) : piece;
  }

  double ValueAt(const std::vector<Index>& outputs, double time) const {
    const auto piece = PieceAt(time);
    return ValueIn(outputs, *piece, std::clamp(piece->s_of(time), -1.0, 1.0));
  }

  // By the product rule.
  double SlopeAt(const std::vector<Index>& outputs, double time) const {
    const auto piece = PieceAt(time);
    const double s = std::clamp(piece->s_of(time), -1.0, 1.0);
    const LegendreVector at = LegendreValues(s), slope_at = LegendreSlopes(at);
    double slope = 0;
    for (std::size_t k = 0; k < outputs.size(); ++k) {
      double term = piece->z.row(RowOf(outputs[k])).dot(slope_at) * 2 / (piece->end - piece->begin);
      for (std::size_t other = 0; other < outputs.size(); ++other) {
        if (other != k) term *= piece->z.row(RowOf(outputs[other])).dot(at);
      }
      slope += term;
    }
    return slope;
  }

  // ∫ q^power over [begin, end]; exact for the square of the product of two polynomials.
  double Integral(const std::vector<Index>& outputs, double begin, double end, int power) const {
    using Rule = boost::math::quadrature::gauss<double, 25>;
    double integral = 0;
    for (auto piece = PieceAt(begin); piece != curves_.end() && piece->begin < end; ++piece) {
      LookForStop();
      const double from = std::max(begin, piece->begin), to = std::min(end, piece->end);
      if (!(to > from)) continue;
      const double half = (to - from) / 2, middle = from + half;
      double sum = 0;
      for (std::size_t k = 0; k < Rule::abscissa().size(); ++k) {
        for (const double sign : {-1.0, 1.0}) {
          if (k == 0 && sign > 0) continue;  // the middle, once
          const double s = std::clamp(piece->s_of(middle + sign * half * Rule::abscissa()[k]), -1.0, 1.0);
          const double value = ValueIn(outputs, *piece, s);
          sum += Rule::weights()[k] * (power == 2 ? value * value : value);
        }
      }
      integral += half * sum;
    }
    return integral;
  }

  // The largest value of sign · q on [begin, end].
  Extreme Largest(const std::vector<Index>& outputs, double begin, double end, double sign) const {
    Extreme largest{-HUGE_VAL, begin};
    for (auto piece = PieceAt(begin); piece != curves_.end() && piece->begin < end; ++piece) {
      LookForStop();
      const double from = std::clamp(piece->s_of(begin), -1.0, 1.0), to = std::clamp(piece->s_of(end), from, 1.0);
      const ValueRange larger = sign > 0 ? ValueRange{.low = largest.value} : ValueRange{.high = -largest.value};
      for (const double place : MonotoneParts(FactorsOf(outputs, *piece), larger)) {
        const double s = std::clamp(place, from, to);
        const double value = sign * ValueIn(outputs, *piece, s);
        if (value > largest.value) largest = {value, piece->t_of(s)};
      }
    }
    return largest;
  }

  static std::string NoteOf(double phase) { return "at t = " + FormatNumber(phase) + " of the period"; }

  // The time of `instant` as its value.
  Found Find(const MeasurementInstant& instant) const {
    if (curves_.empty()) return None(EndsAt());
    if (instant.time) {
      if (ends_early_ && *instant.time > reached_) return None(EndsAt());
      const bool is_later = extension_ && *instant.time > extension_->period;
      return {*instant.time, {}, "", is_later ? NoteOf(extension_->InPeriod(*instant.time)) : ""};
    }
    const std::vector<double> times = Crossings(instant);
    const bool last = instant.number == MeasurementInstant::kLast;
    auto count = static_cast<int>(times.size());
    if (extension_ && count > 0) {
      const std::optional<double> time = extension_->CrossingOf(instant, times);
      if (time) return {*time, {}, "", *time < extension_->period ? "" : NoteOf(extension_->InPeriod(*time))};
      count = 0;
    } else if (last ? count > 0 : count >= instant.number) {
      return {last ? times.back() : times[static_cast<std::size_t>(instant.number - 1)]};
    }
    const char* direction = instant.direction == CrossingDirection::kRising    ? " upwards"
                            : instant.direction == CrossingDirection::kFalling ? " downwards"
                                                                               : "";
    const std::string from = instant.after > 0 ? " from t = " + NumberText(instant.after) + " on" : "";
    return None(NameOf(instant.outputs) + " crosses " + NumberText(instant.level) + direction + from +
                (count == 0 ? " at no time" : ", but only " + std::to_string(count) + " times") +
                (ends_early_ ? " up to the end of the trajectory at t = " + FormatNumber(reached_) : "") + ".");
  }

  // The first crossings in the direction of `instant`, as many as it needs; of a period all. Between two places the
  // quantity is monotone or on one side of the level, so the sides of the places show every crossing.
  std::vector<double> Crossings(const MeasurementInstant& instant) const {
    double size = std::abs(instant.level);
    std::vector<Place> places;
    for (const CurvePiece& piece : curves_) {
      LookForStop();
      for (const Place& place : PlacesOf(instant.outputs, piece, {instant.level, instant.level})) {
        size = std::max(size, std::abs(place.value));
        places.push_back(place);
      }
    }
    const double band = kCurveAccuracy * size;  // rounding is no crossing
    // A period begins on the side on which it ends, so it is passed twice, and what happens the second time counts.
    const std::size_t once = places.size();
    if (extension_) {
      places.reserve(2 * once);
      std::copy_n(places.begin(), once, std::back_inserter(places));
    }
    std::vector<double> times;
    int side = 0;             // of the last place outside of the band
    std::size_t outside = 0;  // that place
    for (std::size_t k = 0; k < places.size(); ++k) {
      const double above = places[k].value - instant.level;
      if (std::abs(above) <= band) continue;
      const int now = above > 0 ? 1 : -1;
      const bool counts = instant.direction == CrossingDirection::kEither ||
                          now == (instant.direction == CrossingDirection::kRising ? 1 : -1);
      if (side != 0 && now != side && counts && !(extension_ && k < once)) {
        std::size_t reached = outside + 1;
        while (now * (places[reached].value - instant.level) < 0) ++reached;
        const double time = reached == once
                                ? places[reached].piece->begin  // from the end of a period to the next one
                                : TimeOfSide(instant.outputs, instant.level, now, places[reached - 1], places[reached]);
        if (extension_ || time >= instant.after) times.push_back(time);
        if (!extension_ && static_cast<int>(times.size()) == instant.number) return times;
      }
      side = now;
      outside = k;
    }
    std::sort(times.begin(), times.end());
    return times;
  }

  // The time when the quantity first reaches the side `now` of the level: not at the place `before`, but at the next
  // one, `after`.
  double TimeOfSide(const std::vector<Index>& outputs, double level, int now, const Place& before,
                    const Place& after) const {
    if (before.piece != after.piece) return after.piece->begin;  // a jump
    double from = before.s, to = after.s;
    for (int i = 0; i < 60; ++i) {
      const double middle = (from + to) / 2;
      if (middle == from || middle == to) break;
      (now * (ValueIn(outputs, *after.piece, middle) - level) < 0 ? from : to) = middle;
    }
    return after.piece->t_of(to);
  }

  const Problem& problem_;
  const std::optional<PeriodicExtension>& extension_;
  std::vector<Index> rows_;  // the outputs that the rows of the curves are
  std::vector<CurvePiece> curves_;
  double reached_ = 0;
  bool ends_early_ = false;
  bool has_polynomials_ = false;
};

// Formulas, of the results before them.
void EvaluateFormulas(const std::vector<Measurement>& measurements, std::vector<MeasurementResult>& results) {
  FormulaVariables known;
  for (std::size_t k = 0; k < results.size(); ++k) {
    MeasurementResult& result = results[k];
    if (measurements[k].kind == MeasurementKind::kFormula) {
      auto formula = Formula::Parse(measurements[k].formula, known);
      result.reason = formula.ok() ? "the value is not finite."
                                   : "a measurement that the formula takes has no value (" +
                                         std::string(formula.status().message()) + ").";
      const double value = formula.ok() ? formula->Evaluate(0) : std::nan("");
      if (std::isfinite(value)) result = {result.name, value, {}, ""};
    }
    if (result.value) known.parameters[result.name] = *result.value;
  }
}

}  // namespace

bool HasMeasurements(const Problem& problem) {
  return !problem.measurements.empty() || !problem.outputs.limits.empty();
}

absl::Status MeasureOutputs(const Problem& problem, bool has_all_nodes, Solution& solution,
                            const std::optional<PeriodicExtension>& extension) {
  if (!HasMeasurements(problem)) return absl::OkStatus();
  for (const Measurement& one : problem.measurements) {
    solution.measurements.push_back({one.name, {}, {}, "the solve was stopped before it was measured."});
  }
  try {
    for (const MeterBatch& batch : BatchesOf(problem, solution)) {
      if (batch.outputs.empty()) continue;
      std::vector<Index> outputs(batch.outputs.begin(), batch.outputs.end());
      auto curves = OutputCurves(problem, solution, outputs, LevelsOf(batch));
      if (!curves.ok()) return curves.status();
      const OutputMeter meter(problem, solution, extension, std::move(outputs), *std::move(curves));
      for (const OutputLimit* limit : batch.limits) {
        meter.Compare(*limit, solution.reached_limits);
      }
      for (const std::size_t k : batch.measurements) {
        if (solution.pieces.empty() && !has_all_nodes) {
          if (solution.method == Method::kEventDriven) continue;  // it has pieces, if it has come to a step
          solution.measurements[k].reason = std::string("with ") + MethodName(solution.method) +
                                            " the nodes are measured, and the trajectory has the output times alone: "
                                            "ask for no output times, or for event-driven.";
          continue;
        }
        Found found = meter.Measure(problem.measurements[k]);
        MeasurementResult& result = solution.measurements[k];
        if (found.value && !std::isfinite(*found.value)) found = None("the value is not finite.");
        result = {result.name, found.value, found.time, found.reason, found.note};
      }
    }
    EvaluateFormulas(problem.measurements, solution.measurements);
  } catch (const Stopped&) {
  }
  return absl::OkStatus();
}

absl::StatusOr<Vector> MeanOutputs(const Problem& problem, const Solution& solution) {
  const Index shown = problem.outputs.shown();
  const auto most = static_cast<Index>(std::clamp(MostAtOnce(solution), 1.0, static_cast<double>(shown)));
  Vector means = Vector::Zero(shown);
  try {
    for (Index first = 0; first < shown; first += most) {
      std::vector<Index> outputs;
      for (Index k = first; k < std::min(shown, first + most); ++k) outputs.push_back(k);
      const auto curves = OutputCurves(problem, solution, outputs);
      if (!curves.ok()) return curves.status();
      auto sums = means.segment(first, static_cast<Index>(outputs.size()));
      double length = 0;
      for (const CurvePiece& piece : *curves) {
        sums += (piece.end - piece.begin) * piece.z.col(0);
        length += piece.end - piece.begin;
      }
      if (!(length > 0)) return Vector();
      sums /= length;
    }
  } catch (const Stopped&) {
    return Vector();
  }
  return means;
}

}  // namespace dlcs
