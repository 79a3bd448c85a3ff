// SPDX-License-Identifier: Apache-2.0
// The interface of propagators, which compute N x from x0, f and y without the states in between.

#ifndef DLCS_CORE_PROPAGATOR_PROPAGATOR_H_
#define DLCS_CORE_PROPAGATOR_PROPAGATOR_H_

#include <functional>
#include <memory>
#include <stop_token>
#include <vector>

#include "core/discretization/grid.h"
#include "core/parallel/parallel.h"
#include "core/problem/problem.h"
#include "core/problem/solution.h"

namespace dlcs {

// What y is between two nodes: linear (exp-PL), or constant and equal to y_j on (t_{j-1}, t_j] (exp-PC).
enum class Hold { kLinear, kConstant };

// The effect of y at the nodes so far on N x at later nodes. One object per solve.
class ConvolutionHistory {
 public:
  virtual ~ConvolutionHistory() = default;

  // q = the response at the next node to all y pushed so far, without that of the next y itself (that is K_0 y).
  virtual void Next(Eigen::Ref<Vector> q) = 0;
  // The same at the next `steps` nodes, as if every later y were zero. n × steps.
  virtual Matrix History(Index steps) = 0;
  // The y of the next node.
  virtual void Push(const Eigen::Ref<const Vector>& y) = 0;
};

// The motion with y = 0.
struct FreeMotion {
  Matrix nodes;    // N x at the nodes 0..J, n × J + 1
  Matrix middles;  // at the midpoints of the steps, n × J; empty if `modes` holds them
  // For a Kronecker sum, in mode coordinates: the response to y is added before both are transformed to N x together.
  struct Modes {
    Matrix inputs;          // û of sources that act as y does, at the nodes 0..J: p × J + 1, empty if there are none
    Matrix nodes, middles;  // ẑ of all other terms at the nodes 1..J and the midpoints: p × J
  } modes;
};

// N x at the nodes 1..W and at the midpoints of the steps: n × W each.
struct Motion {
  Matrix nodes, middles;
};

// Takes the columns [begin, end) of a matrix that is computed block by block: each column once, on any thread.
using OnColumns = std::function<void(Index begin, Index end)>;
// Columns per block: they stay in the second cache, and windows of a few hundred steps are work for many threads.
constexpr Index kColumnsPerBlock = 32;

// Work space of a response, reused by the next one.
struct ResponseScratch {
  Matrix inputs, outputs;
};

// The response of N x to y on steps of one length: the blocks K_0, K_1, ... of core/laplace/kernel.h in whatever form
// is cheapest. Immutable: many solves may share one.
class ReducedKernel {
 public:
  virtual ~ReducedKernel() = default;

  virtual double step() const = 0;
  // n × n: the effect of y_j on N x_j.
  virtual const Matrix& K0() const = 0;
  // A history that holds y_0, the value at the start (not used with Hold::kConstant).
  virtual std::unique_ptr<ConvolutionHistory> Start(const Eigen::Ref<const Vector>& y0) const = 0;
  // r_j = Σ_{l=1..j} K_{j-l} y_l for j = 1..W, from y_1 ... y_W (n × W); same bits for any number of threads.
  virtual Matrix Respond(const Matrix& y, Workers& workers) const = 0;
  // q = `base` + r. `scratch` is reused from call to call. Blocks of columns of q are given to `computed` while they
  // are in the cache.
  virtual void AddResponse(const Eigen::Ref<const Matrix>& base, const Eigen::Ref<const Matrix>& y, Workers& workers,
                           ResponseScratch& scratch, Eigen::Ref<Matrix> q, const OnColumns& computed) const;
  // The response at the midpoints of the steps 1..W to y_0 ... y_W (n × W + 1), from a zero state: n × W.
  virtual Matrix RespondAtMiddles(const Matrix& y, Workers& workers) const = 0;
  // The whole motion under y_0 ... y_W (n × W + 1), W <= J: the sum of `free` and the response to y at nodes and
  // midpoints, computed independently of earlier responses.
  virtual Motion MoveThroughout(FreeMotion free, const Eigen::Ref<const Matrix>& y, Workers& workers) const;
  // max ‖K_k‖_∞ / h over k < `window`, or an upper bound of it.
  virtual double Bound(Index window) const = 0;
};

// Sources at the nodes 0..J of a run, linear between them: columns of ψ, where f = lift ψ, or of f itself.
struct RunSources {
  double step = 0;
  Matrix psi;
};

// The linear system in a form whose cost grows slower than m².
class Propagator {
 public:
  virtual ~Propagator() = default;

  // The kernel for steps of this length, cached for the next call. If the kernel consists of blocks, they are made for
  // windows up to `longest_window`. Null if `stop` was requested.
  virtual std::shared_ptr<const ReducedKernel> MakeKernel(double step, Hold hold, Index longest_window,
                                                          Workers& workers, const std::stop_token& stop) = 0;
  // The free motion from `x`, the state at the start of the run, for a later y of kind `hold`. If `stop` is requested
  // it may end early; the result must not be used then.
  virtual FreeMotion Move(const Vector& x, const RunSources& sources, Hold hold, Workers& workers,
                          const std::stop_token& stop) = 0;
  // The states at `nodes` (increasing, in 1..J) from the state `x` at node 0, the sources, and y_0 ... y_J: m × nodes.
  virtual Matrix States(const Vector& x, const RunSources& sources, const Matrix& y, Hold hold,
                        const std::vector<Index>& nodes, Workers& workers, const std::stop_token& stop) = 0;
  // The bytes that it will keep for a solve on `grid`; 0 if negligible.
  virtual double PredictBytes(const Grid&) const { return 0; }
  // The record of the work so far.
  virtual PropagatorRecord record() const = 0;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_PROPAGATOR_H_
