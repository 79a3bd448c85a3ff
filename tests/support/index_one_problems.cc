// SPDX-License-Identifier: Apache-2.0
#include "tests/support/index_one_problems.h"

namespace dlcs::testing {

Problem IndexOneProblem(const IndexOneSystem& system, const Vector& x0, double horizon) {
  Problem problem;
  problem.A = system.A;
  problem.B = system.B;
  problem.N = system.C;
  problem.M = Matrix::Zero(system.C.rows(), system.C.rows());
  problem.f = TimeFunction::Zero(system.A.rows());
  problem.g = TimeFunction::Zero(system.C.rows());
  problem.x0 = x0;
  problem.horizon = horizon;
  return problem;
}

IndexOneSystem ExampleTenSystem() {
  IndexOneSystem system{Matrix::Zero(4, 4), Matrix::Zero(4, 3), Matrix::Identity(3, 4)};
  system.A.topRightCorner(3, 1).setConstant(-1);
  system.B.topRows(3) << 1, 3, 0, 0, 1, 3, 3, 0, 1;
  return system;
}

IndexOneSystem ThreeContacts() {
  IndexOneSystem system{Matrix::Zero(5, 5), Matrix::Zero(5, 3), Matrix::Identity(3, 5)};
  system.A.topLeftCorner(3, 3) << -0.2, 0.1, 0, 0.3, -0.1, 0.2, 0, 0.1, -0.3;
  system.A.topRightCorner(3, 2) << 1, 0.5, -1, 1, 0.3, -2;
  system.A(3, 4) = 2;
  system.A(4, 3) = -2;
  system.B.topRows(3) << 2, -1, 0, -0.5, 2, -1, -0.5, -0.5, 1.5;
  return system;
}

Vector ThreeContactsStart() { return Vector{{0.2, 0.1, 0.3, 1, 0}}; }

}  // namespace dlcs::testing
