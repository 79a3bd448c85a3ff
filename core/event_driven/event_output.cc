// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/event_output.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"

namespace dlcs {

EventOutput::EventOutput(const Problem& problem, const Grid& grid, bool keeps_pieces)
    : problem_(problem),
      grid_(grid),
      keeps_pieces_(keeps_pieces),
      num_nodes_(static_cast<Index>(grid.times.size())),
      at_nodes_{Vector::Zero(problem.num_constraints()), Vector::Zero(problem.num_constraints())},
      between_nodes_(at_nodes_),
      defect_(Vector::Zero(problem.num_states())),
      terms_(defect_),
      w_size_(Vector::Zero(problem.num_constraints())),
      slope_size_(Vector::Zero(problem.num_states())) {
  segment_.x.resize(problem.num_states(), num_nodes_);
  segment_.y.resize(problem.num_constraints(), num_nodes_);
  w_.resize(problem.num_constraints(), num_nodes_);
  Certificate& c = certificate_;
  c.node_residual = c.midpoint_residual = c.node_complementarity = c.midpoint_complementarity = 0;
  c.ode_defect = c.lcp_scale = c.ode_scale = c.x_scale = 0;
}

void EventOutput::AddSmooth(const Vector& x_begin, const StepSources& sources, const SmoothStep& step,
                            const std::vector<Index>& active, double end, double s_end) {
  LegendreSeries w_series = step.guard.values;
  for (const Index i : active) w_series.row(i).setZero();
  RecordNodes(x_begin, sources, step, w_series, end, s_end);
  if (keeps_pieces_) pieces_.push_back({sources.begin, end, sources.length, step.x, step.y, std::move(w_series)});

  const LegendreVector at_end = LegendreValues(s_end);
  const Vector x = ValueOf(step.x, at_end);
  const Vector y = ValueOf(step.y, at_end);
  RaiseScale(x_begin);
  RaiseScale(x);
  const Vector y_begin = ValueOf(step.y, LegendreValues(-1));
  terms_ = terms_.cwiseMax(problem_.A.AbsTimes(x_begin.cwiseAbs()) + problem_.B.AbsTimes(y_begin.cwiseAbs()) +
                           sources.f.size);

  Measure(x, y, ValueOf(sources.g.values, at_end), active, at_nodes_, certificate_.node_complementarity);
  const LegendreVector at_check = LegendreValues(sources.check_s);
  const Vector x_check = ValueOf(step.x, at_check);
  const Vector y_check = ValueOf(step.y, at_check);
  Measure(x_check, y_check, sources.g.at_check, active, between_nodes_, certificate_.midpoint_complementarity);
  const Vector slope = problem_.A * x_check + problem_.B * y_check + sources.f.at_check;
  slope_size_ = slope_size_.cwiseMax(problem_.A.AbsTimes(x_check.cwiseAbs()) + problem_.B.AbsTimes(y_check.cwiseAbs()) +
                                     sources.f.at_check.cwiseAbs());
  // What is no more than the rounding of the polynomials and of the terms is no defect.
  const LegendreVector slope_at = 2 / sources.length * LegendreSlopes(at_check);
  const Vector rounding =
      RoundingOf(8) * (slope_at.cwiseAbs().sum() * SizeOfRows(step.x) + problem_.A.AbsTimes(x_check.cwiseAbs()) +
                       problem_.B.AbsTimes(y_check.cwiseAbs())) +
      sources.f.error.rounding;
  const Vector missed = (ValueOf(step.x, slope_at) - slope).cwiseAbs() - rounding;
  RaiseRowMaxAbs(missed.cwiseMax(0), defect_);
  certificate_.ode_scale = NanMax(certificate_.ode_scale, MaxAbs(slope));
}

// By blocks, so that the values of P_0 ... P_K are made side by side.
void EventOutput::RecordNodes(const Vector& x_begin, const StepSources& sources, const SmoothStep& step,
                              const LegendreSeries& w, double end, double s_end) {
  constexpr Index kBlock = 256;
  while (HasNodeBefore(end)) {
    places_.resize(kBlock);
    Index count = 0;
    for (; count < kBlock && next_node_ + count < num_nodes_ && grid_.times[next_node_ + count] < end; ++count) {
      const double t = grid_.times[next_node_ + count];
      places_[count] = t == sources.begin ? -1 : std::clamp(2 * (t - sources.begin) / sources.length - 1, -1.0, s_end);
    }
    LegendreValuesAt(places_.head(count), values_);
    const Index column = next_node_ - segment_.first_node;
    // Row by row, along the nodes.
    const auto record = [&](const LegendreSeries& series, auto&& nodes) {
      for (Index i = 0; i < series.rows(); ++i) {
        along_ = values_.lazyProduct(series.row(i).transpose());
        nodes.row(i) = along_.transpose();
      }
    };
    auto y = segment_.y.middleCols(column, count), w_of_nodes = w_.middleCols(column, count);
    record(step.x, segment_.x.middleCols(column, count));
    record(step.y, y);
    record(w, w_of_nodes);
    y = y.cwiseMax(0);
    w_of_nodes = w_of_nodes.cwiseMax(0);
    if (grid_.times[next_node_] == sources.begin) segment_.x.col(column) = x_begin;
    next_node_ += count;
  }
}

void EventOutput::AddCoupled(double begin, double end, const Vector& x_begin, const Vector& x_end, const Vector& y,
                             const Vector& w, const Vector& g) {
  while (HasNodeBefore(end)) {
    const double part = (grid_.times[next_node_] - begin) / (end - begin);
    Record((1 - part) * x_begin + part * x_end, y, w);
  }
  if (keeps_pieces_) {
    Matrix line(x_begin.size(), 2);
    line << (x_begin + x_end) / 2, (x_end - x_begin) / 2;
    pieces_.push_back({begin, end, end - begin, std::move(line), y, w});
  }
  std::vector<Index> active;
  for (Index i = 0; i < y.size(); ++i) {
    if (y[i] > 0) active.push_back(i);
  }
  Measure(x_end, y, g, active, at_nodes_, certificate_.node_complementarity);
  RaiseScale(x_begin);
  RaiseScale(x_end);
}

void EventOutput::RaiseScale(const Vector& x) { certificate_.x_scale = NanMax(certificate_.x_scale, MaxAbs(x)); }

EventOutput::SmoothInterval EventOutput::EndInterval(double end, const Vector& x, const Vector& y, const Vector& w) {
  const bool has_node = next_node_ < num_nodes_ && grid_.times[next_node_] == end;
  if (has_node) Record(x, y, w);
  SmoothInterval interval = Finish();
  if (has_node) --next_node_;  // it is the first node of the next smooth interval, too
  segment_.first_node = next_node_;
  return interval;
}

EventOutput::SmoothInterval EventOutput::Finish() {
  const Index nodes = next_node_ - segment_.first_node;
  SmoothInterval interval;
  Segment& segment = interval.segment;
  segment.first_node = segment_.first_node;
  segment.steps = nodes - 1;
  if (nodes == num_nodes_) {  // all of [0, T]: nothing follows
    segment.x = std::move(segment_.x);
    segment.y = std::move(segment_.y);
    interval.w = std::move(w_);
    return interval;
  }
  segment.x = segment_.x.leftCols(nodes);
  segment.y = segment_.y.leftCols(nodes);
  interval.w = w_.leftCols(nodes);
  return interval;
}

void EventOutput::Record(const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y,
                         const Eigen::Ref<const Vector>& w) {
  segment_.x.col(next_node_ - segment_.first_node) = x;
  segment_.y.col(next_node_ - segment_.first_node) = y;
  w_.col(next_node_ - segment_.first_node) = w;
  ++next_node_;
}

void EventOutput::Measure(const Eigen::Ref<const Vector>& x, const Eigen::Ref<const Vector>& y,
                          const Eigen::Ref<const Vector>& g, const std::vector<Index>& active, Misfit& misfit,
                          double& complementarity) {
  const Vector w = problem_.N * x + g + problem_.M * y;
  w_size_ = w_size_.cwiseMax(problem_.N.AbsTimes(x.cwiseAbs()) + g.cwiseAbs() + problem_.M.AbsTimes(y.cwiseAbs()));
  Vector of_w = (-w).cwiseMax(0);
  for (const Index i : active) of_w[i] = std::abs(w[i]);
  RaiseRowMaxAbs((-y).cwiseMax(0), misfit.y);
  RaiseRowMaxAbs(of_w, misfit.w);
  complementarity = NanMax(complementarity, std::abs(y.dot(w)));
  certificate_.lcp_scale = NanMax(certificate_.lcp_scale, NanMax(MaxAbs(y), MaxAbs(w)));
}

// The largest part of a row that an entry of the column is.
double EventOutput::PartIn(const Matrix& matrix, Index column, const Vector& size) const {
  double largest = 0;
  for (Index i = 0; i < size.size(); ++i) {
    if (size[i] > 0) largest = std::max(largest, std::abs(matrix(i, column)) / size[i]);
  }
  return largest;
}

double EventOutput::Relative(const Misfit& misfit) const {
  double largest = 0;
  for (Index i = 0; i < w_size_.size(); ++i) {
    if (misfit.w[i] != 0) largest = NanMax(largest, misfit.w[i] / w_size_[i]);
    if (misfit.y[i] == 0) continue;
    const double part = std::max(PartIn(problem_.M.Dense(), i, w_size_), PartIn(problem_.B.Dense(), i, slope_size_));
    largest = NanMax(largest, misfit.y[i] * part);
  }
  return largest;
}

Certificate EventOutput::certificate(const Vector& rounding) const {
  Certificate certificate = certificate_;
  certificate.node_residual_of_rows = Relative(at_nodes_);
  certificate.midpoint_residual_of_rows = Relative(between_nodes_);
  certificate.node_residual = certificate.node_residual_of_rows * certificate.lcp_scale;
  certificate.midpoint_residual = certificate.midpoint_residual_of_rows * certificate.lcp_scale;
  // An error e of that size is in A x, and by e' = A e in the slope of the polynomial.
  const Vector explained = 2 * problem_.A.AbsTimes(rounding);
  double defect = 0;
  for (Index i = 0; i < defect_.size(); ++i) {
    const double beyond = defect_[i] - explained[i];
    if (!(beyond <= 0)) defect = NanMax(defect, beyond / std::max(terms_[i], slope_size_[i]));
  }
  certificate.ode_defect = defect * certificate.ode_scale;
  return certificate;
}

}  // namespace dlcs
