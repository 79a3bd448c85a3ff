// SPDX-License-Identifier: Apache-2.0

#include "core/context/certificate.h"

#include <cmath>
#include <limits>

#include "core/context/component_errors.h"
#include "core/linalg/bounded_sum.h"
#include "core/linalg/norms.h"

namespace dlcs {
namespace {

void AddTerm(const Matrix& coefficient, const Eigen::Ref<const Matrix>& values, Matrix& sum) {
  if (coefficient.size() > 0) sum.noalias() += coefficient * values;
}

// Raises each residual of a row to the largest |min(y / y_size, w / w_size)| over the columns, which hold no NaN.
void RaiseRowResiduals(const Eigen::Ref<const Matrix>& y, const Eigen::Ref<const Matrix>& w,
                       const CertificateRows& rows, Vector& residual) {
  const auto inverse = [](double size) {
    return size >= std::numeric_limits<double>::min() ? 1 / size : size >= 0 ? 0 : size;
  };
  const Vector of_y = rows.y_size.unaryExpr(inverse), of_w = rows.w_size.unaryExpr(inverse);
  for (Index j = 0; j < y.cols(); ++j) {
    const double *const y_j = y.col(j).data(), *const w_j = w.col(j).data();
    for (Index i = 0; i < y.rows(); ++i) {
      const double a = y_j[i] * of_y[i], b = w_j[i] * of_w[i];
      const double less = std::abs(a < b ? a : b);
      residual[i] = less > residual[i] ? less : residual[i];
    }
  }
}

// Raises `sizes` to the largest |entry| of each row. It may miss a NaN; other measures see it.
void RaiseRowSizes(const Eigen::Ref<const Matrix>& matrix, Vector& sizes) {
  for (Index j = 0; j < matrix.cols(); ++j) {
    const double* const column = matrix.col(j).data();
    for (Index i = 0; i < matrix.rows(); ++i) {
      const double size = std::abs(column[i]);
      sizes[i] = size > sizes[i] ? size : sizes[i];
    }
  }
}

// How far a y of this size moves each x_i in a step.
Vector MovedByY(const Problem& problem, const Vector& y_size, double step) {
  const Vector memory = MemoryOf(problem, step);
  return memory.array().isFinite().select(memory, step).cwiseProduct(problem.B.AbsTimes(y_size));
}

double LargestOf(const Vector& values) { return values.size() > 0 ? values.maxCoeff<Eigen::PropagateNaN>() : 0; }

}  // namespace

CertificateBuilder::CertificateBuilder(const Problem& problem, Team& team) : problem_(problem), team_(team) {}

double CertificateBuilder::LargestSum(const Eigen::Ref<const Matrix>& y, const Eigen::Ref<const Matrix>& w,
                                      const PairNorms& norms) {
  if (team_.is_alone()) return norms.complementarity;
  double largest = 0;
  for (Index j = 0; j < y.cols(); ++j) largest = NanMax(largest, std::abs(team_.Sum(y.col(j).dot(w.col(j)))));
  return largest;
}

void CertificateBuilder::BeginAtZero() {
  if (!empty_) return;
  Certificate& c = certificate_;
  c.node_residual = c.midpoint_residual = c.node_complementarity = c.midpoint_complementarity = 0;
  c.ode_defect = c.lcp_scale = c.ode_scale = c.x_scale = 0;
  empty_ = false;
}

void CertificateBuilder::AddNodes(const Eigen::Ref<const Matrix>& y, const Eigen::Ref<const Matrix>& w) {
  BeginAtZero();
  Certificate& c = certificate_;
  const PairNorms norms = MeasurePairs(y, w);
  if (rows_.y_largest.size() == 0) rows_.y_largest = rows_.w_largest = Vector::Zero(y.rows());
  RaiseRowSizes(y, rows_.y_largest);
  RaiseRowSizes(w, rows_.w_largest);
  c.node_residual = NanMax(c.node_residual, norms.residual);
  c.node_complementarity = NanMax(c.node_complementarity, LargestSum(y, w, norms));
  c.lcp_scale = NanMax(c.lcp_scale, norms.size);
}

void CertificateBuilder::AddMidpoints(const Eigen::Ref<const Matrix>& y, const Eigen::Ref<const Matrix>& w,
                                      double ode_defect) {
  BeginAtZero();
  Certificate& c = certificate_;
  const PairNorms norms = MeasurePairs(y, w);
  c.midpoint_residual = NanMax(c.midpoint_residual, norms.residual);
  c.midpoint_complementarity = NanMax(c.midpoint_complementarity, LargestSum(y, w, norms));
  c.ode_defect = NanMax(c.ode_defect, ode_defect);
}

void CertificateBuilder::AddStates(const Eigen::Ref<const Matrix>& x, const Eigen::Ref<const Matrix>& slope) {
  BeginAtZero();
  if (rows_.x_largest.size() == 0) rows_.x_largest = Vector::Zero(x.rows());
  RaiseRowSizes(x, rows_.x_largest);
  certificate_.x_scale = NanMax(certificate_.x_scale, MaxAbs(x));
  certificate_.ode_scale = NanMax(certificate_.ode_scale, MaxAbs(slope));
}

void CertificateBuilder::RaiseSizes(const Eigen::Ref<const Matrix>& x, const Eigen::Ref<const Matrix>& y,
                                    const Eigen::Ref<const Matrix>& f, const Eigen::Ref<const Matrix>& g,
                                    double constant_for) {
  CertificateRows& rows = rows_;
  if (rows.x_size.size() == 0) {
    const Index m = x.rows(), n = y.rows();
    for (Vector* of_states : {&rows.x_size, &rows.f_size, &rows.drift, &rows.largest_drift}) of_states->setZero(m);
    for (Vector* of_pairs : {&rows.y_size, &rows.w_size, &rows.g_size, &rows.node_residual, &rows.midpoint_residual})
      of_pairs->setZero(n);
  }
  const Vector y_before = rows.y_size, w_before = rows.w_size;
  RaiseRowSizes(x, rows.x_size);
  RaiseRowSizes(y, rows.y_size);
  RaiseRowSizes(f, rows.f_size);
  RaiseRowSizes(g, rows.g_size);
  Vector x_terms = rows.x_size;
  if (constant_for > 0) x_terms += MovedByY(problem_, rows.y_size, constant_for);
  const Vector w_terms = problem_.N.AbsTimes(x_terms) + problem_.M.AbsTimes(rows.y_size) + rows.g_size;
  for (Index i = 0; i < w_terms.size(); ++i) rows.w_size[i] = NanMax(rows.w_size[i], w_terms[i]);
  // The sizes have grown, so earlier residuals shrink by at least the smaller change of the two quotients.
  for (Index i = 0; i < rows.y_size.size(); ++i) {
    if (!(rows.node_residual[i] > 0 || rows.midpoint_residual[i] > 0)) continue;
    const double of_y = rows.y_size[i] > 0 ? y_before[i] / rows.y_size[i] : 1;
    const double of_w = rows.w_size[i] > 0 ? w_before[i] / rows.w_size[i] : 1;
    rows.node_residual[i] *= NanMax(of_y, of_w);
    rows.midpoint_residual[i] *= NanMax(of_y, of_w);
  }
}

void CertificateBuilder::AddDrift(const Matrix& increments, double step) {
  CertificateRows& rows = rows_;
  const Vector slope = problem_.A.AbsTimes(rows.x_size) + problem_.B.AbsTimes(rows.y_size) + rows.f_size;
  const Vector size = problem_.has_mass() ? problem_.E.AbsTimes(rows.x_size) : rows.x_size;
  // 0 for the rows that steps of this length do not resolve.
  const Vector counted = (2 * step * slope.array() > size.array()).select(0, Vector::Ones(slope.size()));
  for (Index j = 0; j < increments.cols(); ++j) {
    rows.drift += counted.cwiseProduct(increments.col(j));
    RaiseRowMaxAbs(rows.drift, rows.largest_drift);
  }
  Certificate& c = certificate_;
  c.drift_of_rows = 0;
  for (Index i = 0; i < rows.drift.size(); ++i) {
    if (size[i] != 0) c.drift_of_rows = NanMax(c.drift_of_rows, rows.largest_drift[i] / size[i]);
  }
}

void CertificateBuilder::Add(const Segment& segment, const Eigen::Ref<const Matrix>& w, const Scheme& scheme,
                             Index begin, Index end) {
  const Index steps = end - begin;
  if (steps == 0) return;
  const double step = segment.step;
  const auto x = segment.x.middleCols(begin, steps + 1);
  const auto y = segment.y.middleCols(begin, steps + 1);
  const auto f = segment.f.middleCols(begin, steps + 1);
  const auto f_mid = segment.f_mid.middleCols(begin, steps);

  const Index first = begin > 0 || segment.first_y_is_solution ? 0 : 1;
  const Index nodes = steps + 1 - first;
  RaiseSizes(x, y, f, segment.g.middleCols(begin, steps + 1), scheme.y_is_linear ? 0 : step);
  AddNodes(y.rightCols(nodes), w.rightCols(nodes));
  RaiseRowResiduals(y.rightCols(nodes), w.rightCols(nodes), rows_, rows_.node_residual);

  Matrix slope = problem_.A * x;
  const Matrix By = problem_.B * y;
  Matrix slope_mid = f_mid;
  Matrix x_mid;
  if (scheme.x_is_linear) {
    x_mid = (x.leftCols(steps) + x.rightCols(steps)) / 2;
    slope_mid += (slope.leftCols(steps) + slope.rightCols(steps)) / 2;
  } else {
    x_mid.noalias() = scheme.mid_state * x.leftCols(steps);
    AddTerm(scheme.mid_y_before, y.leftCols(steps), x_mid);
    AddTerm(scheme.mid_y_after, y.rightCols(steps), x_mid);
    AddTerm(scheme.mid_f_before, f.leftCols(steps), x_mid);
    AddTerm(scheme.mid_f_after, f.rightCols(steps), x_mid);
    slope_mid.noalias() += problem_.A * x_mid;
  }
  Matrix y_mid = y.rightCols(steps);
  if (scheme.y_is_linear) {
    y_mid = (y_mid + y.leftCols(steps)) / 2;
    slope_mid += (By.leftCols(steps) + By.rightCols(steps)) / 2;
  } else {
    slope_mid += By.rightCols(steps);
  }
  slope += f + By;
  AddStates(x, slope);

  const Matrix change = problem_.MassTimes(x.rightCols(steps) - x.leftCols(steps));
  // If x solves the differential equation with the interpolated f exactly, the defect is the error of the
  // interpolation.
  const double defect = scheme.x_is_linear ? MaxAbs(change / step - slope_mid)
                                           : MaxAbs((f.leftCols(steps) + f.rightCols(steps)) / 2 - f_mid);
  // By Simpson's rule.
  Matrix increments = change - step / 6 * (slope.leftCols(steps) + 4 * slope_mid + slope.rightCols(steps));
  if (!scheme.y_is_linear) increments += step / 6 * (By.leftCols(steps) - By.rightCols(steps));  // y is that of the end
  AddDrift(increments, step);

  Matrix w_mid = segment.g_mid.middleCols(begin, steps);
  w_mid.noalias() += problem_.N * x_mid;
  w_mid.noalias() += problem_.M * y_mid;
  AddMidpoints(y_mid, w_mid, defect);
  RaiseRowResiduals(y_mid, w_mid, rows_, rows_.midpoint_residual);
  Certificate& c = certificate_;
  // node_residual and midpoint_residual are NaN if a pair was.
  c.node_residual_of_rows = std::isnan(c.node_residual) ? c.node_residual : LargestOf(rows_.node_residual);
  c.midpoint_residual_of_rows =
      std::isnan(c.midpoint_residual) ? c.midpoint_residual : LargestOf(rows_.midpoint_residual);
  const Vector beyond_rounding = (rows_.node_residual.array() - RoundingOf(kOperationsOfSum)).cwiseMax(0);
  c.w_missed = beyond_rounding.cwiseProduct(rows_.w_size);
}

}  // namespace dlcs
