// SPDX-License-Identifier: Apache-2.0
// Values of elements that have no meaning.

#ifndef DLCS_CORE_CIRCUITS_ELEMENT_FAULTS_H_
#define DLCS_CORE_CIRCUITS_ELEMENT_FAULTS_H_

#include "absl/status/status.h"
#include "core/circuits/circuit.h"

namespace dlcs {

// Errors: InvalidArgument with the first element or coupling whose value is out of range.
absl::Status CheckElements(const Circuit& circuit);

}  // namespace dlcs

#endif  // DLCS_CORE_CIRCUITS_ELEMENT_FAULTS_H_
