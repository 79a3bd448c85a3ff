// SPDX-License-Identifier: Apache-2.0
// A solution of LCP(q, M) for P-matrices and for matrices of no particular class.

#ifndef DLCS_CORE_LCP_DENSE_COMPLEMENTARY_SOLVER_H_
#define DLCS_CORE_LCP_DENSE_COMPLEMENTARY_SOLVER_H_

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "core/lcp/basis/basis_point.h"
#include "core/lcp/basis/principal_pivoting.h"
#include "core/lcp/dense/bimatrix_games.h"
#include "core/lcp/dense/lemke.h"

namespace dlcs {

// Tries, each only where the one before gave no answer: the guessed basis; block principal pivoting from it
// (P-matrices, and a few rounds for large others); the method of Lemke and Howson for nonnegative bimatrix games;
// Lemke's method; that of Lemke and Howson for other games; and where Lemke's ends in a ray, to prove by the ray that
// the LCP is infeasible, enumeration (n <= 12), and a linear program for infeasibility.
class ComplementarySolver final : public LcpSolver {
 public:
  // What the caller knows about M; it is not checked.
  enum class Known {
    kNothing,
    kPMatrix,
    kMMatrix,  // P and Z: bases are factored without row exchanges, in the band of M
  };

  ComplementarySolver(const Matrix& M, Known known);

  LcpStatus Solve(const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance, Basis& basis,
                  Eigen::Ref<Vector> y) override;
  bool SolvesIn(const Basis& basis, const Eigen::Ref<const Vector>& q, const Eigen::Ref<const Vector>& tolerance,
                Eigen::Ref<Vector> y) override;

  // As Solve(), but where several solutions can be found one with a basis that `preferred` accepts is taken:
  // the guess and Lemke's solution count only if accepted, then enumeration looks for one (n <= 12).
  LcpStatus SolvePreferring(const std::function<bool(const Basis&)>& preferred, const Eigen::Ref<const Vector>& q,
                            const Eigen::Ref<const Vector>& tolerance, Basis& basis, Eigen::Ref<Vector> y);

  LcpStats Account() const override { return {pivots_, method_, message_}; }
  std::unique_ptr<LcpSolver> Clone() const override;

 private:
  LcpStatus SolveFromScratch(Basis& basis, Eigen::Ref<Vector> y);
  bool Accept(const Basis& basis, Eigen::Ref<Vector> y);
  bool Polish(Basis& basis);
  bool SolveGames(const BimatrixGames& games, Basis& basis, Eigen::Ref<Vector> y);
  LcpStatus AfterRay(Basis& basis, Eigen::Ref<Vector> y);
  LcpStatus Fail(LcpStatus verdict, const char* why, Eigen::Ref<Vector> y);

  Known known_;
  Exchange exchange_;
  ScaledLcp lcp_;
  BasisPoint point_;
  std::optional<Lemke> lemke_;  // made when first needed: 2n² numbers
  Index pivots_ = 0;
  const char* method_ = "";
  std::string message_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_LCP_DENSE_COMPLEMENTARY_SOLVER_H_
