// SPDX-License-Identifier: Apache-2.0
// Compares two forms of a source as functions of time. Needs the engine in the process.

#ifndef DLCS_CLIENT_LOCAL_AGREEMENT_H_
#define DLCS_CLIENT_LOCAL_AGREEMENT_H_

#include "dlcs/v1/solver.pb.h"

namespace dlcs::client {

// Whether `one` and `other`, of `size` components, agree to nine digits of each component at 257 even times inside (0,
// T) of `problem`, whose parameters their formulas may have. False if one of them is not valid.
bool AreSameFunction(const v1::TimeFunction& one, const v1::TimeFunction& other, int size, const v1::Problem& problem);

}  // namespace dlcs::client

#endif  // DLCS_CLIENT_LOCAL_AGREEMENT_H_
