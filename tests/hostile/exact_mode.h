// SPDX-License-Identifier: Apache-2.0
// One mode of a system: which w and which y are zero, and the linear equation that x and the sources together satisfy
// in it.

#ifndef DLCS_TESTS_HOSTILE_EXACT_MODE_H_
#define DLCS_TESTS_HOSTILE_EXACT_MODE_H_

#include <memory>
#include <optional>
#include <vector>

#include "tests/hostile/double_double_exp.h"
#include "tests/hostile/system.h"

namespace dlcs::hostile {

// The system on stretches of one regime, z = (x; s):  x' = A z + B y,  s' = W s,  w = N z + M y. Pairs are scaled by
// powers of two, rows and columns of M each on their own, which changes no x.
struct RegimeSystem {
  RegimeSystem(const System& system, const SmoothInterval& interval);

  int num_states = 0, num_pairs = 0, size = 0;
  DenseMatrix A;                  // m × size
  DenseMatrix B;                  // m × n
  DenseMatrix N;                  // n × size
  DenseMatrix M;                  // n × n
  DenseMatrix W;                  // sources × sources
  std::vector<double> unit_of_y;  // y of the system = unit * y here
  std::vector<double> unit_of_w;
};

class Mode {
 public:
  // Bit i of `active`: w_i = 0 and y_i may be positive. Null if y is not determined by the constraints and their
  // first derivatives.
  static std::shared_ptr<Mode> Create(const RegimeSystem& regime, unsigned active, double horizon);

  unsigned active() const { return active_; }
  bool IsActive(int i) const { return (active_ >> i & 1u) != 0; }
  // Row i is what must stay nonnegative: y_i where active, else w_i.
  const DenseMatrix& signs() const { return signs_; }
  const DenseMatrix& y() const { return y_; }
  // The rows that are zero while the mode lasts, in addition to those that define y.
  const std::vector<Column>& invariants() const { return invariants_; }
  const DenseMatrix& derivative() const { return derivative_; }
  bool has_least_element() const { return has_least_element_; }

  // z after `time` >= 0, at most the horizon.
  Column After(const Column& z, Real time);
  // z after the time horizon 2^-level, level >= 0.
  Column After(const Column& z, int level);
  // From this level on the exponential is a short series.
  int series_level() const { return series_level_; }

 private:
  Mode() = default;
  // exp(horizon 2^-level of the derivative) - I. Each doubling of an exponential doubles its error in parts that hardly
  // change: some fifty of them beside a rate of 1e14 would leave 17 digits of the slow parts.
  const DenseMatrix& Change(int level);
  Column SeriesAfter(const Column& z, Real time) const;

  unsigned active_ = 0;
  double horizon_ = 0;
  DenseMatrix derivative_, y_, signs_;
  std::vector<Column> invariants_;
  bool has_least_element_ = false;
  int series_level_ = 0;
  std::vector<std::optional<DenseMatrix>> changes_;
};

}  // namespace dlcs::hostile

#endif  // DLCS_TESTS_HOSTILE_EXACT_MODE_H_
