// SPDX-License-Identifier: Apache-2.0
#include "core/circuits/solution_blocks.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/circuits/linear_network.h"
#include "core/lcp/basis/tolerance.h"
#include "core/lcp/dense/basic_solutions.h"
#include "core/linalg/decompositions.h"
#include "core/linalg/linear_program.h"
#include "core/linalg/strong_components.h"
#include "core/matrix_classes/matrix_class.h"

namespace dlcs {
namespace {

using Indices = std::vector<Index>;

// The most choices of clamps that are tried in one block, and the most solutions that are kept: 3^8.
constexpr std::size_t kMaxChoices = 6561;

// The most bases that are tried in all blocks together. They take a tenth of a second.
constexpr std::size_t kMaxBases = 16384;

// A part of y, and its basis.
struct PartSolution {
  Vector y;
  Basis basis;
  bool is_between = false;
};
struct PartSolutions {
  std::vector<PartSolution> all;
  bool is_decided = true;
  Index open_row = -1;
};

// One solution of LCP(q, M) that stands for the convex set of all. The result is undecided if M is not known to have a
// convex set, or if one of `rows` takes several values on it; that row is then the open one.
PartSolutions SolveMonotone(const Matrix& M, const MatrixClass& known, const Vector& q, const Vector& tolerance,
                            const Matrix& rows) {
  PartSolutions part;
  const Index n = q.size();
  if (n == 0) {
    part.all.push_back({Vector(0), {}});
    return part;
  }
  if (!known.p.yes() && !known.positive_semidefinite.yes()) return {{}, false, -1};
  PartSolution solution{Vector(n), Basis(AsSize(n), 0)};
  const auto solver = MakeLcpSolver(M, known.p.yes() ? Selection::kUnique : Selection::kLeastNorm);
  const LcpStatus verdict = solver->Solve(q, tolerance, solution.basis, solution.y);
  if (verdict == LcpStatus::kInfeasible) return part;
  if (verdict != LcpStatus::kSolved) return {{}, false, -1};
  if (!known.p.yes() && rows.rows() > 0) {
    if (const Index open = FirstOpenRow(M, q, rows, solution.y); open != -1)
      return {{}, false, std::max<Index>(open, -1)};
  }
  part.all.push_back(std::move(solution));
  return part;
}

// A matrix in units that make the largest entry of each row and column about 1, factored.
class EquilibratedLu {
 public:
  explicit EquilibratedLu(const Matrix& M) : row_(M.rows()), column_(M.cols()) {
    for (Index i = 0; i < M.rows(); ++i) row_[i] = Inverse(M.row(i).cwiseAbs().maxCoeff());
    Matrix scaled = row_.asDiagonal() * M;
    for (Index j = 0; j < M.cols(); ++j) column_[j] = Inverse(scaled.col(j).cwiseAbs().maxCoeff());
    factors_.setThreshold(kWorkingPrecision);
    factors_.compute(scaled * column_.asDiagonal());
  }
  bool is_regular() const { return factors_.isInvertible(); }
  Index rank() const { return factors_.rank(); }
  double determinant() const { return factors_.determinant(); }  // its sign is that of the matrix
  Matrix Solve(const Matrix& right) const {
    if (right.cols() == 0) return Matrix(column_.size(), 0);  // which FullPivLU does not look for
    return column_.asDiagonal() * factors_.solve(Matrix(row_.asDiagonal() * right));
  }

 private:
  static double Inverse(double size) { return size > 0 ? 1 / size : 1; }
  Vector row_, column_;
  Eigen::FullPivLU<Matrix> factors_;
};

// The sign of the determinant of M in a basis; 0 if it is singular.
int SignIn(const Matrix& M, const Basis& basis) {
  const Indices set = IndicesOf(basis);
  if (set.empty()) return 1;
  const EquilibratedLu factors(M(set, set));
  return !factors.is_regular() ? 0 : factors.determinant() < 0 ? -1 : 1;
}

// The signs of all solutions add up to the degree of the problem, which is the same for every q. A fold makes or
// removes two solutions, one of each sign. The one between two folds has the sign that is not that of the degree.
void MarkBetween(const Matrix& M, std::vector<PartSolution>& all) {
  if (all.size() < 2) return;
  std::vector<int> signs;
  int degree = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    signs.push_back(SignIn(M, all[k].basis));
    const bool is_new = std::none_of(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(k), [&](const auto& other) {
      return (other.y - all[k].y).cwiseAbs().maxCoeff() <= kSameResult * all[k].y.cwiseAbs().maxCoeff();
    });
    if (is_new) degree += signs.back();
  }
  for (std::size_t k = 0; k < all.size(); ++k) all[k].is_between = signs[k] * degree < 0;
}

// The solutions of one block of no class.
class ClampTrials {
 public:
  ClampTrials(const Matrix& M, const Vector& q, const Vector& tolerance, const Matrix& rows)
      : M_(M), q_(q), tolerance_(tolerance), rows_(rows) {}

  // What a diode of a clamp is: its place in the block, and whether it conducts where it is active.
  struct Bound {
    Index pair = -1;
    bool conducts_active = true;
  };
  void Add(std::optional<Bound> low, std::optional<Bound> high, bool is_gate) {
    Clamp clamp{{}, is_gate};
    if (low) clamp.bounds.push_back(*low);
    if (high) clamp.bounds.push_back(*high);
    if (!clamp.bounds.empty()) clamps_.push_back(std::move(clamp));
  }

  PartSolutions Run() {
    PartSolutions found;
    std::size_t choices = 1;
    for (const Clamp& clamp : clamps_) {
      if (choices > kMaxChoices) break;
      choices *= clamp.bounds.size() + 1;
    }
    if (clamps_.empty() || choices > kMaxChoices) return {{}, false, -1};
    bool is_half_open = false, is_any = false;  // a gate between 0 and 1 counts only where there is nothing else
    for (std::size_t choice = 0; choice < choices; ++choice) {
      PartSolutions tried = Try(choice);
      const bool has_half_gate = HasHalfGate(choice);
      if (!tried.is_decided && !has_half_gate) return tried;
      is_half_open = is_half_open || !tried.is_decided;
      is_any = is_any || (!has_half_gate && !tried.all.empty());
      for (PartSolution& one : tried.all) found.all.push_back(std::move(one));
    }
    found.is_decided = is_any || !is_half_open;
    return found;
  }

 private:
  struct Clamp {
    std::vector<Bound> bounds;
    bool is_gate = false;
  };

  bool HasHalfGate(std::size_t choice) const {
    for (const Clamp& clamp : clamps_) {
      if (clamp.is_gate && choice % (clamp.bounds.size() + 1) == clamp.bounds.size()) return true;
      choice /= clamp.bounds.size() + 1;
    }
    return false;
  }

  // Digit c of `choice` is the diode of clamp c that conducts; none if it is the number of its diodes.
  PartSolutions Try(std::size_t choice) {
    Indices active, middle, rest;
    std::vector<bool> is_decided(AsSize(q_.size()), false);
    for (const auto& [bounds, is_gate] : clamps_) {
      const std::size_t conducting = choice % (bounds.size() + 1);
      choice /= bounds.size() + 1;
      for (std::size_t k = 0; k < bounds.size(); ++k) {
        is_decided[AsSize(bounds[k].pair)] = true;
        if ((k == conducting) != bounds[k].conducts_active) continue;
        (conducting == bounds.size() ? middle : active).push_back(bounds[k].pair);
      }
    }
    for (Index i = 0; i < q_.size(); ++i) {
      if (!is_decided[AsSize(i)]) rest.push_back(i);
    }
    Indices eliminated = active;
    eliminated.insert(eliminated.end(), middle.begin(), middle.end());
    if (const auto tried = Eliminate(eliminated, rest)) return *tried;
    // In the middle only the other pairs determine a voltage: it is solved with them.
    rest.insert(rest.end(), middle.begin(), middle.end());
    if (middle.empty()) return {{}, false, -1};
    const auto tried = Eliminate(active, rest);
    return tried ? *tried : PartSolutions{{}, false, -1};
  }

  // Solves with w = 0 in `active`, an LCP in `rest`, and y = 0 elsewhere. Returns nothing if M is singular in `active`.
  std::optional<PartSolutions> Eliminate(const Indices& active, const Indices& rest) {
    Matrix M = M_(rest, rest), rows = rows_(Eigen::all, rest), of_rest(AsIndex(active), AsIndex(rest));
    Vector q = q_(rest), constant(AsIndex(active));
    Vector tolerance = tolerance_(rest);
    if (!active.empty()) {
      const EquilibratedLu factors(M_(active, active));
      if (!factors.is_regular()) return std::nullopt;
      of_rest = -factors.Solve(M_(active, rest));
      constant = -factors.Solve(Matrix(q_(active)));
      const Matrix to_rest = M_(rest, active);
      tolerance += kLcpTolerance *
                   (to_rest.cwiseAbs() * (constant.cwiseAbs() + factors.Solve(Matrix(tolerance_(active))).cwiseAbs()));
      M += to_rest * of_rest;
      q += to_rest * constant;
      rows += rows_(Eigen::all, active) * of_rest;
    }
    const MatrixClass known = rest.empty() ? MatrixClass() : Classify(M);
    PartSolutions part = SolveMonotone(M, known, q, tolerance, rows);
    std::vector<PartSolution> kept;
    for (const PartSolution& one : part.all) {
      PartSolution whole{Vector::Zero(q_.size()), Basis(AsSize(q_.size()), 0)};
      whole.y(rest) = one.y;
      if (!active.empty()) whole.y(active) = constant + of_rest * one.y;
      for (std::size_t k = 0; k < rest.size(); ++k) whole.basis[AsSize(rest[k])] = one.basis[k];
      for (const Index i : active) whole.basis[AsSize(i)] = 1;
      if (IsSolution(whole)) kept.push_back(std::move(whole));
    }
    part.all = std::move(kept);
    return part;
  }

  // Sets negative entries of y to zero if that changes w by no more than rounding.
  bool IsSolution(PartSolution& one) const {
    const Vector size = 10 * tolerance_ + kWorkingPrecision * (q_.cwiseAbs() + M_.cwiseAbs() * one.y.cwiseAbs());
    for (Index i = 0; i < q_.size(); ++i) {
      if (one.y[i] >= 0) continue;
      if ((M_.col(i).cwiseAbs() * -one.y[i]).cwiseQuotient(size.cwiseMax(1e-300)).maxCoeff() > 1) return false;
      one.y[i] = 0;
    }
    return (q_ + M_ * one.y + size).minCoeff() >= 0;
  }

  static Index AsIndex(const Indices& indices) { return static_cast<Index>(indices.size()); }

  const Matrix& M_;
  const Vector& q_;
  const Vector& tolerance_;
  const Matrix& rows_;
  std::vector<Clamp> clamps_;
};

class BlockSearch {
 public:
  BlockSearch(const Matrix& M, const Vector& q, const Vector& tolerance, const Matrix& observed,
              const std::vector<ClampBranches>& clamps, const Vector& sign)
      : M_(M), q_(q), tolerance_(tolerance), observed_(observed), clamps_(clamps), sign_(sign) {}

  BlockSolutions Run() {
    // A block depends on later ones.
    blocks_ = StronglyConnected(M_);
    FindNeeds();
    BlockSolutions found;
    std::vector<BlockSolution> partial = {{Vector::Zero(q_.size()), Vector(), Basis(AsSize(q_.size()), 0), false}};
    for (std::size_t b = blocks_.size(); b-- > 0;) {
      const Indices& block = blocks_[b];
      std::vector<BlockSolution> extended;
      for (const BlockSolution& before : partial) {
        PartSolutions part = SolveBlock(b, before.y);
        MarkBetween(M_(block, block), part.all);
        if (!part.is_decided || extended.size() + part.all.size() > kMaxChoices) {
          found.undecided = block;
          if (part.open_row >= NumNeeds(b)) found.open_row = part.open_row - NumNeeds(b);
          return found;
        }
        for (const PartSolution& one : part.all) {
          BlockSolution more = before;
          more.y(block) = one.y;
          more.is_between = more.is_between || one.is_between;
          for (std::size_t k = 0; k < block.size(); ++k) more.basis[AsSize(block[k])] = one.basis[k];
          extended.push_back(std::move(more));
        }
      }
      partial = std::move(extended);
    }
    for (BlockSolution& one : partial) Clean(one);
    found.all = std::move(partial);
    return found;
  }

 private:
  // Finds what must be the same in all solutions of a block: the rows by which later blocks of no class depend on it,
  // directly or not.
  void FindNeeds() {
    needs_.resize(blocks_.size());
    std::vector<bool> is_needed(blocks_.size(), false);
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      const MatrixClass& known = classes_.emplace_back(Classify(M_(blocks_[b], blocks_[b])));
      if (!known.p.yes() && !known.positive_semidefinite.yes()) is_needed[b] = true;
      for (std::size_t c = 0; c < b; ++c) {
        if (!is_needed[c]) continue;
        for (const Index i : blocks_[c]) {
          if (!Eigen::RowVectorXd(M_(i, blocks_[b])).isZero(0)) needs_[b].push_back(i);
        }
      }
      if (!needs_[b].empty()) is_needed[b] = true;
    }
  }
  Index NumNeeds(std::size_t b) const { return static_cast<Index>(needs_[b].size()); }

  PartSolutions SolveBlock(std::size_t b, const Vector& before) {
    const Indices& block = blocks_[b];
    const Matrix M = M_(block, block);
    const Matrix rows_of_block = M_(block, Eigen::all);
    const Vector q = q_(block) + rows_of_block * before;
    const Vector tolerance = tolerance_(block) + kLcpTolerance * (rows_of_block.cwiseAbs() * before.cwiseAbs());
    Matrix rows(NumNeeds(b) + observed_.rows(), M.cols());
    rows.topRows(NumNeeds(b)) = M_(needs_[b], block);
    rows.bottomRows(observed_.rows()) = observed_(Eigen::all, block);
    PartSolutions part = SolveMonotone(M, classes_[b], q, tolerance, rows);
    if (part.is_decided || part.open_row >= 0) return part;
    ClampTrials trials(M, q, tolerance, rows);
    for (const ClampBranches& clamp : clamps_) {
      trials.Add(BoundOf(clamp.low, block), BoundOf(clamp.high, block), clamp.is_gate);
    }
    part = trials.Run();
    if (part.is_decided || part.open_row >= 0 || M.rows() > kMaxBasicSolutionsSize) return part;
    bases_ += std::size_t{1} << M.rows();
    if (bases_ > kMaxBases) return part;
    return SearchBases(M, q, tolerance, !rows.isZero(0));
  }

  std::optional<ClampTrials::Bound> BoundOf(Index pair, const Indices& block) const {
    const auto place = std::find(block.begin(), block.end(), pair);
    if (pair < 0 || place == block.end()) return std::nullopt;
    return ClampTrials::Bound{place - block.begin(), sign_[pair] > 0};
  }

  static PartSolutions SearchBases(const Matrix& M, const Vector& q, const Vector& tolerance, bool is_needed) {
    const BasicSolutions solutions = AllBasicSolutions(M, q, {}, tolerance);
    PartSolutions part;
    part.is_decided = solutions.complete;
    const auto add = [&](const Vector& y, const Indices& basis) {
      part.all.push_back({y, Basis(AsSize(q.size()), 0)});
      for (const Index i : basis) part.all.back().basis[AsSize(i)] = 1;
    };
    for (const BasicSolution& one : solutions.solutions) add(one.y, one.basis);
    for (const SolutionFace& face : solutions.faces) {
      if (!face.point && is_needed) part.is_decided = false;
      add(face.nearest, face.basis);
    }
    return part;
  }

  void Clean(BlockSolution& one) const {
    one.w = q_ + M_ * one.y;
    const Vector size = 10 * tolerance_ + kWorkingPrecision * (q_.cwiseAbs() + M_.cwiseAbs() * one.y);
    one.w = (one.w.array() <= size.array()).select(0, one.w);
    for (Index i = 0; i < q_.size(); ++i) {
      const bool is_rounding = (one.y[i] * M_.col(i).cwiseAbs().array() <= size.array()).all();
      if (!one.basis[AsSize(i)] || (is_rounding && !M_.col(i).isZero(0))) one.y[i] = 0;
    }
    MakeRegular(one);
  }

  // A basis with a nonsingular M where ties allow one: of an open switch the voltage alone is positive, and its row is
  // zero; its current, which is zero, belongs to the basis too.
  void MakeRegular(BlockSolution& one) const {
    for (const Indices& block : blocks_) {
      Indices basis, ties;
      for (const Index i : block) {
        if (one.y[i] > 0) basis.push_back(i);
        if (one.y[i] == 0 && one.w[i] == 0) ties.push_back(i);
      }
      Index rank = RankOf(basis);
      for (bool grows = true; grows && rank < static_cast<Index>(basis.size());) {
        grows = false;
        for (std::size_t k = 0; k < ties.size() && !grows; ++k) {
          Indices larger = basis;
          larger.push_back(ties[k]);
          const Index more = RankOf(larger);
          if (more < rank + 2) continue;
          basis = std::move(larger);
          rank = more;
          ties.erase(ties.begin() + static_cast<std::ptrdiff_t>(k));
          grows = true;
        }
      }
      if (rank < static_cast<Index>(basis.size())) continue;
      for (const Index i : block) one.basis[AsSize(i)] = 0;
      for (const Index i : basis) one.basis[AsSize(i)] = 1;
    }
  }

  Index RankOf(const Indices& basis) const { return basis.empty() ? 0 : EquilibratedLu(M_(basis, basis)).rank(); }

  const Matrix& M_;
  const Vector& q_;
  const Vector& tolerance_;
  const Matrix& observed_;
  const std::vector<ClampBranches>& clamps_;
  const Vector& sign_;
  std::vector<Indices> blocks_;
  std::vector<MatrixClass> classes_;
  std::vector<Indices> needs_;
  std::size_t bases_ = 0;
};

}  // namespace

BlockSolutions SolveByBlocks(const Matrix& M, const Vector& q, const Vector& tolerance, const Matrix& observed,
                             const std::vector<ClampBranches>& clamps, const Vector& sign) {
  return BlockSearch(M, q, tolerance, observed, clamps, sign).Run();
}

Index FirstOpenRow(const Matrix& given_M, const Vector& given_q, const Matrix& rows, const Vector& y,
                   const Matrix& fixed) {
  const Index pairs = y.size();
  Vector unit(pairs);  // of y: M then has entries of a moderate size
  for (Index k = 0; k < pairs; ++k) unit[k] = given_M(k, k) > 0 ? 1 / std::sqrt(given_M(k, k)) : 1;
  const Matrix M = unit.asDiagonal() * given_M * unit.asDiagonal();
  const Vector q = unit.cwiseProduct(given_q), at = y.cwiseQuotient(unit);
  const double size = std::max({1e-300, q.cwiseAbs().maxCoeff(), at.cwiseAbs().maxCoeff()});

  LinearProgram program = MakeLinearProgram(2 * pairs + 1 + fixed.rows(), pairs);
  const Vector z = at / size, scaled_q = q / size;
  program.rows.topRows(pairs) = M;
  program.row_lower.head(pairs) = -scaled_q;
  program.rows.middleRows(pairs, pairs) = M + M.transpose();
  program.row_lower.segment(pairs, pairs) = program.row_upper.segment(pairs, pairs) = (M + M.transpose()) * z;
  program.rows.row(2 * pairs) = scaled_q.transpose();
  program.row_lower[2 * pairs] = program.row_upper[2 * pairs] = scaled_q.dot(z);
  for (Index k = 0; k < fixed.rows(); ++k) {
    Eigen::RowVectorXd row = fixed.row(k) * unit.asDiagonal();
    row /= std::max(1e-300, row.cwiseAbs().maxCoeff());
    program.rows.row(2 * pairs + 1 + k) = row;
    program.row_lower[2 * pairs + 1 + k] = program.row_upper[2 * pairs + 1 + k] = row.dot(z.transpose());
  }
  for (Index s = 0; s < rows.rows(); ++s) {
    Eigen::RowVectorXd row = rows.row(s) * unit.asDiagonal();
    const double largest = row.cwiseAbs().maxCoeff();
    if (largest == 0) continue;
    row /= largest;
    for (const double sign : {1.0, -1.0}) {
      program.cost = sign * row.transpose();
      const LinearProgramSolution solution = SolveLinearProgram(program);
      if (solution.verdict == LinearProgramVerdict::kUnboundedBelow) return s;
      if (solution.verdict != LinearProgramVerdict::kOptimal) return -2;
      if (std::abs(solution.objective - sign * row.dot(z.transpose())) >
          kClearDifference * (1 + z.cwiseAbs().maxCoeff()))
        return s;
    }
  }
  return -1;
}

}  // namespace dlcs
