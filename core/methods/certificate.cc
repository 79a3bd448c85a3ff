// SPDX-License-Identifier: Apache-2.0

#include "core/methods/certificate.h"

#include "core/linalg/norms.h"
#include "core/linalg/pair_norms.h"

namespace dlcs {
namespace {

void AddTerm(const Matrix& coefficient, const Eigen::Ref<const Matrix>& values, Matrix& sum) {
  if (coefficient.size() > 0) sum.noalias() += coefficient * values;
}

}  // namespace

CertificateBuilder::CertificateBuilder(const Problem& problem) : problem_(problem) {}

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
  c.node_residual = NanMax(c.node_residual, norms.residual);
  c.node_complementarity = NanMax(c.node_complementarity, norms.complementarity);
  c.lcp_scale = NanMax(c.lcp_scale, norms.size);
}

void CertificateBuilder::AddMidpoints(const Eigen::Ref<const Matrix>& y, const Eigen::Ref<const Matrix>& w,
                                      double ode_defect) {
  BeginAtZero();
  Certificate& c = certificate_;
  const PairNorms norms = MeasurePairs(y, w);
  c.midpoint_residual = NanMax(c.midpoint_residual, norms.residual);
  c.midpoint_complementarity = NanMax(c.midpoint_complementarity, norms.complementarity);
  c.ode_defect = NanMax(c.ode_defect, ode_defect);
}

void CertificateBuilder::AddStates(const Eigen::Ref<const Matrix>& x, const Eigen::Ref<const Matrix>& slope) {
  BeginAtZero();
  certificate_.x_scale = NanMax(certificate_.x_scale, MaxAbs(x));
  certificate_.ode_scale = NanMax(certificate_.ode_scale, MaxAbs(slope));
}

void CertificateBuilder::Add(const Segment& segment, const Eigen::Ref<const Matrix>& w, const Scheme& scheme,
                             Index begin, Index end) {
  const Index steps = end - begin;
  if (steps == 0) return;
  const auto x = segment.x.middleCols(begin, steps + 1);
  const auto y = segment.y.middleCols(begin, steps + 1);
  const auto f = segment.f.middleCols(begin, steps + 1);
  const auto f_mid = segment.f_mid.middleCols(begin, steps);

  const Index first = begin > 0 || segment.first_y_is_solution ? 0 : 1;
  const Index nodes = steps + 1 - first;
  AddNodes(y.rightCols(nodes), w.rightCols(nodes));

  Matrix slope = f;
  slope.noalias() += problem_.A * x;
  slope.noalias() += problem_.B * y;
  AddStates(x, slope);

  Matrix y_mid = y.rightCols(steps);
  if (scheme.y_is_linear) y_mid = (y_mid + y.leftCols(steps)) / 2;
  Matrix x_mid, defect;
  if (scheme.x_is_linear) {
    x_mid = (x.leftCols(steps) + x.rightCols(steps)) / 2;
    defect = (x.rightCols(steps) - x.leftCols(steps)) / segment.step - f_mid;
    defect.noalias() -= problem_.A * x_mid;
    defect.noalias() -= problem_.B * y_mid;
  } else {
    x_mid.noalias() = scheme.mid_state * x.leftCols(steps);
    AddTerm(scheme.mid_y_before, y.leftCols(steps), x_mid);
    AddTerm(scheme.mid_y_after, y.rightCols(steps), x_mid);
    AddTerm(scheme.mid_f_before, f.leftCols(steps), x_mid);
    AddTerm(scheme.mid_f_after, f.rightCols(steps), x_mid);
    // x solves the differential equation with the interpolated f: what is left is the interpolation.
    defect = (f.leftCols(steps) + f.rightCols(steps)) / 2 - f_mid;
  }
  Matrix w_mid = segment.g_mid.middleCols(begin, steps);
  w_mid.noalias() += problem_.N * x_mid;
  w_mid.noalias() += problem_.M * y_mid;
  AddMidpoints(y_mid, w_mid, MaxAbs(defect));
}

}  // namespace dlcs
