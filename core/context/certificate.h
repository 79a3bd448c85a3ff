// SPDX-License-Identifier: Apache-2.0
// Measures how well a trajectory satisfies the system, segment by segment.

#ifndef DLCS_CORE_CONTEXT_CERTIFICATE_H_
#define DLCS_CORE_CONTEXT_CERTIFICATE_H_

#include "core/discretization/scheme.h"
#include "core/discretization/segment.h"
#include "core/linalg/pair_norms.h"
#include "core/parallel/team.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

// The running maxima behind Certificate::node_residual_of_rows and drift_of_rows, for each pair and each state. Empty
// until a step was added.
struct CertificateRows {
  Vector x_size, y_size, w_size, f_size, g_size;
  Vector node_residual, midpoint_residual;  // relative to these sizes
  Vector drift, largest_drift;              // of E x
  Vector x_largest, y_largest, w_largest;   // |x_i|, |y_i| and |w_i| at all nodes that were added
};

class CertificateBuilder {
 public:
  // `team`: the processes that hold the rows, if `problem` holds those of this one; then they call the same functions.
  // Sums over pairs are those of all, maxima those of this process.
  explicit CertificateBuilder(const Problem& problem, Team& team = Team::Alone());

  // Adds the nodes and midpoints of the steps [begin, end) of `segment`, whose states follow `scheme`; the columns of
  // `w`, computed from x and y and not by the method itself, are the nodes begin..end. Updates the maxima of rows too.
  // Cost: a few products of m × m, m × n and n × n matrices with as many columns as steps.
  void Add(const Segment& segment, const Eigen::Ref<const Matrix>& w, const Scheme& scheme, Index begin, Index end);

  // The parts of Add(), for smooth intervals whose states are not kept: y and w at nodes; y, w and the interpolation
  // error of f at midpoints; a state with its slope A x + B y + f.
  void AddNodes(const Eigen::Ref<const Matrix>& y, const Eigen::Ref<const Matrix>& w);
  void AddMidpoints(const Eigen::Ref<const Matrix>& y, const Eigen::Ref<const Matrix>& w, double ode_defect);
  void AddStates(const Eigen::Ref<const Matrix>& x, const Eigen::Ref<const Matrix>& slope);

  // Sets the certificate, for a method that measures it itself.
  void Replace(const Certificate& certificate) { certificate_ = certificate; }

  // NaN throughout until a step was added.
  const Certificate& certificate() const { return certificate_; }
  bool empty() const { return empty_; }
  const CertificateRows& rows() const { return rows_; }
  // Continues the certificate of the earlier steps.
  void ResumeFrom(const Certificate& certificate, const CertificateRows& rows) {
    certificate_ = certificate;
    rows_ = rows;
    empty_ = false;
  }

 private:
  void BeginAtZero();
  // Raises the sizes to those of the columns. A y that is constant on steps moves x inside them, so what it moves in a
  // step of length `constant_for` counts as a term of x, which may be 0 at the nodes; 0 where y is linear.
  void RaiseSizes(const Eigen::Ref<const Matrix>& x, const Eigen::Ref<const Matrix>& y,
                  const Eigen::Ref<const Matrix>& f, const Eigen::Ref<const Matrix>& g, double constant_for);
  void AddDrift(const Matrix& increments, double step);

  // max |Σ_i y_i w_i| over the columns, of all pairs.
  double LargestSum(const Eigen::Ref<const Matrix>& y, const Eigen::Ref<const Matrix>& w, const PairNorms& norms);

  const Problem& problem_;
  Team& team_;
  Certificate certificate_;
  CertificateRows rows_;
  bool empty_ = true;
};

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_CERTIFICATE_H_
