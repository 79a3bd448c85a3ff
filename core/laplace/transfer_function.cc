// SPDX-License-Identifier: Apache-2.0
#include "core/laplace/transfer_function.h"

#include <memory>

#include "core/laplace/resolvent.h"

namespace dlcs {

TransferFunction DenseTransferFunction(const Problem& problem) {
  struct InSchurCoordinates {
    explicit InSchurCoordinates(const Problem& problem)
        : resolvent(problem.A), B(resolvent.to() * problem.B.Dense()), N(problem.N.Dense() * resolvent.from()) {}
    Resolvent resolvent;
    Eigen::MatrixXcd B, N;
  };
  const auto system = std::make_shared<const InSchurCoordinates>(problem);
  return {.value =
              [system](std::complex<double> z) {
                Eigen::MatrixXcd columns = system->B;
                system->resolvent.Solve(z, columns);
                return Eigen::MatrixXcd(system->N * columns);
              },
          .eigenvalues = system->resolvent.Eigenvalues()};
}

}  // namespace dlcs
