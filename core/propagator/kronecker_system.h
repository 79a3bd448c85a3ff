// SPDX-License-Identifier: Apache-2.0
// A Kronecker sum as a propagator.

#ifndef DLCS_CORE_PROPAGATOR_KRONECKER_SYSTEM_H_
#define DLCS_CORE_PROPAGATOR_KRONECKER_SYSTEM_H_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/propagator/kronecker_kernel.h"
#include "core/propagator/propagator.h"
#include "core/shared_setups.h"

namespace dlcs {

// The propagator of core/propagator/kronecker_modes.h. Sources that act as y does, f = b ⊗ C' ψ, cost one response of a
// kernel; others are integrated in all m modes.
class KroneckerSystem final : public Propagator {
 public:
  // Null if A is not a symmetric Kronecker sum, or if B and N do not act through one vector along one axis; `why_not`
  // says which. `setups` shares modes and kernels with other solves of the same A, B and N, and must outlive the
  // system; if it is null the system keeps its own. Cost: an eigenvalue problem for each factor that is not a second
  // difference.
  static std::unique_ptr<KroneckerSystem> Create(const Problem& problem, std::string& why_not,
                                                 SetupCache* setups = nullptr);

  // Cost: p exponentials for each term, and a transform of C. `longest_window` is not used.
  std::shared_ptr<const ReducedKernel> MakeKernel(double step, Hold hold, Index longest_window, Workers& workers,
                                                  const std::stop_token& stop) override;
  // Cost: p r (q + 2J) multiplications, r = basis.kept, and for sources those of a kernel; 3 m J where the sources are
  // general.
  FreeMotion Move(const Vector& x, const RunSources& sources, Hold hold, Workers& workers,
                  const std::stop_token& stop) override;
  // Cost: p r J multiplications, and for each output p r q and the transforms of a state; 3 m J where the sources are
  // general.
  Matrix States(const Vector& x, const RunSources& sources, const Matrix& y, Hold hold, const std::vector<Index>& nodes,
                Workers& workers, const std::stop_token& stop) override;
  PropagatorRecord record() const override;

 private:
  // How f enters.
  enum class SourceForm { kNone, kAlongWall, kGeneral };

  KroneckerSystem(std::shared_ptr<const KroneckerModes> modes, SetupKey matrices, SharedSetups setups,
                  const Problem& problem);

  // The kernel from the cache; made if it is not there.
  std::shared_ptr<const KroneckerKernel> Kernel(double step, Hold hold);
  // StateToModes(x), cached, since Move() and States() need the same.
  const Matrix& ModesOf(const Vector& x);
  // Integrates the response to lift ψ from a zero state in all m modes, for kGeneral. Calls visit(j, node, middle of
  // step j) for j = 1, 2, ....
  void CarrySources(const RunSources& sources, const std::stop_token& stop,
                    const std::function<void(Index, const Matrix&, const Matrix&)>& visit) const;

  std::shared_ptr<const KroneckerModes> modes_;
  SourceForm form_ = SourceForm::kNone;
  SeparableMatrix C_psi_;  // with kAlongWall
  StructuredMatrix lift_;  // with kGeneral; empty: the identity
  SetupKey matrices_;
  SharedSetups setups_;
  Vector state_;        // the last of ModesOf(),
  Matrix state_modes_;  // and its modes
};

}  // namespace dlcs

#endif  // DLCS_CORE_PROPAGATOR_KRONECKER_SYSTEM_H_
