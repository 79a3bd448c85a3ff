// SPDX-License-Identifier: Apache-2.0
// What the error of a component is compared with, and when it is small enough: one definition for all methods.
//
// Of each component c (state, y_i, w_i, output) three figures are known, over [0, T]: `own`, its largest absolute
// value; `truncation`, every error that a better computation would avoid; `rounding`, what an ulp of every term and of
// every stored value makes of it, with the growth by the system. a is its absolute tolerance, if one is given, and R
// the size that it stands beside. c is accepted if it is one of
//
//     known        truncation + rounding <= tolerance · own;
//     given        truncation + rounding <= a;
//     negligible   truncation <= r, own <= tolerance · R and r <= tolerance · R, where no a is given;
//     zero         own <= r, truncation <= r and r <= tolerance · R.
//
// Here r is twice the rounding, which is known from samples that may be small by chance. So truncation is held to the
// component's own size, and only rounding is looked at beside others. A component without R has R = own.
//
// What accepts c in another solve (Advice), whose steps are longer. Steps are shortened until truncation is at most the
// rounding or what is allowed without it, and no further; where that was not reached, truncation stays what it is.
// Other steps round otherwise: up to twice the rounding, as far as is known of its samples. So errors of up to
//
//     2 rounding + max(truncation, 2 rounding)
//
// must be allowed, by tolerance · own or by a. Where truncation <= r and no a is given, c is accepted too where
// tolerance · R is at least own and 2 r. Of 219 random systems that missed a tolerance of 1e-3 to 1e-13, 214
// were solved with the tolerance that this gives; with the error itself three in five are.
//
// R of the states of a mode x' = Ã x + b. The blocks are the strongly connected components of the graph of Ã. In a
// block let G_ij = |Ã_ij| / (|Ã_ii| + 1/T), and d > 0 such that row and column sums of diag(1/d) G diag(d) agree, off
// the diagonal. Then R_c = d_c max_k own_k / d_k, over the block: states that act back on each other have sizes that
// can be compared in the units d, whatever their own units. A state that only feeds or only receives has R = own. Where
// every state of a block is rounding (own_k <= 2 rounding_k), own_k is replaced by what enters,
//
//     (Σ_{j outside} |Ã_kj| R_j + β_k) / (1/T + Σ_{j inside} |Ã_kj| d_j / d_k),    β: the terms of b.
//
// For an output or a pair o = Σ O_oj x_j + ..., R_o = Σ |O_oj| R_j; terms of sources count only where o is rounding. Of
// several modes the largest R counts.

#ifndef DLCS_CORE_CONTEXT_SIZES_H_
#define DLCS_CORE_CONTEXT_SIZES_H_

#include <array>
#include <functional>
#include <iterator>
#include <optional>
#include <vector>

#include "core/linalg/sparse/row_writer.h"
#include "core/problem/accuracy.h"
#include "core/problem/options.h"
#include "core/types.h"

namespace dlcs {

// Whether component i is no larger than its rounding, of which samples are known.
bool IsRounding(const ErrorsByCause& errors, Index i);

// The sizes R of the components of one kind. `beside` is the component whose size decides it, maybe itself; absent
// where sources do.
struct SizesBeside {
  Vector size;
  std::vector<std::optional<Component>> beside;

  // Takes the larger of both.
  void RaiseTo(const SizesBeside& other);
};

// R = own for all components of a kind.
SizesBeside OwnSizes(const ErrorsByCause& errors, ComponentKind kind);

// R of the states for a mode with the matrix `dynamics`, whose structural zeros are exact, on [0, `horizon`]. `sources`
// are the sizes β of the terms of the sources. Cost: some passes over the nonzeros.
SizesBeside StatesBeside(const RowMajorMatrix& dynamics, const Vector& sources, double horizon,
                         const ErrorsByCause& states);

// R of linear functions `rows` x + sources, for the components of a kind with these `errors`. `of_sources` are the
// sizes of the terms of their sources.
SizesBeside RowsBeside(const RowMajorMatrix& rows, const SizesBeside& states, ComponentKind kind,
                       const ErrorsByCause& errors, const Vector& of_sources);

// R of all components. Kinds whose errors are not estimated may be empty.
struct AllSizesBeside {
  std::array<SizesBeside, std::size(kComponentKinds)> kinds;

  SizesBeside& of(ComponentKind kind) { return kinds[static_cast<std::size_t>(kind)]; }
  void RaiseTo(const AllSizesBeside& other);
};

// By how much the truncation of the worst component is more than steps have to see to: max(tolerance · own - rounding,
// a - rounding, rounding). Below the rounding shorter steps only add to it.
double ExcessOfTruncation(const TrajectoryErrors& errors, const Options& options, double tolerance);

// The absolute tolerance of a component; absent where none is given.
std::optional<double> AbsoluteToleranceOf(const Options& options, const Component& component);
// Of the first n components of one kind, 0 where none is given: errors of y and w are not always estimated.
Vector AbsoluteTolerances(const Options& options, ComponentKind kind, Index n);

// Applies the definition to `accuracy`, whose errors by cause and tolerance are set: sets `named`, `error` and
// `advice`. With a tolerance of 0 (given steps) only states and outputs are missed of which not even the first digit is
// known, and zeros are those of the default tolerance. y and w may be short pulses, which few steps resolve. `sizes` is
// called where a component is neither known nor given.
void JudgeComponents(const Options& options, const std::function<AllSizesBeside()>& sizes, Accuracy& accuracy);

}  // namespace dlcs

#endif  // DLCS_CORE_CONTEXT_SIZES_H_
