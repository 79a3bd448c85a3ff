// SPDX-License-Identifier: Apache-2.0

#include "core/event_driven/sampled_errors.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>

#include "core/linalg/abs_times.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"
#include "core/linalg/weyl_sequence.h"

namespace dlcs {
namespace {

// The integral of what an interpolant misses is smaller than that is, since it has the signs of a polynomial of high
// degree. PlainSystems feels 4 times as much.
constexpr double kOfMissed = 0.25;

// The signs of `error`, and those of `otherwise` where it is zero.
Vector SignsLike(const Eigen::Ref<const Vector>& error, Vector otherwise) {
  for (Index i = 0; i < error.size(); ++i) {
    if (error[i] != 0) otherwise[i] = std::copysign(1, error[i]);
  }
  return otherwise;
}

// The signs with which errors of the given sizes add most to what lasts longest of `error`; `otherwise` in rows that do
// not add to it.
Vector SignsThatLast(const Eigen::VectorXcd& slowest, const Vector& sizes, const Eigen::Ref<const Vector>& error,
                     Vector otherwise) {
  const std::complex<double> lasts = slowest.cwiseProduct(error).sum();
  const Eigen::VectorXcd turned = lasts == 0.0 ? slowest : Eigen::VectorXcd(std::conj(lasts) * slowest);
  const Vector parts = turned.real().cwiseProduct(sizes);
  for (Index i = 0; i < parts.size(); ++i) {
    if (parts[i] != 0) otherwise[i] = std::copysign(1, parts[i]);
  }
  return otherwise;
}

// With which of the signs 1 and -1 `added` enlarges `errors`, both relative to `size`.
double SignTowards(const Eigen::Ref<const Vector>& errors, const Eigen::Ref<const Vector>& added, const Vector& size) {
  double sum = 0;
  for (Index i = 0; i < size.size(); ++i) {
    const double unit = std::max(size[i], std::numeric_limits<double>::min());
    sum += errors[i] / unit * (added[i] / unit);
  }
  return sum < 0 ? -1 : 1;
}

// The tails of a step with the signs of the last coefficients.
Vector TailWithSigns(const LegendreSeries& x, const Vector& tail) {
  return tail.binaryExpr(Vector(x.rightCols<1>()), [](double size, double last) { return std::copysign(size, last); });
}

}  // namespace

double PartOfTail(double s) {
  constexpr double K = kLegendreDegree;
  return std::min(1.0, (1 - s) * (2 * K + 1) / 2 * std::sqrt(std::numbers::pi * K / 2));
}

SampledErrors::SampledErrors(const Vector& x0)
    : values_(Matrix::Zero(x0.size(), kCount)), signs_(x0.size(), 2), of_data_(x0.size(), kOfRounding) {
  for (Index e = 0; e < kOfRounding; ++e) {
    const Vector signs = SignsOfRounding(x0.size(), static_cast<unsigned>(e));
    values_.col(e) = kUlp * signs.cwiseProduct(x0);
    if (e < signs_.cols()) signs_.col(e) = signs;
    of_data_.col(e) = PartsOfRounding(x0.size(), static_cast<unsigned>(e));
  }
}

Vector SampledErrors::Signs(Index error, const Eigen::Ref<const Vector>& values) const {
  if (error == 1) return signs_.col(1);
  if (error == 2) return SignsOfRounding(values.size(), 2 + steps_);
  return SignsLike(values, signs_.col(0));
}

Matrix SampledErrors::InRows(const SmoothStep& step, const OverlookedByCause& overlooked, double& sign) const {
  const Mode& mode = step.stepper->mode();
  const auto in_rows = [&mode](const Vector& slope) { return mode.is_explicit() ? slope : AbsTimes(mode.E, slope); };
  const Matrix errors = mode.is_explicit() ? values_ : Matrix(mode.E * values_);
  const Vector overlooked_by_rounding = in_rows(overlooked.rounding.slope);
  Matrix rows(errors.rows(), kCount);
  for (Index e = 0; e < kOfRounding; ++e) {
    // What an ulp of the data is stays the same. For the last sample it has the signs that add to it: a system with
    // slow and fast states forgets most errors, and signs at hand may all be of that kind.
    const auto error = errors.col(e);
    Vector of_data = of_data_.col(e);
    if (e + 1 == kOfRounding)
      of_data = SignsThatLast(mode.slowest, step.row_error.rounding, error, SignsLike(error, std::move(of_data)));
    rows.col(e) = of_data.cwiseProduct(step.row_error.rounding) + Signs(e, error).cwiseProduct(overlooked_by_rounding);
  }
  const Vector missed = kOfMissed * step.row_error.truncation + in_rows(overlooked.truncation.slope);
  rows.col(kTruncation) = Signs(kTruncation, errors.col(kTruncation)).cwiseProduct(missed);
  const Vector& slope = overlooked.with_signs.slope;
  rows.col(kWithSigns) = kOfMissed * step.row_error.with_signs + (mode.is_explicit() ? slope : Vector(mode.E * slope));
  sign = SignTowards(errors.col(kWithSigns), rows.col(kWithSigns), step.row_error.rounding);
  rows.col(kWithSigns) *= sign;
  return rows;
}

void SampledErrors::Propagate(const SmoothStep& step, const OverlookedByCause& overlooked, double s_end) {
  const Mode& mode = step.stepper->mode();
  double sign = 1;
  Become(step.stepper->RespondAt(s_end, values_, InRows(step, overlooked, sign)), step);
  if (s_end == 1) {
    const Vector left = ValueOf(step.left, LegendreValues(1));
    for (Index e = 0; e < kOfRounding; ++e) {
      values_.col(e) += SignTowards(values_.col(e), left, values_.col(e).cwiseAbs()) * left;
    }
  }
  const Vector rounding = kUlp * step.x_size;
  for (Index e = 0; e < kOfRounding; ++e) {
    const Vector stored =
        SignsOfRounding(rounding.size(), kCount * steps_ + static_cast<unsigned>(e)).cwiseProduct(rounding);
    values_.col(e) += stored;
    if (!mode.is_explicit()) slopes_.col(e) += mode.dynamics * stored;
    AddTo(e, overlooked.rounding.x);
  }
  // At its end a step is far better than inside of it, where an event cuts it.
  const Vector tail = PartOfTail(s_end) * step.x_tail;
  AddTo(kTruncation, overlooked.truncation.x + tail);
  values_.col(kWithSigns) += sign * (overlooked.with_signs.x + TailWithSigns(step.x, tail));
}

SampledErrors SampledErrors::Inside(const SmoothStep& step, double s) const {
  SampledErrors inside = *this;
  inside.Become(step.stepper->Respond(values_, Matrix(), LegendreValues(s)), step);
  return inside;
}

void SampledErrors::Become(ModeStepper::Response response, const SmoothStep& step) {
  values_ = std::move(response.values);
  slopes_ = std::move(response.slopes);
  // In the triangular form they have the rounding of others.
  for (const Index i : step.unreached) {
    values_.row(i).setZero();
    slopes_.row(i).setZero();
  }
}

void SampledErrors::AddRounding(const Vector& amount) {
  for (Index e = 0; e < kOfRounding; ++e) AddTo(e, amount);
}

void SampledErrors::AddTruncation(const Vector& amount) {
  for (const Index e : {kTruncation, kWithSigns}) AddTo(e, amount);
}

void SampledErrors::AddRoundingOfOneSign(const Vector& change, const Vector& size) {
  values_.col(0) += SignTowards(values_.col(0), change, size) * change;
  values_.col(1) += change;
  values_.col(2) += SignsOfRounding(1, steps_)[0] * change;
}

Matrix SampledErrors::In(const LinearOutput& output) const {
  Matrix errors = output.state * values_;
  if (output.slope.size() > 0) errors += output.slope * slopes_;
  return errors;
}

double SampledErrors::In(const LinearOutput& output, Index row, Index error) const {
  double of_row = output.state.row(row).dot(values_.col(error));
  if (output.slope.size() > 0) of_row += output.slope.row(row).dot(slopes_.col(error));
  return of_row;
}

SignedErrorBounds SampledErrors::SizesOf(const Matrix& errors) {
  SignedErrorBounds sizes;
  sizes.truncation = errors.col(kTruncation).cwiseAbs();
  sizes.with_signs = errors.col(kWithSigns).cwiseAbs();
  sizes.rounding = RowMaxAbs(errors.leftCols(kOfRounding));
  return sizes;
}

}  // namespace dlcs
