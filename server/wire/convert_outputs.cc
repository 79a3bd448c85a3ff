// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "fmt/format.h"
#include "proto/wire/matrix_shape.h"
#include "server/wire/convert.h"

namespace dlcs {
namespace {

// C or D. Its declared shape is checked before anything of that size is allocated.
StructuredMatrix FactorsFromProto(const v1::Matrix* matrix, Index rows, Index columns, const std::string& field,
                                  std::vector<Violation>& violations, const FormulaParameters& parameters) {
  if (matrix == nullptr) return SparseMatrix(rows, columns);
  const WireShape shape = ShapeOf(*matrix);
  if (shape.rows != rows || shape.columns != columns) {
    violations.push_back({field, fmt::format("{} x {}; must be {} x {}, a row for each name", shape.rows, shape.columns,
                                             rows, columns)});
    return {};
  }
  return StructuredMatrixFromProto(*matrix, field, violations, &parameters);
}

CrossingDirection DirectionFromProto(v1::CrossingDirection direction, const std::string& field,
                                     std::vector<Violation>& violations) {
  switch (direction) {
    case v1::CROSSING_DIRECTION_UNSPECIFIED:
      return CrossingDirection::kEither;
    case v1::CROSSING_DIRECTION_RISING:
      return CrossingDirection::kRising;
    case v1::CROSSING_DIRECTION_FALLING:
      return CrossingDirection::kFalling;
    default:
      break;
  }
  violations.push_back({field, fmt::format("{}; this server does not know this direction (0 either, 1 rising, "
                                           "2 falling)",
                                           static_cast<int>(direction))});
  return CrossingDirection::kEither;
}

MeasurementInstant InstantFromProto(const v1::MeasurementInstant& instant, const std::string& field,
                                    std::vector<Violation>& violations) {
  MeasurementInstant result;
  if (instant.has_time()) result.time = instant.time();
  result.outputs.assign(instant.outputs().begin(), instant.outputs().end());
  result.level = instant.level();
  result.direction = DirectionFromProto(instant.direction(), field + ".direction", violations);
  result.number = instant.number() == 0 ? 1 : instant.number();
  result.after = instant.after();
  return result;
}

MeasurementKind KindFromProto(v1::MeasurementKind kind, const std::string& field, std::vector<Violation>& violations) {
  switch (kind) {
    case v1::MEASUREMENT_KIND_AVERAGE:
      return MeasurementKind::kAverage;
    case v1::MEASUREMENT_KIND_RMS:
      return MeasurementKind::kRms;
    case v1::MEASUREMENT_KIND_INTEGRAL:
      return MeasurementKind::kIntegral;
    case v1::MEASUREMENT_KIND_MINIMUM:
      return MeasurementKind::kMinimum;
    case v1::MEASUREMENT_KIND_MAXIMUM:
      return MeasurementKind::kMaximum;
    case v1::MEASUREMENT_KIND_PEAK_TO_PEAK:
      return MeasurementKind::kPeakToPeak;
    case v1::MEASUREMENT_KIND_VALUE:
      return MeasurementKind::kValue;
    case v1::MEASUREMENT_KIND_TIME:
      return MeasurementKind::kTime;
    case v1::MEASUREMENT_KIND_DELAY:
      return MeasurementKind::kDelay;
    case v1::MEASUREMENT_KIND_SLOPE:
      return MeasurementKind::kSlope;
    case v1::MEASUREMENT_KIND_FORMULA:
      return MeasurementKind::kFormula;
    default:
      break;
  }
  violations.push_back(
      {field, fmt::format("{}; must be a kind that this server knows (1 average, 2 rms, 3 integral, "
                          "4 minimum, 5 maximum, 6 peak to peak, 7 value, 8 time, 9 delay, 10 slope, 11 formula)",
                          static_cast<int>(kind))});
  return MeasurementKind::kAverage;
}

v1::CrossingDirection ToProto(CrossingDirection direction) {
  switch (direction) {
    case CrossingDirection::kEither:
      return v1::CROSSING_DIRECTION_UNSPECIFIED;
    case CrossingDirection::kRising:
      return v1::CROSSING_DIRECTION_RISING;
    case CrossingDirection::kFalling:
      return v1::CROSSING_DIRECTION_FALLING;
  }
  return v1::CROSSING_DIRECTION_UNSPECIFIED;
}

v1::MeasurementKind ToProto(MeasurementKind kind) {
  switch (kind) {
    case MeasurementKind::kAverage:
      return v1::MEASUREMENT_KIND_AVERAGE;
    case MeasurementKind::kRms:
      return v1::MEASUREMENT_KIND_RMS;
    case MeasurementKind::kIntegral:
      return v1::MEASUREMENT_KIND_INTEGRAL;
    case MeasurementKind::kMinimum:
      return v1::MEASUREMENT_KIND_MINIMUM;
    case MeasurementKind::kMaximum:
      return v1::MEASUREMENT_KIND_MAXIMUM;
    case MeasurementKind::kPeakToPeak:
      return v1::MEASUREMENT_KIND_PEAK_TO_PEAK;
    case MeasurementKind::kValue:
      return v1::MEASUREMENT_KIND_VALUE;
    case MeasurementKind::kTime:
      return v1::MEASUREMENT_KIND_TIME;
    case MeasurementKind::kDelay:
      return v1::MEASUREMENT_KIND_DELAY;
    case MeasurementKind::kSlope:
      return v1::MEASUREMENT_KIND_SLOPE;
    case MeasurementKind::kFormula:
      return v1::MEASUREMENT_KIND_FORMULA;
  }
  return v1::MEASUREMENT_KIND_UNSPECIFIED;
}

v1::MeasurementInstant ToProto(const MeasurementInstant& instant) {
  v1::MeasurementInstant result;
  if (instant.time) {
    result.set_time(*instant.time);
    return result;
  }
  result.mutable_outputs()->Add(instant.outputs.begin(), instant.outputs.end());
  result.set_level(instant.level);
  result.set_direction(ToProto(instant.direction));
  result.set_number(instant.number);
  result.set_after(instant.after);
  return result;
}

}  // namespace

Outputs OutputsFromProto(const v1::Outputs& outputs, Index m, Index n, std::vector<Violation>& violations,
                         const FormulaParameters& parameters) {
  Outputs result;
  result.names.assign(outputs.names().begin(), outputs.names().end());
  const Index p = result.size();
  result.C = FactorsFromProto(outputs.has_c() ? &outputs.c() : nullptr, p, m, "outputs.C", violations, parameters);
  result.D = FactorsFromProto(outputs.has_d() ? &outputs.d() : nullptr, p, n, "outputs.D", violations, parameters);
  if (outputs.has_h()) {
    result.h = TimeFunctionFromProto(outputs.h(), p, "outputs.h", violations, parameters);
  } else if (p > 0) {
    result.h = TimeFunction::Zero(p);
  }
  result.hidden = outputs.hidden();
  for (const v1::OutputLimit& limit : outputs.limits()) result.limits.push_back({limit.output(), limit.value()});
  return result;
}

std::vector<Measurement> MeasurementsFromProto(const google::protobuf::RepeatedPtrField<v1::Measurement>& measurements,
                                               std::vector<Violation>& violations) {
  std::vector<Measurement> result;
  for (int k = 0; k < measurements.size(); ++k) {
    const v1::Measurement& one = measurements[k];
    const std::string field = fmt::format("measurements[{}]", k);
    Measurement& read = result.emplace_back();
    read.name = one.name();
    read.kind = KindFromProto(one.kind(), field + ".kind", violations);
    read.outputs.assign(one.outputs().begin(), one.outputs().end());
    read.begin = one.begin();
    if (one.has_end()) read.end = one.end();
    if (one.has_at()) read.at = InstantFromProto(one.at(), field + ".at", violations);
    if (one.has_until()) read.until = InstantFromProto(one.until(), field + ".until", violations);
    read.formula = one.formula();
  }
  return result;
}

v1::Outputs ToProto(const Outputs& outputs) {
  v1::Outputs result;
  result.mutable_names()->Add(outputs.names.begin(), outputs.names.end());
  *result.mutable_c() = ToProto(outputs.C);
  *result.mutable_d() = ToProto(outputs.D);
  *result.mutable_h() = ToProto(outputs.h);
  result.set_hidden(outputs.hidden);
  for (const OutputLimit& limit : outputs.limits) {
    v1::OutputLimit& out = *result.add_limits();
    out.set_output(limit.output);
    out.set_value(limit.value);
  }
  return result;
}

v1::Measurement ToProto(const Measurement& measurement) {
  v1::Measurement result;
  result.set_name(measurement.name);
  result.set_kind(ToProto(measurement.kind));
  result.mutable_outputs()->Add(measurement.outputs.begin(), measurement.outputs.end());
  result.set_begin(measurement.begin);
  if (measurement.end) result.set_end(*measurement.end);
  if (measurement.at) *result.mutable_at() = ToProto(*measurement.at);
  if (measurement.until) *result.mutable_until() = ToProto(*measurement.until);
  result.set_formula(measurement.formula);
  return result;
}

v1::MeasurementResult ToProto(const MeasurementResult& measured) {
  v1::MeasurementResult result;
  result.set_name(measured.name);
  if (measured.value) result.set_value(*measured.value);
  if (measured.time) result.set_time(*measured.time);
  result.set_reason(measured.reason);
  result.set_note(measured.note);
  return result;
}

}  // namespace dlcs
